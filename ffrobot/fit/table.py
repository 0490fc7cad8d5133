"""What `ffrobot fit` prints: parameters with their uncertainty, frequencies before and after, what to mind."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console

from ..present.lines import plain_table
from .least_squares import Fit

FEW = 30  # degrees of freedom below which two standard deviations are less than a range of 95 %
ALIKE = 0.95  # correlation of two parameters' errors from which their values are hardly distinguished


def print_fit(fit: Fit, console: Console) -> None:
    """Tables of parameters and modes, remarks, and the files written."""
    parameters = plain_table("key", "start", "fitted", "standard deviation")
    for key, start, value, spread in zip(fit.keys, fit.start, fit.value, fit.relative_deviation, strict=True):
        deviation = "not known" if np.isnan(spread) else f"{spread * value:.2g} ({100 * spread:.2g} %)"
        parameters.add_row(key, f"{start:.6g}", f"{value:.6g}", deviation)
    modes = plain_table("mode", "measured (Hz)", "start (Hz)", "fitted (Hz)", "error")
    rows = zip(fit.labels, fit.measured, fit.before, fit.after, fit.error, strict=True)
    for label, measured, before, after, error in rows:
        modes.add_row(label, f"{measured:.6g}", f"{before:.6g}", f"{after:.6g}", f"{100 * error:+.3f} %")
    for table in (parameters, modes):
        console.print(table)
        console.print()
    for line in (*remarks(fit), *(f"written: {path}" for path in fit.files)):
        console.print(line, soft_wrap=True, markup=False)


def remarks(fit: Fit) -> Iterator[str]:
    """What to mind about the numbers."""
    if np.isnan(fit.relative_deviation).any():
        yield (
            "as many frequencies as keys: they fit whatever their errors, so no uncertainty is known; give a column"
            " uncertainty (Hz), or more modes"
        )
    if fit.degrees_of_freedom and fit.degrees_of_freedom < FEW:
        wide, narrow = fit.coverage_factor(0.95), fit.coverage_factor(0.6827)
        yield (
            f"standard deviations are estimated from {fit.degrees_of_freedom} degrees of freedom: the range of 95 % is"
            f" ± {wide:.3g} of them, that of 68 % ± {narrow:.3g} (Student's t); a column"
            " uncertainty (Hz), or more modes, make it narrower"
        )
    for i, j in zip(*np.triu_indices(len(fit.keys), 1), strict=True):
        if abs(fit.correlation[i, j]) > ALIKE:
            yield (
                f"{fit.keys[i]} and {fit.keys[j]} are hardly distinguishable: their errors have a correlation of"
                f" {fit.correlation[i, j]:.4f}"
            )
    if fit.misfit > 2.0:
        yield (
            f"the remaining errors are {fit.misfit:.3g} times the uncertainties: the model lacks something that no"
            " varied key describes"
        )
