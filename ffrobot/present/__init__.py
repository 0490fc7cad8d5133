"""What the command line prints: summaries, tables, progress, logs."""
