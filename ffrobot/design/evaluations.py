"""Designs at places of the unit cube, each run once, with their goals; and all of them in one table."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..common.errors import InputError
from ..common.files import write_atomically
from .designs import Design, Designs, Point
from .goals import Followed, Reading
from .problem import Problem
from .variables import Place, Space


class SpentError(Exception):
    """As many designs have been run as may be."""


@dataclass(frozen=True)
class Evaluated:
    """A design at a place: the `readings` of all goals, none where it failed, for which `failure` says why."""

    place: Place
    design: Design
    readings: tuple[Reading, ...]
    failure: str = ""

    @property
    def completed(self) -> bool:
        """Whether its goals are known."""
        return not self.failure

    @property
    def values(self) -> tuple[float, ...]:
        """Of the goals."""
        return tuple(reading.value for reading in self.readings)


class Evaluations:
    """All designs that a search has asked for, `most` at most. The first that completes gives the objective's size."""

    def __init__(self, designs: Designs, space: Space, problem: Problem, most: int) -> None:
        self.designs, self.space, self.problem, self.most = designs, space, problem, most
        self._searched: dict[Point, Evaluated] = {}
        self._designs: dict[Point, Design] = {}

    @property
    def runs(self) -> int:
        """How many designs there are."""
        return len(self._designs)

    @property
    def points(self) -> set[Point]:
        """Of all runs."""
        return set(self._designs)

    @property
    def searched(self) -> list[Evaluated]:
        """Those that may be the best, in the order of the search: not those that gradients took beside them."""
        return list(self._searched.values())

    @property
    def failures(self) -> list[str]:
        """Designs that failed, in words."""
        unread = {one.design.point: one.failure for one in self.searched if not one.completed}
        unrun = {d.point: f"{d.row.status}: {d.row.message}" for d in self._designs.values() if not d.completed}
        return [f"{self._words(point)}: {why}" for point, why in (unread | unrun).items()]

    def at(self, places: Sequence[Place]) -> list[Evaluated]:
        """The designs there. Raises `SpentError` where that would be too many."""
        points = [self.space.point(place) for place in places]
        self._run([point for point in points if point not in self._searched])
        for place, point in zip(places, points, strict=True):
            if point not in self._searched:
                self._searched[point] = self._read(place, self._designs[point])
        return [self._searched[point] for point in points]

    def beside(self, base: Evaluated, places: Sequence[Place]) -> list[tuple[Followed, ...]]:
        """Goals at places beside `base`, peaks at their time there; nothing where the design failed."""
        points = [self.space.point(place) for place in places]
        self._run(points)
        return [self._follow(base, self._designs[point]) for point in points]

    def _run(self, points: Sequence[Point]) -> None:
        new = [point for point in dict.fromkeys(points) if point not in self._designs]
        if self.runs + len(new) > self.most:
            raise SpentError
        if new:
            self._designs |= dict(zip(new, self.designs.run(new), strict=True))

    def _read(self, place: Place, design: Design) -> Evaluated:
        if not design.completed:
            return Evaluated(place, design, (), f"{design.row.status}: {design.row.message}")
        first = not any(one.completed for one in self._searched.values())
        try:
            with design.results() as results:
                found = Evaluated(place, design, tuple(goal.read(results) for goal in self.problem.goals))
        except InputError as error:
            if first:  # a goal that means nothing
                raise
            return Evaluated(place, design, (), str(error))
        if first:
            self.problem = self.problem.sized_by(found.values[0])
        return found

    def _follow(self, base: Evaluated, design: Design) -> tuple[Followed, ...]:
        if not design.completed:
            return ()
        with design.results() as results:
            pairs = zip(self.problem.goals, base.readings, strict=True)
            return tuple(goal.follow(results, reading) for goal, reading in pairs)

    def _words(self, point: Point) -> str:
        return ", ".join(f"{'.'.join(key)} = {_number(v)}" for key, v in zip(self.space.keys, point, strict=True))


def write_designs(found: Evaluations, path: Path) -> None:
    """One line for each design of a search: values of keys and goals, the largest excess of a limit, its folder."""
    problem, text = found.problem, io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    goals = [problem.objective.text, *(limit.text for limit in problem.limits)]
    writer.writerow(["design", *map(".".join, found.space.keys), "status", *goals, "violation", "folder", "message"])
    for k, one in enumerate(found.searched):
        row = one.design.row
        values = one.values if one.completed else ("",) * len(goals)
        violation = problem.violation(one.readings) if one.completed else ""
        status = row.status if one.completed or row.status != "completed" else "failed"
        writer.writerow([k, *row.values, status, *values, violation, one.design.folder.name, one.failure])
    write_atomically(path, text.getvalue().encode(), "table of designs", ours=True)


def _number(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
