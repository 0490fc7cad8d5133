"""Designs at places of the unit cube, each run once: responses, gradients, conditions of optimality, one table.

An optimum of objective F, excesses g ≤ 0 and bounds b has ∇F + Σ λ_i ∇g_i + Σ μ_j ∇b_j = 0 with λ, μ ≥ 0, and 0 where
a limit or bound is not reached (Karush, Kuhn and Tucker). The multipliers are the nonnegative least-squares solution
(Lawson & Hanson, Solving Least Squares Problems, 1974, chapter 23). One unit more room in g_i lowers F by λ_i.

Gradients take one further design for each variable, or a central pair. With the noise ε of the runs and a step of
h = 2 √ε of a number, noise and curvature of a one-sided difference are alike (Gill, Murray & Wright, Practical
Optimization, 1981, section 8.6). If runs reuse time steps (`mbs/fields/field_types.py`), ε is round-off, and one-sided
differences suffice. One more run has all numbers changed at once, to the other sides, and shows their error.

Otherwise runs differ by their tolerance. The first gradient of a search then takes pairs, whose second differences
correct later one-sided ones. Derivatives of peaks are those at their own time (envelope theorem).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.files import write_atomically
from ..common.structs import struct
from ..common.tables import as_csv
from ..sweep.sweep import Key
from .derivatives import weights
from .designs import Design, Designs, Point, in_words, moved, repeated_steps
from .readings import Reading
from .responses import KEPT, DesignProblem
from .variables import DesignSpace, Place


@struct
class Evaluated:
    """Design at one place of the unit cube: `readings` of all responses, or none and the message of its `failure`.

    `again`: changes with which runs of other designs reuse its time steps; None if they cannot.
    """

    place: Place
    design: Design
    readings: tuple[Reading, ...]
    failure: str = ""
    again: Mapping[Key, Any] | None = None

    @property
    def completed(self) -> bool:
        """Whether its responses are known."""
        return not self.failure

    @property
    def values(self) -> tuple[float, ...]:
        """Values of all responses, SI units."""
        return tuple(reading.value for reading in self.readings)


class Evaluations:
    """All designs evaluated by a search; the first complete one sets the scale of the objective."""

    def __init__(self, designs: Designs, space: DesignSpace, problem: DesignProblem) -> None:
        self.designs, self.space, self.problem = designs, space, problem
        self._searched: dict[Point, Evaluated] = {}
        self._followed: dict[tuple[Place, Path], tuple[Reading, ...]] = {}

    @property
    def searched(self) -> list[Evaluated]:
        """Designs of the search in their order, without those run for gradients alone."""
        return list(self._searched.values())

    @property
    def failures(self) -> list[str]:
        """Values of keys and message of each failed design, as text."""
        unread = {one.design.point: one.failure for one in self.searched if not one.completed}
        failures = unread | self.designs.failures
        return [f"{in_words(self.space.keys, point)}: {why}" for point, why in failures.items()]

    def at(self, places: Sequence[Place]) -> list[Evaluated]:
        """Return designs at places of the unit cube, each run once. Raises `SpentError` for too many designs."""
        points = [self.space.point(place) for place in places]
        new = {point: place for place, point in zip(places, points, strict=True) if point not in self._searched}
        for (point, place), design in zip(new.items(), self.designs.run(list(new)), strict=True):
            self._searched[point] = self._read(place, design)
        return [self._searched[point] for point in points]

    def beside(
        self, base: Evaluated, places: Sequence[Place], again: Mapping[Key, Any] | None
    ) -> list[tuple[Reading, ...]]:
        """Return responses at places close to `base`, peaks at the times of its peaks; empty if a design failed.

        `again`: changes with which runs reuse the time steps of `base`; None: own steps.
        """
        designs = self.designs.run([self.space.point(place) for place in places], again)
        known = [(base.place, design.folder) for design in designs]
        for key, design in zip(known, designs, strict=True):
            if key not in self._followed:
                self._followed[key] = design.follow(self.problem.responses, base.readings)
        return [self._followed[key] for key in known]

    def _read(self, place: Place, design: Design) -> Evaluated:
        if not design.completed:
            return Evaluated(place, design, (), design.failure)
        first = not any(one.completed for one in self._searched.values())
        try:
            with design.results() as results:
                readings = tuple(response.read(results) for response in self.problem.responses)
                evaluated = Evaluated(place, design, readings, again=repeated_steps(results))
        except InputError as error:
            if first:  # a response that means nothing
                raise
            return Evaluated(place, design, (), str(error))
        if first:
            self.problem = replace(self.problem, scale=evaluated.values[0] or 1.0)
        return evaluated


def write_designs(tried: Evaluations, path: Path) -> None:
    """Write a CSV line for each design of a search: values of keys and responses, excess of limits, folder."""
    problem = tried.problem
    responses = [problem.objective.text, *(limit.text for limit in problem.limits)]
    columns = ["design", *map(".".join, tried.space.keys), "status", *responses, "violation", "folder", "message"]
    rows: list[list[object]] = []
    for k, one in enumerate(tried.searched):
        row = one.design.row
        status = "failed" if one.failure and row.status == "completed" else row.status
        values = ("",) * (len(responses) + 1) if one.failure else (*one.values, problem.violation(one.readings))
        rows.append([k, *row.values, status, *values, one.design.folder.name, one.failure])
    write_atomically(path, as_csv([columns, *rows]).encode(), "table of designs", ours=True)


Beside = dict[float, Sequence[Reading]]
"""Responses close to a design, by the offset of one coordinate."""

ROUND_OFF = 1e-11  # of responses: differs between runs with the same steps
DOUBTFUL = 1e-2  # of differences: what the run with all of them may leave


@struct
class Slopes:
    """Gradients at one design: `gradient` (r, n), SI units, of r responses by n unit-cube coordinates; `error` alike.

    NaN for coordinates of catalogs, and where no design close by completes. `kinks`: notes on peaks that others
    exceed close to the design.
    """

    gradient: Array
    error: Array
    kinks: tuple[str, ...] = ()


class Differentiation:
    """Gradients in one search by finite differences; `tolerance` of its runs.

    `repeats`: whether runs reuse time steps where they can; ends if such differences turn out to be inaccurate.
    `curvature` (r, n), SI units: second derivatives from the last central differences, NaN before.
    """

    def __init__(self, evaluations: Evaluations, tolerance: float) -> None:
        self.evaluations, self.tolerance, self.repeats, self._tried = evaluations, tolerance, True, False
        self.curvature = np.full((len(evaluations.problem.responses), len(evaluations.space.variables)), np.nan)

    def slopes(self, base: Evaluated, *, judged: bool = False) -> Slopes:
        """Return gradients at a completed design; `judged`: whether further runs estimate their errors."""
        wanted = self.evaluations.space.numbers
        if self.repeats and base.again is not None and wanted:
            slopes = self._by_repeated_steps(base, wanted, judged=judged or not self._tried)
            self._tried = True
            if self.repeats:
                return slopes
        pairs = judged or bool(np.isnan(self.curvature[:, wanted]).any())  # else one design beside, and curvatures
        offsets = {j: self._offsets(base, j, self.tolerance, pairs=pairs) for j in wanted}
        return self._slopes(base, self._samples(base, offsets, None), self.tolerance, self.curvature)

    def _by_repeated_steps(self, base: Evaluated, wanted: Sequence[int], *, judged: bool) -> Slopes:
        """One-sided differences; `judged`: by one run more, of which `repeats` may become false.

        Its measure is |F(u − Σ h_j e_j) − F(u) + Σ (F(u + h_j e_j) − F(u))|, of second order in h.
        """
        offsets = {j: self._offsets(base, j, ROUND_OFF, pairs=False) for j in wanted}
        samples = self._samples(base, offsets, base.again)
        slopes = self._slopes(base, samples, ROUND_OFF, np.zeros_like(self.curvature))
        if judged and all(samples.values()):
            back = {j: -x for j, beside in samples.items() for x in beside if 0.0 <= base.place[j] - x <= 1.0}
            place = tuple(u + back.get(j, 0.0) for j, u in enumerate(base.place))
            (whole,) = self.evaluations.beside(base, [place], base.again)
            own, left = np.array(base.values), np.zeros(len(base.values))
            for values in [whole, *(next(iter(samples[j].values())) for j in back)] if whole else []:
                left += np.array([one.value for one in values]) - own
            left = np.abs(np.nan_to_num(left))
            change = sum(np.abs(slopes.gradient[:, j]) * abs(x) for j, beside in samples.items() for x in beside)
            self.repeats = bool(np.all(left <= DOUBTFUL * change + ROUND_OFF * np.abs(own)))
            for j, beside in samples.items():
                slopes.error[:, j] += left / abs(next(iter(beside)))
            slopes = replace(slopes, kinks=slopes.kinks or self._kinks([whole]))
        return slopes

    def _samples(
        self, base: Evaluated, offsets: Mapping[int, list[float]], again: Mapping[Key, Any] | None
    ) -> dict[int, Beside]:
        """By variable: the responses beside the base by offset; other offsets where a design there has failed."""
        beside: dict[int, Beside] = {j: {} for j in offsets}
        for _ in range(2):
            pairs = [(j, offset) for j in offsets for offset in offsets[j]]
            places = [moved(base.place, j, base.place[j] + offset) for j, offset in pairs]
            for (j, offset), values in zip(pairs, self.evaluations.beside(base, places, again), strict=True):
                if values and all(np.isfinite(one.value) for one in values):
                    beside[j][offset] = values
            left = {j: [-x for x in tried if -x not in tried] for j, tried in offsets.items() if not beside[j]}
            offsets = {j: [x for x in others if 0.0 <= base.place[j] + x <= 1.0] for j, others in left.items()}
        return beside

    def _offsets(self, base: Evaluated, j: int, noise: float, *, pairs: bool) -> list[float]:
        """Within the bounds: forward where there is room, with the other of a pair on the far side or twice as far."""
        u = base.place[j]
        h = self.evaluations.space.variables[j].step(u, 2.0 * float(np.sqrt(noise)))
        if pairs and u - h >= 0.0 and u + h <= 1.0:
            return [h, -h]
        x = h if u + h <= 1.0 else -h
        return [x, 2.0 * x] if pairs else [x]

    def _slopes(self, base: Evaluated, samples: Mapping[int, Beside], noise: float, curvature: Array) -> Slopes:
        """Differences of values that have a relative `noise`; NaN where no design beside completed.

        `curvature` (r, n), where known, is taken out of one-sided differences, and replaced where there are pairs.
        """
        gradient, error = np.full((2, *curvature.shape), np.nan)
        for j, beside in samples.items():
            if not beside:
                continue
            x = np.array([0.0, *beside])
            f = np.array([base.values, *([one.value for one in values] for values in beside.values())])  # (x, r)
            h = float(np.abs(x).min(where=x != 0.0, initial=np.inf))
            slope, uncertain = weights(x) @ (f - f[0]), noise * np.abs(f).max(axis=0) / h
            if x.size == 3:
                curvature[:, j] = 2.0 * ((f[1] - f[0]) / x[1] - (f[2] - f[0]) / x[2]) / (x[1] - x[2])
            else:
                bent = 0.5 * np.nan_to_num(curvature[:, j]) * x[1]
                slope, uncertain = slope - bent, uncertain + np.abs(bent)
            gradient[:, j], error[:, j] = slope, uncertain
        kinks = self._kinks(values for beside in samples.values() for values in beside.values())
        return Slopes(gradient, error, kinks)

    def _kinks(self, beside: Iterable[Sequence[Reading]]) -> tuple[str, ...]:
        texts = dict.fromkeys(
            f"{response.text}: close to this design another peak is the largest, {one.elsewhere}"
            for values in beside
            for response, one in zip(self.evaluations.problem.responses, values, strict=False)
            if one.elsewhere
        )
        return tuple(texts)


ACTIVE = 1e-4  # of a limit, or of a number's range: nearer ones count as reached
CLOSED = 1e-2  # of the gradient at an optimum: largest `gap` there


@struct
class Optimality:
    """Conditions of optimality (Karush, Kuhn, Tucker) at one design, in the scaled problem."""

    limits: Array  # (m) multipliers λ of limits, no unit; NaN for limits that are not reached
    # (n) multipliers μ of bounds, no unit, negative for lower ones; NaN for numbers between their bounds
    bounds: Array
    # largest entry of the gradient of the Lagrangian: relative change of the objective over the range of one number, if
    # all were linear
    residual: float
    # relative decrease of the objective, if all were linear, by a move to the limits that are almost reached
    gap: float
    gradient_error: float  # largest estimated error in the gradient of the objective, in the same measure
    violation: float  # largest excess, relative to its limit
    kinks: tuple[str, ...]  # notes on peaks that others exceed close to the design

    def reached(self, aim: float) -> bool:
        """Whether this is an optimum: `residual` is at most `aim`, and limits are satisfied."""
        return self.residual <= aim and self.gap <= CLOSED * aim and self.violation <= KEPT


def optimality(evaluations: Evaluations, design: Evaluated, slopes: Slopes) -> Optimality:
    """Return the conditions of optimality at a completed design, from the gradients there."""
    problem = evaluations.problem
    factors = problem.factors(design.values)[:, None]
    scaled, excess = slopes.gradient * factors, problem.scaled(design.values)[1:]
    free = np.flatnonzero(~np.isnan(scaled).any(axis=0))
    place, unit = np.array(design.place), np.eye(len(design.place))
    reached = np.flatnonzero(excess > -ACTIVE)
    low, high = (np.intersect1d(free, np.flatnonzero(near)) for near in (place < ACTIVE, place > 1.0 - ACTIVE))
    gradients = np.vstack([scaled[1 + reached], -unit[low], unit[high]])[:, free]
    multipliers = nnls(gradients.T, -scaled[0, free])[0] if len(gradients) and free.size else np.zeros(len(gradients))
    of_limits, of_low, of_high = np.split(multipliers, np.cumsum([reached.size, low.size]))
    limits, bounds = np.full(len(problem.limits), np.nan), np.full(place.size, np.nan)
    limits[reached], bounds[low], bounds[high] = of_limits, -of_low, of_high
    return Optimality(
        limits,
        bounds,
        _largest(scaled[0, free] + multipliers @ gradients),
        gap=float(of_limits @ np.maximum(-excess[reached], 0.0)),
        gradient_error=_largest((slopes.error * np.abs(factors))[0, free]),
        violation=problem.violation(design.readings),
        kinks=slopes.kinks,
    )


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))
