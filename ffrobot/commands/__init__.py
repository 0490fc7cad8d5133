"""The commands of the command line, a file for those that belong together. Heavy imports happen inside them."""
