"""Stage 2: modal multibody dynamics in the floating frame of reference; loads no finite element library."""
