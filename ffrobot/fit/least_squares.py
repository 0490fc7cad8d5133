"""Parameters by least squares from measured natural frequencies, with their uncertainty (NumPy and SciPy alone).

Parameters are positive, and fitted by their logarithms: x = ln(θ/θ₀). Residuals are r_i = (f_i(θ)/f_i − 1)/s_i with the
relative uncertainty s_i of the measured f_i, or 1 where none is known. With J = ∂r/∂x at the end, the covariance of x
is σ² (JᵀJ)⁻¹, where σ² is 1 with known uncertainties and else |r|²/(m − n) (Seber and Wild, Nonlinear Regression, 2.1).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, SolveError
from ..common.libraries import scipy

STEP = 1e-3  # of ln θ, on both sides: frequencies of finite elements are known to about 1e-9
NO_EFFECT = 1e-4  # of a parameter, or a combination, against the largest: differences have errors of 1e-6
SHARE = 0.1  # of the largest: entries of a combination that are named
MOST_EVALUATIONS = 100
ANOTHER = 0.1  # error of a frequency, relative, as of another mode
FEW = 30  # degrees of freedom below which 95 % is more than two standard deviations
UNSEEN = 0.5  # relative deviation of a parameter from which the measurement hardly determines it
ALIKE = 0.95  # correlation of errors from which parameters are hardly distinguishable

Frequencies = Callable[[Array], Array]
"""Frequencies (m,), Hz, of parameters (n,)."""


@dataclass(frozen=True, kw_only=True)
class Parameters(ABC):
    """The n fitted parameters.

    Attributes:
        keys: names of the parameters.
        start, value: (n,) before and after the fit, in the units of the keys.
        relative_deviation: (n,) standard deviations of the parameters, relative to them; NaN where not known.
        correlation: (n, n) of the parameters' errors, no unit; NaN where not known.
        files: the files written.
    """

    keys: tuple[str, ...]
    start: Array
    value: Array
    relative_deviation: Array
    correlation: Array
    files: tuple[str, ...] = ()

    @property
    def deviation(self) -> Array:
        """Standard deviations (n,) of the parameters, in their units."""
        return self.relative_deviation * self.value

    @abstractmethod
    def comparison(self) -> tuple[Sequence[str], Iterator[Sequence[str]]]:
        """Heading and rows of a table that compares the measurement with the model."""

    def remarks(self) -> Iterator[str]:
        """Yield notes on the accuracy of the fit; here on parameters that are hardly known, alone or in pairs."""
        for key, deviation in zip(self.keys, self.relative_deviation, strict=True):
            if deviation > UNSEEN:
                yield f"{key} is hardly determined: its standard deviation is {100 * deviation:.2g} % of it"
        for i, j in zip(*np.triu_indices(len(self.keys), 1), strict=True):
            if abs(self.correlation[i, j]) > ALIKE:
                yield (
                    f"{self.keys[i]} and {self.keys[j]} are hardly distinguishable: their errors have a correlation of"
                    f" {self.correlation[i, j]:.4f}"
                )


@dataclass(frozen=True, kw_only=True)
class Fit(Parameters):
    """Parameters fitted to m measured frequencies.

    Attributes:
        labels: (m) names of the modes.
        measured, before, after: (m,) Hz.
        uncertainty: (m,) standard deviations of `measured`, Hz; None where not known.
    """

    labels: tuple[str, ...]
    measured: Array
    before: Array
    after: Array
    uncertainty: Array | None

    @property
    def degrees_of_freedom(self) -> int | None:
        """Degrees of freedom of the estimated deviations; None with given uncertainties."""
        return None if self.uncertainty is not None else len(self.measured) - len(self.keys)

    def coverage_factor(self, probability: float) -> float:
        """Return the half width of a confidence interval of this probability, in standard deviations.

        By Student's t where deviations are estimated from remaining errors (JCGM 100:2008, G.3); NaN if none remain.
        """
        freedom = self.degrees_of_freedom
        return float(scipy.stats.t.ppf(0.5 + 0.5 * probability, np.inf if freedom is None else freedom))

    @property
    def error(self) -> Array:
        """Relative errors (m,), no unit, of the fitted frequencies."""
        return self.after / self.measured - 1.0

    @property
    def misfit(self) -> float:
        """√(Σ (error/uncertainty)²/(m − n)) with n parameters: about 1 for a right model; NaN without uncertainties."""
        spare = len(self.measured) - len(self.keys)
        if self.uncertainty is None or spare == 0:
            return np.nan
        return float(np.linalg.norm((self.after - self.measured) / self.uncertainty) / np.sqrt(spare))

    def comparison(self) -> tuple[Sequence[str], Iterator[Sequence[str]]]:
        """Heading and rows of the table of modes."""
        columns = self.labels, self.measured, self.before, self.after, self.error
        rows = (
            (label, *(f"{frequency:.6g}" for frequency in frequencies), f"{100 * error:+.3f} %")
            for label, *frequencies, error in zip(*columns, strict=True)
        )
        return ("mode", "measured (Hz)", "start (Hz)", "fitted (Hz)", "error"), rows

    def remarks(self) -> Iterator[str]:
        """Yield notes on the accuracy of the fit."""
        if np.isnan(self.relative_deviation).any():
            yield (
                "as many frequencies as keys: they fit whatever their errors, so no uncertainty is known; give a column"
                " uncertainty (Hz), or more modes"
            )
        if self.degrees_of_freedom and self.degrees_of_freedom < FEW:
            wide, narrow = self.coverage_factor(0.95), self.coverage_factor(0.6827)
            yield (
                f"standard deviations are estimated from {self.degrees_of_freedom} degrees of freedom: the range of"
                f" 95 % is ± {wide:.3g} of them, that of 68 % ± {narrow:.3g} (Student's t); a column uncertainty (Hz),"
                " or more modes, make it narrower"
            )
        yield from super().remarks()
        if (worst := np.abs(self.error).max()) > ANOTHER:
            yield f"errors of up to {100 * worst:.0f} %: does a mode missing in the table shift the numbers of others?"
        if self.misfit > 2.0:
            yield (
                f"the remaining errors are {self.misfit:.3g} times the uncertainties: the model lacks something that no"
                " varied key describes"
            )


def fit_frequencies(
    frequencies: Frequencies,
    keys: Sequence[str],
    start: Array,
    labels: Sequence[str],
    measured: Array,
    uncertainty: Array | None = None,
) -> Fit:
    """Find the parameters, from `start` (n,) on, whose frequencies are nearest to the `measured` ones (m,), Hz.

    `frequencies` returns those (m,), Hz, of parameters (n,) in units of `keys`. `uncertainty` (m,), Hz: standard
    deviations of `measured`. `keys` and `labels` name parameters and modes.

    Raises:
        InputError: fewer frequencies than parameters, or parameters that they cannot distinguish.
        SolveError: the iteration does not converge.
    """
    if len(measured) < len(keys):
        raise InputError(
            "fit: expected at least as many measured frequencies as keys to vary",
            f"{len(measured)} of {', '.join(labels) or 'no mode'} for {len(keys)}: {', '.join(keys)}",
        )
    weight = 1.0 if uncertainty is None else measured / uncertainty

    def residuals(x: Array) -> Array:
        return (frequencies(start * np.exp(x)) / measured - 1.0) * weight

    def jacobian(x: Array) -> Array:
        steps = STEP * np.eye(len(keys))
        return np.column_stack([(residuals(x + step) - residuals(x - step)) / (2 * STEP) for step in steps])

    origin = np.zeros(len(keys))
    check_distinguishable(jacobian(origin), keys)
    optimum = scipy.optimize.least_squares(
        residuals, origin, jac=jacobian, max_nfev=MOST_EVALUATIONS, xtol=1e-10, ftol=1e-14
    )
    if not optimum.success:
        raise SolveError(f"fit: no convergence within {MOST_EVALUATIONS} steps: start nearer to the measured values")
    J, r = jacobian(optimum.x), optimum.fun
    check_distinguishable(J, keys)
    before, after = (measured * (1.0 + residuals(x) / weight) for x in (origin, optimum.x))
    return Fit(
        keys=tuple(keys),
        start=start,
        value=start * np.exp(optimum.x),
        **uncertainty_of(J, r, known=uncertainty is not None),
        labels=tuple(labels),
        measured=measured,
        before=before,
        after=after,
        uncertainty=uncertainty,
    )


def check_distinguishable(
    J: Array, keys: Sequence[str], measured: str = "frequencies", *, least: float = NO_EFFECT
) -> None:
    """Raise `InputError` for parameters `keys`, or combinations, without effect on residuals: null vectors of J.

    J (m, n), m ≥ n: derivatives by the logarithms of parameters, no unit. `least`: smallest relative effect.
    `measured`: word for the measurement in messages.
    """
    _, values, V = np.linalg.svd(J, full_matrices=False)
    sizes = np.linalg.norm(J, axis=0)
    without = [key for key, size in zip(keys, sizes, strict=True) if size <= least * sizes.max()]
    if not without and values[-1] > least * values[0]:
        return
    vector = V[-1] / V[-1][np.abs(V[-1]).argmax()]
    named = [(key, part) for key, part in zip(keys, vector, strict=True) if abs(part) > SHARE]
    if without or len(named) == 1:
        key = (*without, named[0][0])[0]
        raise InputError(f"fit: expected keys on which the measured {measured} depend", f"{key}: leave it out")
    change = ", ".join(f"{key} times c" + ("" if part > 1 - 1e-3 else f"^{part:.3g}") for key, part in named)
    raise InputError(
        f"fit: expected keys that the measured {measured} distinguish",
        f"no change of these with {change}, for any c: vary only {len(named) - 1} of these {len(named)}, or measure"
        " with a known mass or spring attached",
    )


def uncertainty_of(J: Array, r: Array, *, known: bool) -> dict[str, Any]:
    """Return the `relative_deviation` (n,) and `correlation` (n, n) of `Parameters`, no unit.

    By residuals r (m,), their derivatives J (m, n), no unit; NaN for m = n without `known` measurement uncertainties.
    """
    m, n = J.shape
    inverse = np.linalg.inv(J.T @ J) if known or m > n else np.full((n, n), np.nan)
    variance = 1.0 if known else r @ r / max(m - n, 1)
    deviation = np.sqrt(np.diag(inverse))
    correlation = inverse / np.outer(deviation, deviation)
    return {"relative_deviation": np.sqrt(variance) * deviation, "correlation": correlation}
