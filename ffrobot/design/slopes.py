"""Gradients of all goals at a design, from few runs: one design beside it for each variable, or a central pair.

The step follows from the noise ε of the runs: with h = 2 √ε of a number, noise and curvature of a one-sided
difference are alike (Gill, Murray & Wright, Practical Optimization, 1981, section 8.6). Where designs beside take the
steps of the base again (`mbs/fields/steps.py`), ε is rounding, and one-sided differences are all that is wanted. One
more run has all numbers changed at once, to the other sides: what it leaves of the sum of the differences tells their
error.

Runs that choose their own steps differ by their tolerance. There the first gradient of a search takes pairs; their
second differences take the curvature out of later one-sided ones. Peaks are followed at their own time (envelope
theorem). Frequencies of beams have exact derivatives, without runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..common.arrays import Array, as_floats
from ..sweep.sweep import Key
from .derivatives import Base, exact_entries
from .differences import weights
from .evaluations import Evaluated, Evaluations
from .readings import Followed
from .variables import Place

Beside = dict[float, Sequence[Followed]]
"""Goals beside a design by the offset of one coordinate."""

ROUNDING = 1e-11  # of goals: differs between runs with the same steps
DOUBTFUL = 1e-2  # of differences: what the run with all of them may leave
EXACT_STEP = 0.01  # of a number: the largest where frequencies are differentiated without runs


@dataclass(frozen=True)
class Slopes:
    """At one design: `gradient` (r, n) of rows of `Split` by coordinates of the unit cube; its `error`, estimated.

    Coordinates of catalogues have NaN, and those without a design beside that completes. `kinks`: peaks that others
    overtake beside the design, in words.
    """

    gradient: Array
    error: Array
    kinks: tuple[str, ...] = ()


@dataclass
class Differentiation:
    """Gradients in one search of the scene at `path`; `tolerance` of its runs.

    `repeats`: whether designs beside take the steps of the base again, where they can: until differences so made turn
    out to be none. `curvature` (r, n) holds the second derivatives that the last central pairs gave, NaN before.
    """

    path: Path
    evaluations: Evaluations
    tolerance: float
    repeats: bool = True
    curvature: Array = field(init=False)

    def __post_init__(self) -> None:
        self.curvature = np.zeros((0, 0))
        self._tried = False

    def split_at(self, design: Evaluated) -> None:
        """Take the problem with the local peaks of a design from now on."""
        if self.evaluations.split_at(design):
            shape = len(self.evaluations.split.goals), len(self.evaluations.space.variables)
            self.curvature = np.full(shape, np.nan)

    def slopes(self, base: Evaluated, *, judged: bool = False) -> Slopes:
        """At a design that completed; `judged`: with an estimate of the error by further runs."""
        exact = self._exact(base)
        wanted = [
            j
            for j, variable in enumerate(self.evaluations.space.variables)
            if not variable.is_catalogue and np.isnan(exact[:, j]).any()
        ]
        if self.repeats and base.again is not None and wanted:
            found = self._by_repeated_steps(base, wanted, exact, judged=judged or not self._tried)
            self._tried = True
            if self.repeats:
                return found
        return self._by_own_steps(base, wanted, exact, pairs=judged or bool(np.isnan(self.curvature[:, wanted]).any()))

    def _by_repeated_steps(self, base: Evaluated, wanted: Sequence[int], exact: Array, *, judged: bool) -> Slopes:
        """One-sided differences; `judged`: by one run more, of which `repeats` may become false."""
        step = {j: self._step(base, j, ROUNDING) for j in wanted}
        samples = self._samples(base, {j: [_side(base, j, h) * h] for j, h in step.items()}, base.again)
        gradient, error = exact.copy(), np.where(np.isnan(exact), np.nan, 0.0)
        own = np.array(self.evaluations.row_values(base))
        for j, beside in samples.items():
            _differentiate(own, j, beside, gradient, error, ROUNDING)
        if judged and all(samples.values()):
            left = self._left_of_sum(base, samples)
            moved = sum(np.abs(gradient[:, j]) * abs(x) for j, beside in samples.items() for x in beside)
            self.repeats = bool(np.all(left <= DOUBTFUL * moved + ROUNDING * np.abs(own)))
            for j, beside in samples.items():
                missing = np.isnan(exact[:, j])
                error[missing, j] += left[missing] / abs(next(iter(beside)))
        return Slopes(gradient, error, self._kinks(samples))

    def _left_of_sum(self, base: Evaluated, samples: Mapping[int, Beside]) -> Array:
        """(r) |F(u − Σ h_j e_j) − F(u) + Σ (F(u + h_j e_j) − F(u))|, of second order in h; 0 if there is no run."""
        back = {j: -x for j, beside in samples.items() for x in beside if 0.0 <= base.place[j] - x <= 1.0}
        place = tuple(u + back.get(j, 0.0) for j, u in enumerate(base.place))
        (whole,) = self.evaluations.beside(base, [place], base.again)
        own = np.array(self.evaluations.row_values(base))
        if not whole:
            return np.zeros_like(own)
        left = np.array([one.value for one in whole]) - own
        for j in back:
            (values,) = samples[j].values()
            left += np.array([one.value for one in values]) - own
        return as_floats(np.abs(np.nan_to_num(left)))

    def _by_own_steps(self, base: Evaluated, wanted: Sequence[int], exact: Array, *, pairs: bool) -> Slopes:
        """With central `pairs`, or one design beside where curvatures are known."""
        offsets = {j: self._offsets(base, j, pairs=pairs) for j in wanted}
        samples = self._samples(base, offsets, None)
        gradient, error = exact.copy(), np.where(np.isnan(exact), np.nan, 0.0)
        own = np.array(self.evaluations.row_values(base))
        for j, beside in samples.items():
            bent = np.nan_to_num(self.curvature[:, j])
            curvature = _differentiate(own, j, beside, gradient, error, self.tolerance, bent)
            self.curvature[:, j] = self.curvature[:, j] if curvature is None else curvature
        return Slopes(gradient, error, self._kinks(samples))

    def _samples(
        self, base: Evaluated, offsets: Mapping[int, list[float]], again: Mapping[Key, Any] | None
    ) -> dict[int, Beside]:
        """By variable: the goals beside the base by offset; other offsets where a design there has failed."""
        found: dict[int, Beside] = {j: {} for j in offsets}
        for _ in range(2):
            moved = [(j, offset) for j in offsets for offset in offsets[j]]
            goals = self.evaluations.beside(base, [_moved(base.place, j, offset) for j, offset in moved], again)
            for (j, offset), values in zip(moved, goals, strict=True):
                if values and all(np.isfinite(one.value) for one in values):
                    found[j][offset] = values
            offsets = {j: [] if found[j] else _other_side(base, j, tried) for j, tried in offsets.items()}
        return found

    def _offsets(self, base: Evaluated, j: int, *, pairs: bool) -> list[float]:
        """Within the bounds: forward where there is room, with the other of a pair on the far side or twice as far."""
        u, h = base.place[j], self._step(base, j, self.tolerance)
        x = _side(base, j, h) * h
        if not pairs:
            return [x]
        return [h, -h] if u - h >= 0.0 and u + h <= 1.0 else [x, 2.0 * x]

    def _step(self, base: Evaluated, j: int, noise: float) -> float:
        """Of one coordinate of the unit cube."""
        return self.evaluations.space.variables[j].step(base.place[j], 2.0 * float(np.sqrt(noise)))

    def _exact(self, base: Evaluated) -> Array:
        """(r, n) what is known without runs, NaN elsewhere."""
        space, goals = self.evaluations.space, self.evaluations.split.goals
        point, numbers = space.point(base.place), [v for v in space.variables if not v.is_catalogue]
        changes = {k: x for k, x, own in zip(space.keys, point, space.own, strict=True) if x != own}
        values = dict(zip(space.keys, point, strict=True))
        keys = [key for variable in numbers for key in variable.keys]
        steps = tuple(EXACT_STEP * (abs(values[key]) or 1.0) for key in keys)
        at = Base(goals, self.evaluations.rows(base), tuple(keys), tuple(values[key] for key in keys), steps, changes)
        entries = exact_entries(self.path, at)
        found = np.full((len(goals), len(space.variables)), np.nan)
        for g in range(len(goals)):
            for j, variable in enumerate(space.variables):
                parts = [entries.get((g, keys.index(key))) for key in variable.keys if key in keys]
                if parts and all(part is not None for part in parts):
                    slope = variable.slope(base.place[j])
                    found[g, j] = slope * sum(part.derivative for part in parts if part is not None)
        return found

    def _kinks(self, samples: Mapping[int, Beside]) -> tuple[str, ...]:
        goals = self.evaluations.split.goals
        found = [
            f"{goal.text}: close to this design another peak is the largest, {one.elsewhere}"
            for beside in samples.values()
            for values in beside.values()
            for goal, one in zip(goals, values, strict=True)
            if one.elsewhere
        ]
        return tuple(dict.fromkeys(found))


def _differentiate(
    own: Array, j: int, beside: Beside, gradient: Array, error: Array, noise: float, bent: Array | float = 0.0
) -> Array | None:
    """Fill column j of what is not exact; NaN stays where no design beside completed. The curvature (r), by pairs.

    `own` (r): values at the design itself.
    `bent`: the curvature that is known before, of which one-sided differences are freed.
    """
    if not beside:
        return None
    x = np.array([0.0, *beside])
    f = np.array([own, *([one.value for one in values] for values in beside.values())])  # (x, goals)
    h = float(np.abs(x).min(where=x != 0.0, initial=np.inf))
    slope, uncertain = weights(x) @ (f - f[0]), noise * np.abs(f).max(axis=0) / h
    curvature = None
    if x.size == 3:
        curvature = 2.0 * ((f[1] - f[0]) / x[1] - (f[2] - f[0]) / x[2]) / (x[1] - x[2])
    else:
        slope, uncertain = slope - 0.5 * bent * x[1], uncertain + np.abs(0.5 * bent * x[1])
    missing = np.isnan(gradient[:, j])
    gradient[missing, j], error[missing, j] = slope[missing], uncertain[missing]
    return curvature


def _side(base: Evaluated, j: int, h: float) -> float:
    return 1.0 if base.place[j] + h <= 1.0 else -1.0


def _other_side(base: Evaluated, j: int, tried: Sequence[float]) -> list[float]:
    u = base.place[j]
    return [-offset for offset in tried if 0.0 <= u - offset <= 1.0 and -offset not in tried]


def _moved(place: Place, j: int, offset: float) -> Place:
    return (*place[:j], place[j] + offset, *place[j + 1 :])
