"""A problem whose peaks are divided into local ones, each of them smooth, as searches along gradients take it.

"peak ≤ bound" is: every local peak ≤ bound. The least peak is the least s with every local peak ≤ s (the epigraph of a
minimax problem: Nocedal & Wright, Numerical Optimization, 2006, section 17.2, likewise for limits that are exceeded).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..common.arrays import Array, as_floats
from ..results.file import Results
from .peaks import Peak, parts
from .problem import Limit, Problem
from .readings import Goal


@dataclass(frozen=True)
class Split:
    """Rows of a search: the objective's goals, whose largest is to be least, then those of `limits`.

    `objectives`: one, or the local peaks of one. `owners`: of each of `limits` the number of the problem's own limit.
    """

    problem: Problem
    objectives: tuple[Goal, ...]
    limits: tuple[Limit, ...]
    owners: tuple[int, ...]

    @property
    def goals(self) -> tuple[Goal, ...]:
        """Of all rows."""
        return (*self.objectives, *(limit.goal for limit in self.limits))

    @property
    def objective_rows(self) -> list[int]:
        """By number."""
        return list(range(len(self.objectives)))

    @property
    def limit_rows(self) -> list[int]:
        """By number."""
        return list(range(len(self.objectives), len(self.goals)))

    def scaled(self, values: Sequence[float]) -> Array:
        """(rows) as of `Problem.scaled`: objectives, and excesses of limits, which are to be 0 or less."""
        return as_floats(np.concatenate([rows.scaled(part)[skip:] for rows, part, skip in self._of(values)]))

    def factors(self, values: Sequence[float]) -> Array:
        """(rows) what turns slopes of goals with these values into those of `scaled`."""
        return as_floats(np.concatenate([rows.factors(part)[skip:] for rows, part, skip in self._of(values)]))

    def _of(self, values: Sequence[float]) -> list[tuple[Problem, Sequence[float], int]]:
        """Problems with one objective each, their goals' values, and how many rows of theirs are of others."""
        count = len(self.objectives)
        alone = replace(self.problem, limits=())
        limited = replace(self.problem, limits=self.limits)
        return [*((alone, [value], 0) for value in values[:count]), (limited, [values[0], *values[count:]], 1)]


def split(problem: Problem, results: Results) -> Split:
    """By the local peaks of a design. Peaks that are to be large have no parts: one of them is enough."""
    objectives: tuple[Goal, ...] = (problem.objective,)
    if problem.sense > 0 and isinstance(problem.objective, Peak):
        objectives = parts(problem.objective, results)
    limits: list[Limit] = []
    owners: list[int] = []
    for k, limit in enumerate(problem.limits):
        goals = parts(limit.goal, results) if limit.sense > 0 and isinstance(limit.goal, Peak) else (limit.goal,)
        limits += [replace(limit, goal=goal) for goal in goals]
        owners += [k] * len(goals)
    return Split(problem, objectives, tuple(limits), tuple(owners))
