"""Designs at places of the unit cube, each run once, with their goals; and all of them in one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..common.errors import InputError
from ..common.files import write_atomically
from ..common.tables import as_csv
from ..sweep.sweep import Key
from .designs import Design, Designs, Point, in_words, repeated_steps
from .goals import Problem
from .readings import Followed, Reading
from .variables import Place, Space


class SpentError(Exception):
    """As many designs have been run as may be."""


@dataclass(frozen=True)
class Evaluated:
    """A design at a place: the `readings` of all goals, none where it failed, for which `failure` says why.

    `again`: changes of scenes beside it with which runs take its steps again; None where they choose their own.
    """

    place: Place
    design: Design
    readings: tuple[Reading, ...]
    failure: str = ""
    again: Mapping[Key, Any] | None = None

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
        self._designs: dict[Path, Design] = {}
        self._followed: dict[tuple[Place, Path], tuple[Followed, ...]] = {}

    @property
    def runs(self) -> int:
        """How many designs there are."""
        return len(self._designs)

    @property
    def folders(self) -> set[Path]:
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
        unrun = {d.point: d.failure for d in self._designs.values() if not d.completed}
        return [f"{in_words(self.space.keys, point)}: {why}" for point, why in (unread | unrun).items()]

    def at(self, places: Sequence[Place]) -> list[Evaluated]:
        """The designs there. Raises `SpentError` where that would be too many."""
        points = [self.space.point(place) for place in places]
        new = {point: place for place, point in zip(places, points, strict=True) if point not in self._searched}
        for (point, place), design in zip(new.items(), self._run(list(new)), strict=True):
            self._searched[point] = self._read(place, design)
        return [self._searched[point] for point in points]

    def beside(
        self, base: Evaluated, places: Sequence[Place], again: Mapping[Key, Any] | None
    ) -> list[tuple[Followed, ...]]:
        """Goals at places beside `base`, peaks at their time there; nothing where the design failed.

        `again`: changes with which runs take the steps of the base.
        """
        points = [self.space.point(place) for place in places]
        return [self._follow(base, design) for design in self._run(points, again)]

    def _run(self, points: Sequence[Point], again: Mapping[Key, Any] | None = None) -> list[Design]:
        folders = self.designs.folders(points, again)
        if len(set(folders) - set(self._designs)) > self.most - self.runs:
            raise SpentError
        found = self.designs.run(points, again)
        self._designs |= {design.folder: design for design in found}
        return found

    def _read(self, place: Place, design: Design) -> Evaluated:
        if not design.completed:
            return Evaluated(place, design, (), design.failure)
        first = not any(one.completed for one in self._searched.values())
        try:
            with design.results() as results:
                readings = tuple(goal.read(results) for goal in self.problem.goals)
                found = Evaluated(place, design, readings, again=repeated_steps(results))
        except InputError as error:
            if first:  # a goal that means nothing
                raise
            return Evaluated(place, design, (), str(error))
        if first:
            self.problem = replace(self.problem, scale=found.values[0] or 1.0)
        return found

    def _follow(self, base: Evaluated, design: Design) -> tuple[Followed, ...]:
        known = base.place, design.folder
        if known not in self._followed:
            self._followed[known] = design.follow(self.problem.goals, base.readings)
        return self._followed[known]


def write_designs(found: Evaluations, path: Path) -> None:
    """One line for each design of a search: values of keys and goals, the largest excess of a limit, its folder."""
    problem = found.problem
    goals = [problem.objective.text, *(limit.text for limit in problem.limits)]
    columns = ["design", *map(".".join, found.space.keys), "status", *goals, "violation", "folder", "message"]
    rows: list[list[object]] = []
    for k, one in enumerate(found.searched):
        row = one.design.row
        values = one.values if one.completed else ("",) * len(goals)
        violation = problem.violation(one.readings) if one.completed else ""
        status = row.status if one.completed or row.status != "completed" else "failed"
        rows.append([k, *row.values, status, *values, violation, one.design.folder.name, one.failure])
    write_atomically(path, as_csv([columns, *rows]).encode(), "table of designs", ours=True)
