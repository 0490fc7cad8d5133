"""Gradients of all goals at a design, from few runs: one design beside it for each variable, or a central pair.

The step follows from the tolerance ε of the runs: with h = 2 √ε of a number, noise and curvature of a one-sided
difference are alike (Gill, Murray & Wright, Practical Optimization, 1981, section 8.6). The first gradient of a search
takes pairs; their second differences take the curvature out of later one-sided ones. Peaks are followed at their own
time (envelope theorem). Frequencies of beams have exact derivatives, without runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..common.arrays import Array
from .derivatives import Base
from .differences import weights
from .evaluations import Evaluated, Evaluations
from .frequencies import exact_entries
from .goals import Followed
from .variables import Place

Beside = dict[float, Sequence[Followed]]
"""Goals beside a design by the offset of one coordinate."""

EXACT_STEP = 0.01  # of a number: the largest where frequencies are differentiated without runs


@dataclass(frozen=True)
class Slopes:
    """At one design: `gradient` (1 + m, n) of goals by coordinates of the unit cube, and the estimate of its `error`.

    Coordinates of catalogues have NaN, and those without a design beside that completes. `kinks`: peaks that others
    overtake beside the design, in words.
    """

    gradient: Array
    error: Array
    kinks: tuple[str, ...] = ()


@dataclass
class Differentiation:
    """Gradients in one search of the scene at `path`; `tolerance` of its runs.

    `curvature` (1 + m, n) holds the second derivatives that the last central pairs gave, NaN before.
    """

    path: Path
    evaluations: Evaluations
    tolerance: float
    curvature: Array = field(init=False)

    def __post_init__(self) -> None:
        shape = len(self.evaluations.problem.goals), len(self.evaluations.space.variables)
        self.curvature = np.full(shape, np.nan)

    def slopes(self, base: Evaluated, *, pairs: bool = False) -> Slopes:
        """At a design that completed; with central `pairs`, or one design beside it where curvatures are known."""
        exact = self._exact(base)
        wanted = [
            j
            for j, variable in enumerate(self.evaluations.space.variables)
            if not variable.is_catalogue and np.isnan(exact[:, j]).any()
        ]
        samples = self._samples(base, wanted, pairs or bool(np.isnan(self.curvature[:, wanted]).any()))
        gradient, error = exact.copy(), np.where(np.isnan(exact), np.nan, 0.0)
        kinks: dict[str, None] = {}
        for j, beside in samples.items():
            self._differentiate(base, j, beside, gradient, error)
            kinks |= dict.fromkeys(self._kinks(beside))
        return Slopes(gradient, error, tuple(kinks))

    def _samples(self, base: Evaluated, wanted: Sequence[int], pairs: bool) -> dict[int, Beside]:
        """By variable: the goals beside the base by offset; other offsets where a design there has failed."""
        found: dict[int, Beside] = {j: {} for j in wanted}
        offsets = {j: self._offsets(base, j, pairs) for j in wanted}
        for _ in range(2):
            moved = [(j, offset) for j in wanted for offset in offsets[j]]
            goals = self.evaluations.beside(base, [_moved(base.place, j, offset) for j, offset in moved])
            for (j, offset), values in zip(moved, goals, strict=True):
                if values and all(np.isfinite(one.value) for one in values):
                    found[j][offset] = values
            offsets = {j: [] if found[j] else self._other_side(base, j, offsets[j]) for j in wanted}
        return found

    def _offsets(self, base: Evaluated, j: int, pairs: bool) -> list[float]:
        """Within the bounds: forward where there is room, with the other of a pair on the far side or twice as far."""
        u, h = base.place[j], self.step(base, j)
        sign = 1.0 if u + h <= 1.0 else -1.0
        if not pairs:
            return [sign * h]
        return [h, -h] if u - h >= 0.0 and u + h <= 1.0 else [sign * h, 2.0 * sign * h]

    @staticmethod
    def _other_side(base: Evaluated, j: int, tried: Sequence[float]) -> list[float]:
        u = base.place[j]
        return [-offset for offset in tried if 0.0 <= u - offset <= 1.0 and -offset not in tried]

    def step(self, base: Evaluated, j: int) -> float:
        """Of one coordinate of the unit cube."""
        return self.evaluations.space.variables[j].step(base.place[j], 2.0 * float(np.sqrt(self.tolerance)))

    def _differentiate(self, base: Evaluated, j: int, beside: Beside, gradient: Array, error: Array) -> None:
        """Column j of what is not exact; NaN stays where no design beside completed."""
        if not beside:
            return
        x = np.array([0.0, *beside])
        f = np.array([base.values, *([one.value for one in values] for values in beside.values())])  # (x, goals)
        f0, h = np.abs(f).max(axis=0), float(np.abs(x).min(where=x != 0.0, initial=np.inf))
        slope, noise = weights(x) @ (f - f[0]), self.tolerance * f0 / h
        if x.size == 3:
            self.curvature[:, j] = 2.0 * ((f[1] - f[0]) / x[1] - (f[2] - f[0]) / x[2]) / (x[1] - x[2])
            truncation = np.zeros_like(slope)
        else:
            bent = np.nan_to_num(self.curvature[:, j]) * 0.5 * x[1]
            slope, truncation = slope - bent, np.abs(bent)
        missing = np.isnan(gradient[:, j])
        gradient[missing, j], error[missing, j] = slope[missing], (noise + truncation)[missing]

    def _exact(self, base: Evaluated) -> Array:
        """(1 + m, n) what is known without runs, NaN elsewhere."""
        space, goals = self.evaluations.space, self.evaluations.problem.goals
        point, numbers = space.point(base.place), [v for v in space.variables if not v.is_catalogue]
        changes = {k: x for k, x, own in zip(space.keys, point, space.own, strict=True) if x != own}
        values = dict(zip(space.keys, point, strict=True))
        keys = [key for variable in numbers for key in variable.keys]
        steps = tuple(EXACT_STEP * (abs(values[key]) or 1.0) for key in keys)
        at = Base(goals, base.readings, tuple(keys), tuple(values[key] for key in keys), steps, changes)
        entries = exact_entries(self.path, at)
        found = np.full((len(goals), len(space.variables)), np.nan)
        for g in range(len(goals)):
            for j, variable in enumerate(space.variables):
                parts = [entries.get((g, keys.index(key))) for key in variable.keys if key in keys]
                if parts and all(part is not None for part in parts):
                    slope = variable.slope(base.place[j])
                    found[g, j] = slope * sum(part.derivative for part in parts if part is not None)
        return found

    def _kinks(self, beside: Beside) -> list[str]:
        goals = self.evaluations.problem.goals
        return [
            f"{goal.text}: beside this design another peak is the largest, {one.elsewhere}"
            for values in beside.values()
            for goal, one in zip(goals, values, strict=True)
            if one.elsewhere
        ]


def _moved(place: Place, j: int, offset: float) -> Place:
    return (*place[:j], place[j] + offset, *place[j + 1 :])
