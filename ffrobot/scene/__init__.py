"""The scene as a whole: its file, THE list of kinds of analysis, and what its tables refer to."""
