"""What stable inversion asks of a path under motors, in the plane or in space: r(t, p, ṗ, p̈) = 0 and what it is of."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Protocol, Self

from ...common.arrays import Array
from .._core import TimeFunction


class Derivatives(Protocol):
    """Of r at N nodes, each of n² numbers a node."""

    @property
    def M(self) -> Array:
        """By p̈."""
        ...

    @property
    def D(self) -> Array:
        """By ṗ."""
        ...

    @property
    def K(self) -> Array:
        """By p."""
        ...


class Evaluator(Protocol):
    """Forces r (N, n) on modes that nobody supplies, at `times`, p, ṗ and p̈ (N, n); NaN out of reach."""

    def residuals(self, times: list[float], p: Array, v: Array, a: Array, /) -> Array:
        """R (N, n)."""
        ...

    def derivatives(self, times: list[float], p: Array, v: Array, a: Array, /) -> Derivatives:
        """∂r/∂p̈, ∂r/∂ṗ, ∂r/∂p."""
        ...


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
    def scene_path(self) -> Path:
        """Of the scene, for messages."""
        ...

    @property
    def mode_counts(self) -> list[int]:
        """By body."""
        ...

    def core(self) -> Evaluator:
        """The evaluator of r."""
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
