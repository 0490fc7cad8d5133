"""Designs of a scene whose keys are spread: the one in the middle, those beside it, and goals by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..common.errors import InputError, SolveError
from ..common.parallel import processes as of_mpi
from ..run.watcher import Watcher
from .designs import Design, Designs, Point
from .readings import Goal, Reading
from .scenes import changes_for
from .spreads import Spread, parse_spread


@dataclass(frozen=True)
class Runs:
    """How designs are run: where they are kept, so many side by side, failed ones again or not, who is told."""

    folder: Path
    processes: int = 1
    retry: bool = False
    watcher: Watcher | None = None


class SpreadDesigns:
    """Designs by the values of keys that are spread.

    Attributes:
        path: of the scene file; `spreads` (k,) of its keys; `goals` (g,).
        middle: the design all parameters at nominal values, which completed; `readings` (g,) of it.
        failures: runs that failed, in words.
    """

    def __init__(
        self,
        path: Path,
        spreads: Sequence[Spread],
        goals: Sequence[Goal],
        runs: Runs,
        *,
        others: Sequence[Goal] = (),
        tolerance: float | None = None,
    ) -> None:
        """Run the middle. `others`: what else is read off the runs; `tolerance`: of the runs, at most.

        Raises:
            InputError: goals or spreads that mean nothing, or that make scenes impossible.
            SolveError: the scene all parameters at nominal values cannot be solved.
        """
        if of_mpi() > 1:
            raise InputError(
                "uncertainty: expected one process, found several under mpirun: -j runs samples in parallel"
            )
        self.path, self.spreads, self.goals = path, tuple(spreads), tuple(goals)
        keys, own = [one.key for one in spreads], tuple(one.own for one in spreads)
        self._designs = Designs(
            path, keys, own, runs.folder, changes_for(path, (*goals, *others), tolerance),
            processes=runs.processes, watcher=runs.watcher or Watcher(), retry=runs.retry,
        )  # fmt: skip
        self.failures: list[str] = []
        self.middle = self._run_middle()
        with self.middle.results() as results:
            self.readings: tuple[Reading, ...] = tuple(goal.read(results) for goal in goals)

    @property
    def table(self) -> Path:
        """The file with a row for every run."""
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
        (design,) = self._designs.run([centre])
        if not design.completed:
            error = InputError if design.row.status == "wrong input" else SolveError
            raise error(f"{self.path}: {design.row.status}: {design.row.message}")
        return design


def read_spreads(path: Path, texts: Sequence[str]) -> tuple[Spread, ...]:
    """What `--spread` says of the scene file at `path`, every key once. Raises `InputError`."""
    spreads = tuple(parse_spread(text, path) for text in texts)
    keys = [one.key for one in spreads]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"--spread: expected every key once, found {'.'.join(key)} {keys.count(key)} times")
    return spreads
