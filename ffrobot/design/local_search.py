"""Searches along gradients from one start: SLSQP and trust-constr of SciPy, with what they call.

A design that fails reads as far worse than the last one that did not, with its excesses: SLSQP's line search and
trust-constr's radius then shorten the step towards that one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from ..common.arrays import Array, as_floats
from .evaluations import Evaluated, Evaluations, SpentError
from .optimality import Optimality, optimality
from .problem import KEPT
from .slopes import Differentiation
from .variables import Place

FAILED = 1e3  # how much worse a design that fails reads than the last good one, of the objective's size
AIM = 1e-4  # gradient of the Lagrangian, of the objective over a number's range, at an optimum
ENOUGH = 0.5  # times that: where a search ends, before more runs judge it
DOWN = 0.05  # of the gradient since it was judged last: is judged again
KINK = "peaks take turns here, which gradients do not see: --method differential-evolution goes on from any design"
ITERATIONS = 200
FTOL = 1e-9  # of the objective, and of excesses
GTOL, XTOL = 1e-7, 1e-9  # of trust-constr


class ReachedError(Exception):
    """The gradient says that this is an optimum."""


class StuckError(Exception):
    """There is no gradient where the search is."""


@dataclass(frozen=True)
class Local:
    """One search: where it began, the best of its designs, how that stands, and why it ended where not there."""

    start: Evaluated
    best: Evaluated
    optimality: Optimality | None
    message: str = ""


def better(evaluations: Evaluations, one: Evaluated, other: Evaluated) -> bool:
    """Whether `one` keeps limits that the other does not, exceeds them less, or is lower where both keep them."""
    return rank(evaluations, one) < rank(evaluations, other)


def rank(evaluations: Evaluations, one: Evaluated) -> tuple[int, float]:
    """In which completed designs are sorted: those within limits first, by the objective, then by their violation."""
    if not one.completed:
        return 2, 0.0
    violation = evaluations.problem.violation(one.readings)
    objective = float(evaluations.problem.scaled(one.values)[0])
    return (0, objective) if violation <= KEPT else (1, violation)


def search_from(start: Place, method: str, differentiation: Differentiation, tell: Callable[[str], None]) -> Local:
    """With a design at each step, and one beside it for each number; with judged gradients where these do not do.

    What SLSQP then leaves, whose line search may come to nothing where a limit trades for the goal almost linearly,
    trust-constr goes on with.
    """
    evaluations = differentiation.evaluations
    (first,) = evaluations.at([start])
    if not first.completed:
        return Local(first, first, None, first.failure)
    best, found, message = first, None, ""
    try:
        for optimiser, judged in ((method, False), (method, True), ("trust-constr", True)):
            steps = _Steps(differentiation, best, tell, judged=judged)
            try:
                message = OPTIMISERS[optimiser](steps)
            except ReachedError:
                message = ""
            finally:
                best = steps.best
            found = optimality(evaluations, best, differentiation.slopes(best, judged=True))
            if found.reached(AIM):
                return Local(first, best, found)
            if found.kinks:
                return Local(first, best, found, KINK)
    except SpentError:
        message = f"ended after {evaluations.runs} runs, as many as were allowed"
    except StuckError as error:
        message = str(error)
    return Local(first, best, found, message)


class _Steps:
    """The functions that optimisers call, of the coordinates x that are no catalogue's."""

    def __init__(
        self, differentiation: Differentiation, start: Evaluated, tell: Callable[[str], None], *, judged: bool
    ) -> None:
        self._differentiation, self._tell, self._judged = differentiation, tell, judged
        self._evaluations = differentiation.evaluations
        variables = self._evaluations.space.variables
        self._free = [j for j, variable in enumerate(variables) if not variable.is_catalogue]
        self._place, self.best, self._good = np.array(start.place), start, start
        self._gradients: dict[Place, Array] = {}
        self._residual = np.inf  # where they were judged last

    @property
    def start(self) -> Array:
        """Coordinates x."""
        return as_floats(self._place[self._free])

    @property
    def has_limits(self) -> bool:
        """Whether there are any."""
        return bool(self._evaluations.problem.limits)

    def values(self, x: Array) -> Array:
        """(1 + m) F and excesses g."""
        problem = self._evaluations.problem
        one = self._at(x)
        if not one.completed:
            return as_floats(problem.scaled(self._good.values) + np.eye(1, len(problem.goals))[0] * FAILED)
        if better(self._evaluations, one, self.best):
            self.best = one
        return problem.scaled(one.values)

    def gradients(self, x: Array) -> Array:
        """(1 + m, n) of F and g."""
        one = self._at(x)
        if one.place not in self._gradients:
            if not one.completed:
                raise StuckError(f"ended at a design that fails: {one.failure}")
            self._good = one
            self._told(one)
            self._gradients[one.place] = (
                self._gradients_at(one) * self._evaluations.problem.factors(one.values)[:, None]
            )
        return self._gradients[one.place]

    def _gradients_at(self, one: Evaluated) -> Array:
        """Of the goals; judged ones where the gradient has come down since there were some."""
        for judged in (self._judged, True):
            slopes = self._differentiation.slopes(one, judged=judged)
            if np.isnan(slopes.gradient[:, self._free]).any():
                raise StuckError("ended where no design beside the last one completes: see the table of runs")
            stands = optimality(self._evaluations, one, slopes)
            if stands.reached(ENOUGH * AIM):
                self.best = one
                raise ReachedError
            if stands.residual > DOWN * self._residual:
                break
            self._residual = stands.residual
        return slopes.gradient[:, self._free]

    def _at(self, x: Array) -> Evaluated:
        place = self._place.copy()
        place[self._free] = np.clip(x, 0.0, 1.0)
        (one,) = self._evaluations.at([tuple(map(float, place))])
        return one

    def _told(self, one: Evaluated) -> None:
        problem = self._evaluations.problem
        violation = problem.violation(one.readings)
        beyond = f", {100 * violation:.3g} % beyond a limit" if violation > KEPT else ""
        self._tell(f"{problem.objective.text} {one.readings[0].value:.6g}{beyond}, {self._evaluations.runs} runs")


def _slsqp(steps: _Steps) -> str:
    """Sequential quadratic programming (Kraft 1988)."""
    limits = {
        "type": "ineq",
        "fun": lambda x: -steps.values(x)[1:],
        "jac": lambda x: -steps.gradients(x)[1:],
    }
    done = minimize(
        lambda x: steps.values(x)[0], steps.start, jac=lambda x: steps.gradients(x)[0], method="SLSQP",
        bounds=[(0.0, 1.0)] * steps.start.size, constraints=[limits] if steps.has_limits else [],
        options={"ftol": FTOL, "maxiter": ITERATIONS},
    )  # fmt: skip
    return "" if done.success else f"SLSQP: {done.message}"


def _trust_constr(steps: _Steps) -> str:
    """A trust region with an interior point (Byrd, Hribar & Nocedal 1999)."""
    limits = NonlinearConstraint(lambda x: steps.values(x)[1:], -np.inf, 0.0, jac=lambda x: steps.gradients(x)[1:])
    done = minimize(
        lambda x: steps.values(x)[0], steps.start, jac=lambda x: steps.gradients(x)[0], method="trust-constr",
        bounds=Bounds(0.0, 1.0, keep_feasible=True), constraints=[limits] if steps.has_limits else [],
        options={"gtol": GTOL, "xtol": XTOL, "maxiter": ITERATIONS},
    )  # fmt: skip
    return "" if done.status in (1, 2) else f"trust-constr: {done.message}"


OPTIMISERS = {"slsqp": _slsqp, "trust-constr": _trust_constr}


def best_of(evaluations: Evaluations, designs: Sequence[Evaluated]) -> Evaluated:
    """The first of the best."""
    return min(designs, key=lambda one: rank(evaluations, one))
