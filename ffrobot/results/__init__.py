"""The results file: its groups, written and read."""
