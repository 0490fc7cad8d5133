"""Output of the command line: summaries, tables, progress, logs."""
