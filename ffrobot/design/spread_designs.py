"""Designs of a scene whose keys are spread: the one in the middle, those beside it, and goals by them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..common.errors import InputError
from .designs import Design, Designs, Point, Runs
from .readings import Goal, Reading
from .scenes import changes_for
from .spreads import Spread, parse_spread


class SpreadDesigns:
    """Designs by the values of keys that are spread.

    Attributes:
        path: of the scene file; `spreads` (k,) of its keys; `goals` (g,).
        middle: the design all parameters at nominal values, which completed; `readings` (g,) of it.
        failures: runs that failed, in words.
    """

    def __init__(
        self,
        runs: Runs,
        spreads: Sequence[Spread],
        goals: Sequence[Goal],
        *,
        others: Sequence[Goal] = (),
        tolerance: float | None = None,
    ) -> None:
        """Run the middle. `others`: what else is read off the runs; `tolerance`: of the runs, at most.

        Raises:
            InputError: goals or spreads that mean nothing, or that make scenes impossible.
            SolveError: the scene all parameters at nominal values cannot be solved.
        """
        self.path, self.spreads, self.goals = runs.path, tuple(spreads), tuple(goals)
        keys, own = [one.key for one in spreads], tuple(one.own for one in spreads)
        self._designs = Designs(runs, keys, own, changes_for(runs.path, (*goals, *others), tolerance))
        self.failures: list[str] = []
        self.middle = self._run_middle()
        with self.middle.results() as results:
            self.readings: tuple[Reading, ...] = tuple(goal.read(results) for goal in goals)

    @property
    def table(self) -> Path | None:
        """The file with a row for every run; None where they are not kept."""
        return self._designs.table

    def run(self, points: Sequence[Point]) -> list[Design]:
        """The designs there, failed ones too."""
        return self._designs.run(points)

    def read(self, design: Design) -> list[float]:
        """The goals, NaN where the design failed or does not have them."""
        if design.completed:
            try:
                with design.results() as results:
                    return [goal.read(results).value for goal in self.goals]
            except InputError as error:
                self.failures.append(f"{self.where(design)}: {error}")
        else:
            self.failures.append(f"{self.where(design)}: {design.row.status}: {design.row.message}")
        return [float("nan")] * len(self.goals)

    def where(self, design: Design) -> str:
        """Its keys in words."""
        return ", ".join(
            f"{'.'.join(one.key)} = {value:.6g}" for one, value in zip(self.spreads, design.point, strict=True)
        )

    def _run_middle(self) -> Design:
        """The design all parameters at nominal values, which has to be there, and to make sense at their ends."""
        centre = tuple(one.mean for one in self.spreads)
        for k, one in enumerate(self.spreads):
            for end in one.ends:
                if problem := self._designs.problem((*centre[:k], end, *centre[k + 1 :])):
                    raise InputError(
                        f"--spread: expected spreads with which the scene makes sense, found {one.text}:\n{problem}"
                    )
        return self._designs.run_first(centre)


def read_spreads(path: Path, texts: Sequence[str]) -> tuple[Spread, ...]:
    """What `--spread` says of the scene file at `path`, every key once. Raises `InputError`."""
    spreads = tuple(parse_spread(text, path) for text in texts)
    keys = [one.key for one in spreads]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"--spread: expected every key once, found {'.'.join(key)} {keys.count(key)} times")
    return spreads
