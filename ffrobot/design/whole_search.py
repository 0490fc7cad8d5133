"""Searches without gradients: every row of catalogues, and differential evolution (Storn & Price 1997) by SciPy."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from itertools import product
from math import prod

import numpy as np
from scipy.optimize import NonlinearConstraint, differential_evolution

from ..common.arrays import Array
from .evaluations import Evaluations, SpentError
from .variables import Place, Space

POPULATION = 8  # designs of a generation for each variable
SMALLEST = 12  # generation
GENERATIONS = 500
SPREAD = 1e-3  # of the objective in the last generation


def combinations(space: Space) -> int:
    """How many designs there are; 0 where numbers are between bounds."""
    return prod(len(variable.rows) for variable in space.variables)


def try_all(evaluations: Evaluations) -> None:
    """Every combination of rows."""
    evaluations.at(list(product(*(map(float, range(len(v.rows))) for v in evaluations.space.variables))))


def evolve(evaluations: Evaluations, seed: int, start: Place | None, tell: Callable[[str], None]) -> str:
    """Differential evolution, a generation side by side; why it ended early, empty where it did not."""
    space, problem = evaluations.space, evaluations.problem
    count = len(space.variables)

    def values(places: Array) -> Array:
        """(1 + m, S) of S places (n, S), or of one (n); infinite where designs fail."""
        designs = evaluations.at([tuple(map(float, place)) for place in places.reshape(count, -1).T])
        failed = [np.inf] * len(problem.goals)
        return np.array([problem.scaled(one.values) if one.completed else failed for one in designs]).reshape(
            -1, len(problem.goals)
        ).T  # fmt: skip

    def on_improvement(x: Array, convergence: float) -> None:
        tell(f"differential evolution, {evaluations.runs} runs")

    limits = (NonlinearConstraint(lambda places: values(places)[1:], -np.inf, 0.0),) if problem.limits else ()
    with suppress(SpentError), np.errstate(invalid="ignore"):
        done = differential_evolution(
            lambda places: values(places)[0], [(0.0, variable.top) for variable in space.variables],
            popsize=max(POPULATION, -(-SMALLEST // count)), maxiter=GENERATIONS, tol=SPREAD, seed=seed, polish=False,
            updating="deferred", vectorized=True, constraints=limits, x0=start, callback=on_improvement,
            integrality=[variable.is_catalogue for variable in space.variables],
        )  # fmt: skip
        return "" if done.success else f"differential evolution: {done.message}"
    return f"ended after {evaluations.runs} runs, as many as were allowed"
