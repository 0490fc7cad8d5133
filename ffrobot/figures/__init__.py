"""Figures of a results file: those that `figures.toml` beside it names, or the standard ones of any scene."""
