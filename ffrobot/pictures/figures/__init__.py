"""Figures of results (those that `figures.toml` beside them names, or the standard ones) and of modal bodies."""
