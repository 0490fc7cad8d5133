"""Searches along gradients from one start; all rows of catalogs; differential evolution.

A failed design counts as far worse than the last complete one: SLSQP's line search and trust-constr's radius then
shorten the step.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import prod

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, differential_evolution, minimize

from ..common.arrays import Array
from ..run.watcher import Watcher
from .designs import SpentError
from .evaluations import Differentiation, Evaluated, Evaluations, Optimality, optimality
from .responses import KEPT
from .variables import DesignSpace, Place

AIM = 1e-4  # gradient of the Lagrangian, of the objective over a number's range, at an optimum
FAILED = 1e3  # how much worse a failed design counts, of the objective's size
ENOUGH = 0.5  # times that: where a search ends, before more runs judge it
DOWN = 0.05  # of the gradient since it was judged last: is judged again
FAR = 1e-2  # violation that an optimizer may have: limits that it follows are exceeded a little
NEARER = 0.9  # of the violation: much less
PATIENCE = 4  # gradients without that: the violation itself is made less
SHORTEST = 1e-6  # step of SLSQP, of a range: its line search fails where a limit trades for the objective
ITERATIONS = 200
FTOL = 1e-9  # of the objective, and of excesses
GTOL, XTOL = 1e-7, 1e-9  # of trust-constr


class ReachedError(Exception):
    """Signals that a search is done: the gradient vanishes, or a search for a feasible design has found one."""


class StuckError(Exception):
    """Signals that no gradient exists at the current design, or the design fails."""


class StalledError(Exception):
    """Signals that steps vanish, or that the last ones hardly reduced the excess of limits."""


def rank(evaluations: Evaluations, one: Evaluated) -> tuple[int, float]:
    """Return a sort key of designs: feasible ones first, by objective; then by violation; failed ones last."""
    if not one.completed:
        return 2, 0.0
    violation = evaluations.problem.violation(one.readings)
    objective = float(evaluations.problem.scaled(one.values)[0])
    return (0, objective) if violation <= KEPT else (1, violation)


class _Functions:
    """Scaled functions for optimizers, of the coordinates x (n,) of numbers in the unit cube.

    They minimize the objective, or with `excess` the largest excess of a limit. Of several, x has one coordinate more,
    the level s to be minimized, with excesses − s ≤ 0. Excesses (m,) ≤ 0 are feasible.
    """

    def __init__(
        self,
        differentiation: Differentiation,
        start: Evaluated,
        tell: Callable[[str], None],
        *,
        judged: bool,
        excess: bool,
    ) -> None:
        self._differentiation, self._tell, self._judged, self._excess = differentiation, tell, judged, excess
        self._evaluations = differentiation.evaluations
        self._free, count = self._evaluations.space.numbers, len(self._evaluations.problem.responses)
        self._tops, self._limits = ([*range(1, count)], []) if excess else ([0], [*range(1, count)])
        self._place, self.best, self._good = np.array(start.place), start, start
        self._gradients: dict[Place, Array] = {}
        self._residual = np.inf  # where they were judged last
        self.shortest = 0.0  # step between gradients: what is less is none
        self._violation, self._waited = np.inf, 0  # when it last became much less, and gradients since
        self.has_level, x = len(self._tops) > 1, self._place[self._free]
        self.start = np.append(x, self._rows(x)[self._tops].max()) if self.has_level else x
        self.bounds = np.array([(0.0, 1.0)] * x.size + [(-np.inf, np.inf)] * self.has_level)
        limits = NonlinearConstraint(self.excesses, -np.inf, 0.0, jac=self.excess_gradients)
        self.constraints = [limits] if self._limits or self.has_level else []

    def objective(self, x: Array) -> float:
        return float(x[-1]) if self.has_level else float(self._rows(x)[self._tops[0]])

    def objective_gradient(self, x: Array) -> Array:
        return np.eye(x.size)[-1] if self.has_level else self._row_gradients(x)[self._tops[0]]

    def excesses(self, x: Array) -> Array:
        rows = self._rows(x)
        return rows[self._tops] - x[-1] if self.has_level else rows[self._limits]

    def excess_gradients(self, x: Array) -> Array:
        rows = self._row_gradients(x)
        if not self.has_level:
            return rows[self._limits]
        return np.column_stack([rows[self._tops], np.full(len(self._tops), -1.0)])

    def _rows(self, x: Array) -> Array:
        one, problem = self._at(x), self._evaluations.problem
        if not one.completed:
            rows = problem.scaled(self._good.values)
            rows[self._tops] += FAILED
            return rows
        self.best = best_of(self._evaluations, [self.best, one])
        return problem.scaled(one.values)

    def _row_gradients(self, x: Array) -> Array:
        one = self._at(x)
        if one.place not in self._gradients:
            if not one.completed:
                raise StuckError(f"ended at a design that fails: {one.failure}")
            if self._gradients and np.abs(np.subtract(one.place, self._good.place)).max() < self.shortest:
                raise StalledError
            self._good = one
            problem, runs = self._evaluations.problem, self._evaluations.designs.count
            violation = problem.violation(one.readings)
            beyond = f", {100 * violation:.3g} % beyond a limit" if violation > KEPT else ""
            self._tell(f"{problem.objective.text} {one.readings[0].value:.6g}{beyond}, {runs} runs")
            self._gradients[one.place] = self._gradients_at(one) * problem.factors(one.values)[:, None]
        return self._gradients[one.place]

    def _gradients_at(self, one: Evaluated) -> Array:
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
        if stands.violation <= max(FAR, NEARER * self._violation):
            self._violation, self._waited = stands.violation if stands.violation > FAR else np.inf, 0
        else:
            self._waited += 1
            if self._waited >= PATIENCE and not self._excess:
                raise StalledError
        return slopes.gradient[:, self._free]

    def _at(self, x: Array) -> Evaluated:
        place = self._place.copy()
        place[self._free] = np.clip(x[: len(self._free)], 0.0, 1.0)
        (one,) = self._evaluations.at([tuple(map(float, place))])
        return one


KINK = "peaks switch here as the largest: --method differential-evolution does without gradients"
BEYOND = "no smaller excess was found near this one: --starts searches from others"


@dataclass(frozen=True)
class Local:
    """One local search: first and best design, conditions of optimality at the best, and a message if it ended early.

    `spent`: whether it ended because no more runs were allowed. `optimality` is None if unknown.
    """

    start: Evaluated
    best: Evaluated
    optimality: Optimality | None
    message: str = ""
    spent: bool = False

    @property
    def converged(self) -> bool:
        """Whether the conditions of optimality are satisfied."""
        return self.optimality is not None and self.optimality.reached(AIM)


def search_from(
    start: Place, method: str, differentiation: Differentiation, watcher: Watcher, title: str = ""
) -> Local:
    """Search along gradients from one start by `method` ("slsqp", "trust-constr"); `title` precedes its messages.

    Later passes estimate errors of gradients; the last is by trust-constr, as SLSQP may stop early. After a pass that
    ends beyond limits, the largest excess is reduced; the search ends if that fails.
    """
    evaluations = differentiation.evaluations
    begun = len(evaluations.searched)

    def tell(text: str) -> None:
        watcher.stage(title + text)

    def stands(design: Evaluated) -> Optimality:
        return optimality(evaluations, design, differentiation.slopes(design, judged=True))

    (first,) = evaluations.at([start])
    if not first.completed:
        return Local(first, first, None, first.failure)
    best, optimum, message = first, None, ""
    try:
        for optimizer, judged in ((method, False), (method, True), ("trust-constr", True)):
            best, message = _pass(optimizer, differentiation, best, tell, judged=judged)
            optimum = stands(best)
            if optimum.reached(AIM):
                return Local(first, best, optimum)
            if optimum.violation > KEPT:
                best, _ = _pass("slsqp", differentiation, best, tell, judged=judged, excess=True)
                optimum = stands(best)
                if judged and optimum.violation > KEPT:
                    return Local(first, best, optimum, BEYOND)
        message = KINK if optimum and optimum.kinks else message
    except (SpentError, StuckError) as error:
        last = best_of(evaluations, [best, *evaluations.searched[begun:]])
        spent = isinstance(error, SpentError)
        return Local(first, last, optimum if last is best else None, str(error), spent=spent)
    return Local(first, best, optimum, message)


def _pass(
    optimizer: str,
    differentiation: Differentiation,
    best: Evaluated,
    tell: Callable[[str], None],
    *,
    judged: bool,
    excess: bool = False,
) -> tuple[Evaluated, str]:
    """The best design of an optimizer from `best` on, and why it ended where that is not at an optimum.

    "slsqp" is sequential quadratic programming (Kraft 1988), "trust-constr" a trust region with an interior point
    (Byrd, Hribar & Nocedal 1999).
    """
    steps, is_slsqp = _Functions(differentiation, best, tell, judged=judged, excess=excess), optimizer == "slsqp"
    steps.shortest = SHORTEST if is_slsqp else 0.0
    low, high = steps.bounds.T
    with suppress(ReachedError, StalledError):
        done = minimize(
            steps.objective,
            steps.start,
            jac=steps.objective_gradient,
            method=optimizer,
            bounds=Bounds(low, high, keep_feasible=np.isfinite(low)),
            constraints=steps.constraints,
            options={"maxiter": ITERATIONS, **({"ftol": FTOL} if is_slsqp else {"gtol": GTOL, "xtol": XTOL})},
        )
        has_ended_well = done.success if is_slsqp else done.status in (1, 2)
        return steps.best, "" if has_ended_well else f"{'SLSQP' if is_slsqp else optimizer}: {done.message}"
    return steps.best, ""


def best_of(evaluations: Evaluations, designs: Sequence[Evaluated]) -> Evaluated:
    """Return the first of the best designs by `rank`."""
    return min(designs, key=lambda one: rank(evaluations, one))


POPULATION = 8  # designs of a generation for each variable
SMALLEST = 12  # generation
GENERATIONS = 500
SPREAD = 1e-3  # of the objective in the last generation


def combinations(space: DesignSpace) -> int:
    """Return the number of combinations of discrete values; 0 if a variable is continuous."""
    return prod(len(variable.rows) for variable in space.variables)


@np.errstate(invalid="ignore")
def evolve(evaluations: Evaluations, seed: int, start: Place | None, tell: Callable[[str], None]) -> str:
    """Search by differential evolution, a generation in parallel; return the reason if it ended early, else "".

    `start`: a design of the first generation; None: all are random. `tell`: function for messages on progress.
    """
    space, problem = evaluations.space, evaluations.problem
    count = len(space.variables)

    def values(places: Array) -> Array:
        """Return scaled responses (1 + m, S) of S places (n, S), or of one (n); infinite where designs fail."""
        designs = evaluations.at([tuple(map(float, place)) for place in places.reshape(count, -1).T])
        failed = np.full(len(problem.responses), np.inf)
        rows = [problem.scaled(one.values) if one.completed else failed for one in designs]
        return np.reshape(rows, (-1, len(failed))).T

    limits = (NonlinearConstraint(lambda places: values(places)[1:], -np.inf, 0.0),) if problem.limits else ()
    try:
        done = differential_evolution(
            lambda places: values(places)[0], [(0.0, variable.top) for variable in space.variables],
            popsize=max(POPULATION, -(-SMALLEST // count)), maxiter=GENERATIONS, tol=SPREAD, seed=seed, polish=False,
            updating="deferred", vectorized=True, constraints=limits, x0=start,
            callback=lambda x, convergence: tell(f"differential evolution, {evaluations.designs.count} runs"),
            integrality=[variable.is_catalogue for variable in space.variables],
        )  # fmt: skip
    except SpentError as error:
        return str(error)
    return "" if done.success else f"differential evolution: {done.message}"
