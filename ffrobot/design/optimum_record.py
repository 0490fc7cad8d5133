"""Result of an optimization: values, limits with their shadow prices, files, texts."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..pictures.studies.study import (
    DesignAxis,
    Diagram,
    Parallel,
    Progress,
    State,
    StudyTable,
    axis_of_response,
)
from ..results.verdict import Verdict
from ..sweep.sweep import number
from .evaluations import Evaluated
from .finding import CsvFile, Finding, TextTable, numbers, with_unit
from .local_search import AIM, Local
from .responses import KEPT, DesignProblem
from .variables import DesignSpace, DesignVariable


def parallel(
    space: DesignSpace,
    problem: DesignProblem,
    designs: Sequence[Evaluated],
    best: Sequence[Evaluated],
    best_label: str,
    *more: str,
) -> Parallel:
    """Return parallel coordinates of `designs`: variables of `space`, responses and limits of `problem`.

    `more`: names of further responses, in the order of the designs' readings. `best` are designs that `best_label`
    names in the legend.
    """
    chosen = {one.design.folder for one in best}

    def state(one: Evaluated) -> State:
        if not one.completed:
            return "failed"
        if one.design.folder in chosen:
            return "best"
        return "kept" if problem.keeps(one.readings) else "exceeded"

    texts, limits = [*(one.text for one in problem.responses), *more], [None, *problem.limits, *(None for _ in more)]
    points = [space.point(one.place) for one in designs]
    axes: list[DesignAxis] = []
    for variable in space.variables:
        first = space.keys.index(variable.keys[0])
        for k in range(len(variable.keys) if variable.is_catalogue else 1):
            axes.append(_axis(variable, k, [point[first + k] for point in points]))
    for g, (text, limit) in enumerate(zip(texts, limits, strict=True)):
        unit = next((one.readings[g].unit for one in designs if one.completed), "")
        values = numbers(one.values[g] if one.completed else np.nan for one in designs)
        bound, sense = (limit.bound, limit.sense) if limit is not None else (None, 1.0)
        axes.append(axis_of_response(with_unit(text, unit), values, bound, 1 if sense > 0 else -1))
    title, states = f"{len(designs)} designs", tuple(map(state, designs))
    return Parallel(name="designs", title=title, axes=tuple(axes), states=states, best_label=best_label)


def progress(problem: DesignProblem, designs: Sequence[Evaluated], lines: Parallel) -> Progress:
    """Return a diagram of the objective, design by design; `lines`: the `parallel` diagram of these designs."""
    axis = lines.axes[-len(problem.responses)]
    kept = [
        problem.sense * one.values[0] if one.completed and problem.keeps(one.readings) else np.inf for one in designs
    ]
    return Progress(
        name="convergence",
        title=f"{problem.objective.text}, design by design",
        y_label=axis.label,
        values=axis.values,
        states=lines.states,
        best=numbers(problem.sense * np.minimum.accumulate(kept)),
        logarithmic=axis.logarithmic,
    )


def _axis(variable: DesignVariable, k: int, values: Sequence[Any]) -> DesignAxis:
    if not variable.is_catalogue:
        low, high, logarithmic = variable.low, variable.high, variable.logarithmic
        return DesignAxis(label=variable.name, values=tuple(values), low=low, high=high, logarithmic=logarithmic)
    name, column = ".".join(variable.keys[k]), list(dict.fromkeys(row[k] for row in variable.rows))
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in column):
        axis = axis_of_response(name, tuple(map(float, column)))
        return axis.model_copy(update={"values": tuple(map(float, values))})
    numbered = tuple(float(column.index(value)) for value in values)
    return DesignAxis(label=name, values=numbered, low=-0.5, high=len(column) - 0.5, names=tuple(map(str, column)))


SHARE = 0.01  # of a limit: the change for which prices are printed
COLUMNS = ("what", "name", "start", "best", "low", "high", "reached", "price")


@dataclass(frozen=True, kw_only=True)
class Searched(Finding):
    """Base of the results of searches.

    Attributes:
        problem: objective and limits.
        space: varied parameters.
        tolerance: largest tolerance of the runs.
        tried: all designs, each once, in the order of the search.
    """

    problem: DesignProblem
    space: DesignSpace
    tolerance: float
    tried: tuple[Evaluated, ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of the keys, with dots."""
        return tuple(map(".".join, self.space.keys))


@dataclass(frozen=True, kw_only=True)
class Optimum(Searched, Local):
    """Result of an optimization: the best of its `searches`.

    Attributes:
        method: the optimizer.
        verdict: answers of all analyses of the best design.
        best_scene: complete scene file of the best design; None if it was not kept.
        designs: CSV table of all designs with their responses; None if it was not kept.
    """

    name = "optimum"
    title = "Optimum"

    method: str
    searches: tuple[Local, ...]
    verdict: Verdict
    best_scene: Path | None
    designs: Path | None

    @property
    def values(self) -> tuple[object, ...]:
        """Values of the keys in the best design."""
        return self.space.point(self.best.place)

    @property
    def value(self) -> float:
        """Value of the minimized or maximized response."""
        return self.best.readings[0].value

    @property
    def limits(self) -> Array:
        """Values (m,) of the m responses with limits, in the best design, SI units."""
        return np.array([reading.value for reading in self.best.readings[1:]])

    @property
    def violation(self) -> float:
        """Largest excess over a limit, relative to the limit; up to 1e-6 the design is `feasible`."""
        return self.problem.violation(self.best.readings)

    @property
    def feasible(self) -> bool:
        """Whether the best design satisfies all limits."""
        return self.problem.keeps(self.best.readings)

    @property
    def prices(self) -> Array:
        """Shadow prices (m,) ∂response/∂limit of m limits, SI units; NaN for inactive ones."""
        if self.optimality is None:
            return np.full(len(self.problem.limits), np.nan)
        room = np.array([limit.sense / limit.scale for limit in self.problem.limits])
        return -self.optimality.limits * room / self.problem.factors(self.best.values)[0]

    @property
    def bound_prices(self) -> Array:
        """Shadow prices (n,) ∂response/∂bound of n parameters, SI units; NaN between bounds."""
        if self.optimality is None:
            return np.full(len(self.space.variables), np.nan)
        prices = -self.optimality.bounds / self.problem.factors(self.best.values)[0]
        pairs = zip(self.space.variables, self.best.place, strict=True)
        return np.array(prices / [np.nan if variable.is_catalogue else variable.slope(u) for variable, u in pairs])

    @property
    def shortfall(self) -> str:
        """Reason why the best design is infeasible; empty if it is feasible."""
        return "" if self.feasible else "no design found that keeps all limits: see the table of limits"

    def sections(self) -> Iterator[TextTable]:
        """Tables of keys and limits, at the start and in the best design."""
        owners = [variable for variable in self.space.variables for _ in variable.keys]
        rows = []
        for name, *values, of in zip(self.keys, self.space.point(self.start.place), self.values, owners, strict=True):
            bounds = f"{len(of.rows)} rows" if of.is_catalogue else f"{of.low:g} to {of.high:g}"
            rows.append((name, *map(number, values), bounds))
        yield TextTable(("key", "start", "best", "bounds"), rows, line=self.headline())
        if self.problem.limits:
            yield TextTable(("limit", "start", "best", ""), [row[:4] for row in self._limit_rows()])

    def report_tables(self) -> Iterator[StudyTable]:
        """Tables for the report, with shadow prices of limits."""
        keys, *limits = self.sections()
        yield keys.for_report()
        if limits:
            heading = ("limit", "start", "best", "", "shadow price: objective per unit of the limit")
            yield TextTable(heading, self._limit_rows()).for_report()

    def headline(self) -> str:
        """Best value and its improvement, or that no design is feasible, in one line."""
        word = "least" if self.problem.sense > 0 else "largest"
        text = f"{word} {self.problem.objective.text}: {self.best.readings[0].in_words()}"
        if self.start.completed and (own := self.start.values[0]):
            change = 100 * (self.value - own) / abs(own)
            more = "less" if change < 0 else "more"
            text += f", {abs(change):.4g} % {more} than at the start, {self.start.readings[0].in_words()}"
        return text if self.feasible else f"no design found that keeps all limits; nearest is one with {text}"

    def remarks(self) -> Iterator[str]:
        """Lines with shadow prices, notes on the accuracy, and the method."""
        for variable, u in zip(self.space.variables, self.best.place, strict=True):
            if variable.motors:
                yield f"motor      {variable.keys[0][1]}: {variable.motors[round(u)].name}, 1:{variable.values(u)[0]:g}"
        trades = []
        for limit, price, reading in zip(self.problem.limits, self.prices, self.best.readings[1:], strict=True):
            room = limit.sense * SHARE * limit.scale
            trades.append((limit.response.text, limit.bound, room, price, reading.unit))
        for variable, price, u in zip(self.space.variables, self.bound_prices, self.best.place, strict=True):
            bound = variable.low if u < 0.5 else variable.high
            room = (-1.0 if u < 0.5 else 1.0) * SHARE * (abs(bound) or variable.high - variable.low)
            trades.append((variable.name, bound, room, price, ""))
        for name, *trade in trades:
            if self.feasible and np.isfinite(trade[2]):
                yield f"price      {name}: {self._trade(*trade)}"
        if self.optimality is not None:
            yield from (f"note       {text}" for text in self.optimality.kinks)
        for response, reading in zip(self.problem.responses, self.best.readings, strict=False):
            if reading.remark:
                yield f"note       {response.text}: {reading.remark}"
        if self.message:
            yield f"note       {self.message}"
        if len(self.searches) > 1:
            yield f"starts     {self._starts()}"
        yield from self.failed()
        how = "the best of the designs that were tried"
        if (stands := self.optimality) and self.feasible:
            how = (
                f"{'converged' if self.converged else 'not converged'}: the gradient of the Lagrangian is"
                f" {stands.residual:.1g} of the objective over the range of a parameter,"
                f" known to {stands.gradient_error:.1g}"
            )
        runs = f"{self.runs} runs with a tolerance of at most {self.tolerance:g}"
        yield f"how        {self.method}, {runs}; {how}"
        yield ""
        yield from self.verdict.lines()

    def write_tables(self, folder: Path) -> Iterator[Path]:
        """Write the CSV tables next to the files of the search; yields the written files."""
        yield from (path for path in (self.best_scene, self.designs) if path is not None)
        yield from super().write_tables(folder)

    def csv_files(self) -> Iterator[CsvFile]:
        """CSV table of the objective, keys and limits with their shadow prices."""
        problem, starts = self.problem, self.start.values or (np.nan,) * len(self.best.values)
        rows: list[list[object]] = [["objective", problem.objective.text, starts[0], self.value, "", "", "", ""]]
        own = dict(zip(self.space.keys, self.space.point(self.start.place), strict=True))
        best = dict(zip(self.space.keys, self.values, strict=True))
        for variable, price in zip(self.space.variables, self.bound_prices, strict=True):
            bounds = ("", "") if variable.is_catalogue else (variable.low, variable.high)
            rows += [["key", ".".join(key), own[key], best[key], *bounds, *_reached(price)] for key in variable.keys]
        for k, (limit, price) in enumerate(zip(problem.limits, self.prices, strict=True)):
            within = ("", limit.bound) if limit.sense > 0 else (limit.bound, "")
            rows.append(["limit", limit.response.text, starts[k + 1], self.limits[k], *within, *_reached(price)])
        yield CsvFile("optimum.csv", COLUMNS, rows)

    def diagrams(self) -> list[Diagram]:
        """Diagrams of all designs and of the convergence."""
        label = "best" if self.feasible else "nearest"
        designs = parallel(self.space, self.problem, self.tried, [self.best], label)
        return [designs, progress(self.problem, self.tried, designs)]

    def _limit_rows(self) -> Iterator[tuple[str, str, str, str, str]]:
        for k, (limit, price) in enumerate(zip(self.problem.limits, self.prices, strict=True)):
            cost = f"{price:.4g}" if self.feasible and np.isfinite(price) else ""
            start, best = (
                of.readings[k + 1].in_words() if of.completed else "failed" for of in (self.start, self.best)
            )
            state = "active" if np.isfinite(price) else "satisfied"
            if (excess := limit.excess(self.limits[k])) > KEPT:
                state = f"exceeded by {100 * excess:.3g} %"
            yield limit.text, start, best, state, cost

    def _trade(self, bound: float, room: float, price: float, unit: str) -> str:
        """`20.2 N in place of 20 saves 0.012 kg (0.5 %)`."""
        gained = abs(price * room)
        verb = "saves" if self.problem.sense > 0 else "gains"
        of = f" {self.best.readings[0].unit}".rstrip()
        share = f" ({100 * gained / abs(self.value):.3g} %)" if self.value else ""
        return f"{bound + room:.6g}{f' {unit}' if unit else ''} instead of {bound:g} {verb} {gained:.4g}{of}{share}"

    def _starts(self) -> str:
        ends = [one.best.values[0] for one in self.searches if one.best.completed]
        near = sum(abs(end - self.value) <= AIM * abs(self.value) for end in ends)
        worst = max((self.problem.sense * end for end in ends), default=np.nan) * self.problem.sense
        return f"{near} of {len(self.searches)} end at this value, within {AIM:g}; the worst at {worst:.6g}"


def _reached(price: float) -> tuple[str, object]:
    return ("yes", price) if np.isfinite(price) else ("no", "")
