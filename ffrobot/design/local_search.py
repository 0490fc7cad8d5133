"""Searches along gradients from one start; all rows of catalogues; differential evolution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from math import prod

import numpy as np
from scipy.optimize import NonlinearConstraint, differential_evolution

from ..common.arrays import Array
from .evaluations import Evaluated, Evaluations, SpentError
from .optimality import Conflict, Optimality, optimality
from .problem import KEPT
from .slopes import Differentiation
from .steps import AIM, OPTIMISERS, ConflictError, ReachedError, StalledError, Steps, StuckError, rank
from .variables import Place, Space

KINK = "more peaks switch here than ffrobot separates: --method differential-evolution continues from any design"


@dataclass(frozen=True)
class Local:
    """One search: where it began, the best of its designs, how that stands, and why it ended where not there.

    `conflict`: limits that no design near the best one keeps together. `spent`: whether it wanted
    more runs than there were.
    """

    start: Evaluated
    best: Evaluated
    optimality: Optimality | None
    message: str = ""
    conflict: Conflict | None = None
    spent: bool = False


def search_from(start: Place, method: str, differentiation: Differentiation, tell: Callable[[str], None]) -> Local:
    """With a design at each step, and one beside it for each number; with judged gradients where these do not do.

    What SLSQP then leaves, whose line search may come to nothing where a limit trades for the goal almost linearly,
    trust-constr goes on with. Each of them begins with the local peaks of the best design so far. Where one ends
    beyond limits, the largest excess is made less until they are kept, or no design near exceeds them less.
    """
    evaluations = differentiation.evaluations
    begun = len(evaluations.searched)
    (first,) = evaluations.at([start])
    if not first.completed:
        return Local(first, first, None, first.failure)
    best, found, message = first, None, ""
    try:
        for optimiser, judged in ((method, False), (method, True), ("trust-constr", True)):
            best, message = _pass(optimiser, differentiation, best, tell, judged=judged)
            found = _stands(differentiation, best)
            if found.reached(AIM):
                return Local(first, best, found)
            if found.violation > KEPT:
                best, _ = _pass("slsqp", differentiation, best, tell, judged=judged, excess=True)
                found = _stands(differentiation, best)
        message = KINK if found is not None and found.kinks else message
    except SpentError:
        message = f"ended after {evaluations.runs} runs, as many as were allowed"
        last = best_of(evaluations, [best, *evaluations.searched[begun:]])
        return Local(first, last, found if last is best else None, message, spent=True)
    except StuckError as error:
        message = str(error)
    except ConflictError as error:
        best = error.design
        return Local(
            first, best, _stands(differentiation, best), _conflict_in_words(evaluations, error.conflict), error.conflict
        )
    return Local(first, best, found, message)


def _pass(
    optimiser: str, differentiation: Differentiation, best: Evaluated, tell: Callable[[str], None], *,
    judged: bool, excess: bool = False,
) -> tuple[Evaluated, str]:  # fmt: skip
    """The best design that an optimiser comes to from `best`, and why it ended where that is not at an optimum."""
    differentiation.split_at(best)
    steps = Steps(differentiation, best, tell, judged=judged, excess=excess)
    message = ""
    with suppress(ReachedError, StalledError):
        message = OPTIMISERS[optimiser](steps)
    return steps.best, message


def _stands(differentiation: Differentiation, best: Evaluated) -> Optimality:
    """By the local peaks of the design itself."""
    differentiation.split_at(best)
    return optimality(differentiation.evaluations, best, differentiation.slopes(best, judged=True))


def _conflict_in_words(evaluations: Evaluations, found: Conflict) -> str:
    limits = [f'"{evaluations.problem.limits[k].text}"' for k in found.limits]
    bounds = [evaluations.space.variables[j].name for j in found.bounds]
    together = " together" if len(limits) > 1 else ""
    within = f", within the bounds of {' and '.join(bounds)}" if bounds else ""
    return (
        f"no design near this one keeps {' and '.join(limits)}{together}{within}: at the least violation that was found"
        f" {'they are' if together else 'it is'} exceeded by {100 * found.violation:.4g} %; --starts looks elsewhere"
    )


def best_of(evaluations: Evaluations, designs: Sequence[Evaluated]) -> Evaluated:
    """The first of the best."""
    return min(designs, key=lambda one: rank(evaluations, one))


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
