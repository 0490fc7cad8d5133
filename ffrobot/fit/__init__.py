"""Keys of link and scene files fitted to measured natural frequencies: `ffrobot fit`."""

from .fitting import fit_measured
from .least_squares import Fit, fit_frequencies

__all__ = ["Fit", "fit_frequencies", "fit_measured"]
