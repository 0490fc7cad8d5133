"""What a trade-off has found: a table, CSV, the curve of both goals and all designs of its searches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..common.arrays import Array
from ..pictures.studies.diagrams import Diagram, Points
from .evaluations import Evaluated
from .finding import CsvFile, Finding, Section, floats, numbers, with_unit
from .problem import Problem
from .searched_diagrams import parallel, states_of
from .variables import Space


@dataclass(frozen=True)
class FrontPoint:
    """The best design with one limit of the second goal.

    Attributes:
        point: values of the keys.
        goal, against: of both goals there, in the `units` of the front.
        price: ∂goal/∂against along the front; NaN at its ends.
        converged: whether gradients say that nothing better is near. `feasible`: whether it keeps all limits.
        message: why the search ended where it is not.
        design: itself.
    """

    point: tuple[object, ...]
    goal: float
    against: float
    price: float
    converged: bool
    feasible: bool
    message: str
    design: Evaluated


@dataclass(frozen=True)
class Front(Finding):
    """A Pareto front: `points` from the least `goals[0]` to the least `goals[1]`, found with `runs` runs.

    `tried` are the designs of all searches, each once. They have the responses of `problem`, its limits along the whole
    curve included, and then the second response.
    """

    name = "front"
    title = "Two goals"

    scene: Path
    goals: tuple[str, str]
    units: tuple[str, str]
    keys: tuple[str, ...]
    points: tuple[FrontPoint, ...]
    runs: int
    tolerance: float
    space: Space
    problem: Problem
    tried: tuple[Evaluated, ...]

    @property
    def values(self) -> Array:
        """(N, 2) of both goals."""
        return np.array([(one.goal, one.against) for one in self.points])

    @property
    def good(self) -> bool:
        """Whether all designs of the curve keep the limits."""
        return all(one.feasible for one in self.points)

    @property
    def shortfall(self) -> str:
        """That some do not."""
        return "" if self.good else "not all designs of the curve keep the limits: see the table"

    def headline(self) -> str:
        """How many designs, of which goals."""
        return f"{self.goals[0]} against {self.goals[1]}: {len(self.points)} designs"

    def sections(self) -> Iterator[Section]:
        """A line for each design: both goals, what the second one costs, the keys."""
        price = " per ".join(unit or "1" for unit in self.units)
        heading = (*map(with_unit, self.goals, self.units), f"price ({price})", *self.keys, "")
        yield Section(heading, self._rows())

    def _rows(self) -> Iterator[tuple[str, ...]]:
        """Of each design both goals, what one unit less of the second costs, the keys, and what is wrong."""
        for one in self.points:
            cost = f"{-one.price:.4g}" if np.isfinite(one.price) else ""
            keys = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in one.point]
            yield (f"{one.goal:.6g}", f"{one.against:.6g}", cost, *keys, _state(one))

    def remarks(self) -> Iterator[str]:
        """How it was found, and what to mind."""
        how = f"{len(self.points)} designs by slsqp, {self.runs} runs with a tolerance of at most {self.tolerance:g}"
        yield f"how        {how}"
        for one in self.points:
            if one.message and not one.converged:
                yield f"note       {self.goals[1]} {one.against:.6g}: {one.message}"

    def csv_files(self) -> Iterator[CsvFile]:
        """One line for each design; `price` is ∂goal/∂against along the front."""
        columns = [*self.goals, "price", *self.keys, "converged", "feasible", "message"]
        yield CsvFile("front.csv", "table of the front", columns, self._numbers())

    def _numbers(self) -> Iterator[list[object]]:
        for one in self.points:
            price = one.price if np.isfinite(one.price) else ""
            states = ("yes" if state else "no" for state in (one.converged, one.feasible))
            yield [one.goal, one.against, price, *one.point, *states, one.message]

    def diagrams(self) -> list[Diagram]:
        """The curve, and all designs."""
        states = states_of(self.problem, self.tried, [one.design for one in self.points])
        limits = [(limit.goal.text, limit) for limit in self.problem.limits]
        goals = [(self.goals[0], None), *limits, (self.goals[1], None)]
        return [self._curve(), parallel(self.space, goals, self.tried, states, "on the curve")]

    def _curve(self) -> Points:
        """Both goals, designs that have not converged hollow."""
        goal, against = self.values.T
        price = [f"price {-p:.4g}" if p is not None else "" for p in numbers(one.price for one in self.points)]
        return Points(
            name="front", title=f"{self.goals[0]} against {self.goals[1]}",
            x_label=with_unit(self.goals[1], self.units[1]), y_label=with_unit(self.goals[0], self.units[0]),
            labels=tuple(price), x=floats(against), y=floats(goal), joined=True,
            sure=tuple(bool(one.converged and one.feasible) for one in self.points),
        )  # fmt: skip


def _state(one: FrontPoint) -> str:
    return "beyond a limit" if not one.feasible else "" if one.converged else "not converged"
