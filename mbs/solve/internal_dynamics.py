"""Internal dynamics of a path under motors alone: r(t, p, ṗ, p̈) = 0, and its zeros.

With p(t) given the joints follow from the path, and r, the modal forces that motors do not supply, is what has to
vanish: the zero dynamics about a path that is held (Blajer and Kolodziejczyk 2004; Seifried 2014, ch. 4).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np

from ...common.arrays import Array, Booleans, ComplexArray
from ...common.errors import SolveError
from .._core import TimeFunction

DIFFERENCE = 1e-6  # of √J, by which a mode bends its link by about its length
MOST_ITERATIONS = 50
TOLERANCE = 1e-12  # of an equilibrium's last Newton step
CENTRE = 1e-6  # |Re s| / |s| of zeros that count as undamped


class Stopped(Exception):  # noqa: N818 (nothing is wrong)
    """Whoever watches asked for an end."""


class Target(NamedTuple):
    """A function of time of a path: the trajectory that it is of, its component, and itself."""

    owner: str
    component: str
    function: TimeFunction


class Output(Protocol):
    """A path that motors alone are to carry; `factor` and `offset` as in `servo.Servo`."""

    @property
    def factor(self) -> float:
        """Share of the deflections in what follows the path."""
        ...

    @property
    def scale(self) -> Array:
        """Frequencies ω of all modes (n,), rad/s."""
        ...

    @property
    def mode_sizes(self) -> Array:
        """√J of the bodies of all modes (n,), m·√kg: coordinates that bend a link by about its length."""
        ...

    @property
    def where(self) -> str:
        """The scene, and the analysis where it is known, for messages."""
        ...

    @property
    def mode_counts(self) -> list[int]:
        """By body."""
        ...

    @property
    def doubt(self) -> str:
        """What is wrong with postures along the path; "" where nothing is."""
        ...

    def residuals(self, times: Array, p: Array, v: Array, a: Array, /) -> Array:
        """Forces r (N, n) on modes that nobody supplies, at `times` (N,), p, ṗ and p̈ (N, n); NaN out of reach.

        May raise `Stopped`.
        """
        ...

    def derivatives(self, times: Array, p: Array, v: Array, a: Array, /) -> tuple[Array, Array, Array]:
        """M, D and K, (N, n, n) each: derivatives of these by p̈, ṗ and p; exact, or `by_differences`."""
        ...

    def targets(self) -> Iterator[Target]:
        """What the path follows."""
        ...

    def with_factor(self, factor: float) -> Self:
        """The same with another factor."""
        ...

    def with_offset(self, offset: tuple[TimeFunction, ...]) -> Self:
        """The same with what is expected of the deflections that the output leaves out."""
        ...


@dataclass(frozen=True)
class LinearDynamics:
    """M δp̈ + D δṗ + K δp = 0 of the internal dynamics at `times` (N,): each (N, n, n)."""

    times: Array
    M: Array
    D: Array
    K: Array

    def __call__(self, times: Array) -> tuple[Array, Array, Array]:
        """M, D, K at any times, straight lines between those that are known."""
        right = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        left = right - 1
        width = self.times[right] - self.times[left]
        share = np.clip((times - self.times[left]) / width, 0.0, 1.0)[:, None, None]
        M, D, K = ((1 - share) * x[left] + share * x[right] for x in (self.M, self.D, self.K))
        return M, D, K


def linear_dynamics(servo: Output, times: Array, p: Array, v: Array, a: Array) -> LinearDynamics:
    """Derivatives of r at N nodes: times (N,), p, ṗ, p̈ (N, n)."""
    return LinearDynamics(times, *servo.derivatives(times, p, v, a))


def by_differences(servo: Output, times: Array, p: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
    """M, D and K by central differences; r is quadratic in ṗ and linear in p̈, so that these are exact there."""
    return slopes_by_differences(servo.residuals, servo.mode_sizes, times, p, v, a)


def slopes_by_differences(
    forces: Callable[[Array, Array, Array, Array], Array], sizes: Array, times: Array, p: Array, v: Array, a: Array
) -> tuple[Array, Array, Array]:
    """Derivatives (N, …, n) of `forces` (N, …) by p̈, ṗ and p; `sizes` (n,) of modes as in `Output.mode_sizes`."""
    modes, one = np.array([p, v, a]), np.ones(p.shape[1])
    K, D, M = (_derivative(forces, times, modes, k, step) for k, step in enumerate((DIFFERENCE * sizes, one, one)))
    return M, D, K


def stiffness(servo: Output, times: Array, p: Array) -> Array:
    """K (N, n, n) alone, at times (N,) and p (N, n) at rest."""
    rest = np.array([p, 0 * p, 0 * p])
    return _derivative(servo.residuals, times, rest, 0, DIFFERENCE * servo.mode_sizes)


def _derivative(
    forces: Callable[[Array, Array, Array, Array], Array], times: Array, modes: Array, k: int, step: Array
) -> Array:
    """Of `forces` by modes[k] (N, …, n), about `modes` (3, N, n)."""
    n = len(step)
    moved = np.repeat(modes[:, :, None], 2 * n, axis=2)
    moved[k] += np.concatenate([np.diag(step), -np.diag(step)])
    r = forces(np.repeat(times, 2 * n), *moved.reshape(3, -1, n)).reshape(len(times), 2, n, -1)
    found: Array = ((r[:, 0] - r[:, 1]) / (2 * step[:, None])).transpose(0, 2, 1)
    return found


def equilibrium(servo: Output, t: float) -> Array:
    """Shape p (n,) at rest under path and loads as at time t. Raises `SolveError` where there is none."""
    p: Array = np.zeros((1, len(servo.scale)))
    rest, now = np.zeros_like(p), np.array([t])
    for _ in range(MOST_ITERATIONS):
        r = servo.residuals(now, p, rest, rest)[0]
        K = stiffness(servo, now, p)[0]
        if not (np.all(np.isfinite(r)) and np.all(np.isfinite(K))):
            break
        step = np.linalg.solve(K, r)
        p = p - step
        if np.linalg.norm(step) <= TOLERANCE * (np.linalg.norm(p) + 1e-12):
            return np.asarray(p[0])
    soft = "the links are too soft for their loads there: stiffen them, or take less payload"
    cause = cause_in_posture(servo) or soft
    raise SolveError(f"{servo.where}: no equilibrium under the motors was found at t = {t:g} s: {cause}")


def cause_in_posture(servo: Output) -> str:
    """Why links that bend leave an output without a posture, and the cure, where postures are it; else ""."""
    return servo.doubt and f"{servo.doubt}, and cannot where links bend. Move the path, or start in another posture"


def first_order(dynamics: LinearDynamics, k: int, scale: Array) -> Array:
    """Matrix (2n, 2n) of ẏ = 𝒜 y for y = (ω p, ṗ), at node k."""
    n = len(scale)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.diag(scale)
    A[n:, :n] = -np.linalg.solve(dynamics.M[k], dynamics.K[k] / scale)
    A[n:, n:] = -np.linalg.solve(dynamics.M[k], dynamics.D[k])
    return A


def zeros(dynamics: LinearDynamics, scale: Array) -> ComplexArray:
    """Zeros (N, 2n) from motors to path, 1/s, of the equations frozen at each node; the slowest first."""
    s = np.linalg.eigvals(np.array([first_order(dynamics, k, scale) for k in range(len(dynamics.times))]))
    found: ComplexArray = np.take_along_axis(s, np.argsort(np.abs(s), axis=1, kind="stable"), axis=1)
    return found


def is_unstable(s: ComplexArray) -> Booleans:
    """Zeros in the right half plane, beyond rounding."""
    return s.real > CENTRE * np.abs(s)
