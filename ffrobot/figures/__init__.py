"""Figures of results (those that `figures.toml` beside them names, or the standard ones) and of modal bodies."""

from .plot import plot_file, plot_modal_body, plot_results

__all__ = ["plot_file", "plot_modal_body", "plot_results"]
