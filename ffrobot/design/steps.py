"""What SLSQP and trust-constr of SciPy call in a search along gradients: values and gradients of the rows of `Split`.

A design that fails reads as far worse than the last one that did not, with its excesses: SLSQP's line search and
trust-constr's radius then shorten the step towards that one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from ..common.arrays import Array, as_floats
from .evaluations import Evaluated, Evaluations
from .optimality import Conflict, conflict, optimality
from .problem import KEPT
from .slopes import Differentiation, Slopes
from .variables import Place

AIM = 1e-4  # gradient of the Lagrangian, of the objective over a number's range, at an optimum
FAILED = 1e3  # how much worse a design that fails reads than the last good one, of the objective's size
ENOUGH = 0.5  # times that: where a search ends, before more runs judge it
DOWN = 0.05  # of the gradient since it was judged last: is judged again
FAR = 1e-2  # violation up to which an optimiser is left to itself: limits that it follows are always exceeded a little
NEARER = 0.9  # of the violation: much less
PATIENCE = 4  # gradients without that: the violation itself is made less
SHORTEST = 1e-6  # step of SLSQP, of a number's range: its line search refuses steps where a limit trades for the goal
ITERATIONS = 200
FTOL = 1e-9  # of the objective, and of excesses
GTOL, XTOL = 1e-7, 1e-9  # of trust-constr


class ReachedError(Exception):
    """The gradient says that this is an optimum, or a design keeps the limits where no more is wanted."""


class StuckError(Exception):
    """There is no gradient where the search is."""


class StalledError(Exception):
    """Steps are none, or limits are exceeded and have not come much nearer in the last ones."""


class ConflictError(Exception):
    """Limits are exceeded, and no design near exceeds them less."""

    def __init__(self, design: Evaluated, found: Conflict) -> None:
        super().__init__()
        self.design, self.conflict = design, found


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


class Steps:
    """The functions that optimisers call, of the coordinates x that are no catalogue's.

    Rows whose largest is to be least are those of the objective, or with `excess` those of the limits. Where there are
    several, x has one coordinate more, s: to be least, with rows − s ≤ 0.
    """

    def __init__(
        self, differentiation: Differentiation, start: Evaluated, tell: Callable[[str], None], *,
        judged: bool, excess: bool,
    ) -> None:  # fmt: skip
        self._differentiation, self._tell, self._judged, self._excess = differentiation, tell, judged, excess
        self._evaluations = differentiation.evaluations
        variables, split = self._evaluations.space.variables, self._evaluations.split
        self._free = [j for j, variable in enumerate(variables) if not variable.is_catalogue]
        self._tops = split.limit_rows if excess else split.objective_rows
        self._limits = [] if excess else split.limit_rows
        self._place, self.best, self._good = np.array(start.place), start, start
        self._gradients: dict[Place, Array] = {}
        self._residual = np.inf  # where they were judged last
        self.shortest = 0.0  # step between gradients: what is less is none
        self._violation, self._waited = np.inf, 0  # when it last became much less, and gradients since

    @property
    def has_level(self) -> bool:
        """Whether x ends with s."""
        return len(self._tops) > 1

    @property
    def start(self) -> Array:
        """Coordinates x."""
        x = as_floats(self._place[self._free])
        return as_floats(np.append(x, self._rows(x)[self._tops].max())) if self.has_level else x

    @property
    def bounds(self) -> Array:
        """(n, 2) of x."""
        sides = [(0.0, 1.0)] * len(self._free) + [(-np.inf, np.inf)] * self.has_level
        return np.array(sides)

    @property
    def has_limits(self) -> bool:
        """Whether there are any."""
        return bool(self._limits) or self.has_level

    def objective(self, x: Array) -> float:
        """F."""
        return float(x[-1]) if self.has_level else float(self._rows(x)[self._tops[0]])

    def objective_gradient(self, x: Array) -> Array:
        """(n,) of F."""
        return np.eye(x.size)[-1] if self.has_level else as_floats(self._row_gradients(x)[self._tops[0]])

    def excesses(self, x: Array) -> Array:
        """(m) to be 0 or less."""
        rows = self._rows(x)
        over = rows[self._tops] - x[-1] if self.has_level else np.zeros(0)
        return as_floats(np.concatenate([rows[self._limits], over]))

    def excess_gradients(self, x: Array) -> Array:
        """(m, n) of them."""
        rows = self._row_gradients(x)
        if not self.has_level:
            return as_floats(rows[self._limits])
        chosen = [*self._limits, *self._tops]
        level = np.where(np.arange(len(chosen)) < len(self._limits), 0.0, -1.0)
        return as_floats(np.column_stack([rows[chosen], level]))

    def _rows(self, x: Array) -> Array:
        """(r) of `Split`, scaled."""
        evaluations = self._evaluations
        one = self._at(x)
        if not one.completed:
            worse = np.isin(np.arange(len(evaluations.split.goals)), self._tops) * FAILED
            return as_floats(evaluations.split.scaled(evaluations.row_values(self._good)) + worse)
        if better(evaluations, one, self.best):
            self.best = one
        return evaluations.split.scaled(evaluations.row_values(one))

    def _row_gradients(self, x: Array) -> Array:
        """(r, n) of them."""
        one = self._at(x)
        if one.place not in self._gradients:
            if not one.completed:
                raise StuckError(f"ended at a design that fails: {one.failure}")
            if self._gradients and np.abs(np.subtract(one.place, self._good.place)).max() < self.shortest:
                raise StalledError
            self._good = one
            self._report(one)
            factors = self._evaluations.split.factors(self._evaluations.row_values(one))
            self._gradients[one.place] = self._gradients_at(one) * factors[:, None]
        return self._gradients[one.place]

    def _gradients_at(self, one: Evaluated) -> Array:
        """Of the goals; judged ones where the gradient has come down since there were some."""
        for judged in (self._judged, True):
            slopes = self._differentiation.slopes(one, judged=judged)
            if np.isnan(slopes.gradient[:, self._free]).any():
                raise StuckError("ended where no design next to the last one completes: see the table of runs")
            stands = optimality(self._evaluations, one, slopes)
            if stands.reached(ENOUGH * AIM) or (self._excess and stands.violation <= 0.0):
                self.best = one
                raise ReachedError
            if stands.residual > DOWN * self._residual:
                break
            self._residual = stands.residual
        self._watch(one, slopes)
        return slopes.gradient[:, self._free]

    def _watch(self, one: Evaluated, slopes: Slopes) -> None:
        """Whether limits that are exceeded come nearer. Raises `ConflictError` or `StalledError` where not."""
        if found := conflict(self._evaluations, one, slopes, AIM):
            raise ConflictError(one, found)
        violation = self._evaluations.problem.violation(one.readings)
        if violation <= max(FAR, NEARER * self._violation):
            self._violation, self._waited = violation if violation > FAR else np.inf, 0
            return
        self._waited += 1
        if self._waited >= PATIENCE and not self._excess:
            raise StalledError

    def _at(self, x: Array) -> Evaluated:
        place = self._place.copy()
        place[self._free] = np.clip(x[: len(self._free)], 0.0, 1.0)
        (one,) = self._evaluations.at([tuple(map(float, place))])
        return one

    def _report(self, one: Evaluated) -> None:
        problem = self._evaluations.problem
        violation = problem.violation(one.readings)
        beyond = f", {100 * violation:.3g} % beyond a limit" if violation > KEPT else ""
        self._tell(f"{problem.objective.text} {one.readings[0].value:.6g}{beyond}, {self._evaluations.runs} runs")


def _slsqp(steps: Steps) -> str:
    """Sequential quadratic programming (Kraft 1988)."""
    steps.shortest = SHORTEST
    limits = {
        "type": "ineq",
        "fun": lambda x: -steps.excesses(x),
        "jac": lambda x: -steps.excess_gradients(x),
    }
    done = minimize(
        steps.objective, steps.start, jac=steps.objective_gradient, method="SLSQP", bounds=steps.bounds,
        constraints=[limits] if steps.has_limits else [], options={"ftol": FTOL, "maxiter": ITERATIONS},
    )  # fmt: skip
    return "" if done.success else f"SLSQP: {done.message}"


def _trust_constr(steps: Steps) -> str:
    """A trust region with an interior point (Byrd, Hribar & Nocedal 1999)."""
    limits = NonlinearConstraint(steps.excesses, -np.inf, 0.0, jac=steps.excess_gradients)
    low, high = steps.bounds.T
    done = minimize(
        steps.objective, steps.start, jac=steps.objective_gradient, method="trust-constr",
        bounds=Bounds(low, high, keep_feasible=np.isfinite(low)), constraints=[limits] if steps.has_limits else [],
        options={"gtol": GTOL, "xtol": XTOL, "maxiter": ITERATIONS},
    )  # fmt: skip
    return "" if done.status in (1, 2) else f"trust-constr: {done.message}"


OPTIMISERS = {"slsqp": _slsqp, "trust-constr": _trust_constr}
