"""The best design of a scene: `ffrobot optimise`. Every design is a run that is kept.

Numbers are varied by SLSQP or trust-constr with gradients, from the scene's own values and further starts of a Latin
hypercube; catalogs, and rough responses, by differential evolution or enumeration. Gradients with error estimates
judge the best design by conditions of optimality.

The Pareto front of two responses is found by the ε-constraint method (Haimes, Lasdon & Wismer 1971). Each search begins
at its neighbor's design.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
from scipy.stats.qmc import LatinHypercube

from ..common.arrays import Array
from ..common.errors import InputError, SolveError
from ..pictures.studies.study import Diagram, Points
from ..run.watcher import Watcher
from ..sweep.files import run_files
from ..sweep.sweep import number
from .designs import Designs, Runs, SpentError, changes_for, may_repeat, moved
from .evaluations import Differentiation, Evaluated, Evaluations, write_designs
from .finding import CsvFile, TextTable, floats, with_unit
from .local_search import Local, best_of, combinations, evolve, rank, search_from
from .optimum_record import Optimum, Searched, parallel
from .readings import Response
from .responses import DesignProblem, Limit, parse_response, read_problem, with_motors
from .variables import DesignSpace, Place, read_space

BEST = "best"  # folder of the best design's scene
EVERY = 500  # combinations of rows: more are sought among


def find_optimum(
    runner: Runs,
    vary: Sequence[str],
    minimise: str | None,
    maximise: str | None,
    subject_to: Sequence[str],
    method: str,
    starts: int,
    seed: int,
    runs: int,
    tolerance: float,
) -> Optimum:
    """Return the best design of the scene of `runner`; other arguments as of `ffrobot.optimise`."""
    path, problem = runner.path, read_problem(minimise, maximise, subject_to)
    space, table = read_space(path, vary), runner.folder / "designs.csv"
    problem = with_motors(problem, space)
    chosen = _method(space, method, runs)
    check_start(path, space, chosen)
    evaluations = Evaluations(_designs(runner, space, problem.responses, tolerance, runs), space, problem)
    places = [] if space.start_place is None else [space.start_place]
    if starts > 1:
        sample = LatinHypercube(len(space.variables), seed=seed).random(starts - 1)
        places += [tuple(map(float, row)) for row in sample]
    try:
        searches = _search(chosen, Differentiation(evaluations, tolerance), places, seed, runner.watcher)
    finally:
        if evaluations.searched:
            write_designs(evaluations, table)
    best = min(searches, key=lambda one: rank(evaluations, one.best))
    if not best.best.completed:
        raise SolveError(f"{path}: no design could be run to its end; the first one: {evaluations.failures[0]}")
    with evaluations.designs.whole(best.best.design).results() as results:
        verdict = results.verdict
    point, folder = space.point(best.best.place), runner.folder / BEST
    changes = {key: value for key, value, own in zip(space.keys, point, space.own, strict=True) if value != own}
    scene = run_files(path, changes, folder).write(folder)
    return Optimum(
        scene=path,
        problem=evaluations.problem,
        space=space,
        method=chosen,
        **vars(best),
        searches=tuple(searches),
        runs=evaluations.designs.count,
        failures=tuple(evaluations.failures),
        tolerance=tolerance,
        verdict=verdict,
        best_scene=scene if runner.kept else None,
        designs=table if runner.kept else None,
        tried=tuple(evaluations.searched),
    )


def _method(space: DesignSpace, method: str, most: int) -> str:
    catalogues, combined = len(space.numbers) < len(space.variables), combinations(space)
    if method == "auto":
        return "slsqp" if not catalogues else "all" if 0 < combined <= min(EVERY, most) else "differential-evolution"
    if method in ("slsqp", "trust-constr") and catalogues:
        raise InputError(
            'optimise: method: expected "differential-evolution" where there are discrete sets', f'"{method}"'
        )
    if method == "all" and not combined:
        raise InputError('optimise: method: expected discrete sets alone for "all"', "a number between bounds")
    if method == "all" and combined > most:
        raise InputError(f"optimise: expected at most {most} designs in the discrete sets (--runs)", combined)
    return method


def check_start(path: Path, space: DesignSpace, method: str) -> None:
    """Raise `InputError` if a search along gradients cannot begin at the scene's own values."""
    for variable, start in zip(space.variables, space.start(), strict=True):
        if start is None and method in ("slsqp", "trust-constr"):
            values = [value for key, value in zip(space.keys, space.own, strict=True) if key in variable.keys]
            raise InputError(
                f"{path}: --vary: expected bounds of {variable.name} that hold the value where the search begins,"
                f" {' and '.join(f'{value:g}' for value in values)}",
                f"{variable.low:g}:{variable.high:g}",
            )


def _designs(runner: Runs, space: DesignSpace, responses: Sequence[Response], tolerance: float, most: int) -> Designs:
    """Designs in `space`. A bound that is impossible wherever the others are is refused."""
    fixed = changes_for(runner.path, responses, tolerance, keep_steps=may_repeat(space.keys))
    designs = Designs(runner, space.keys, space.own, fixed, most)
    others = [] if space.start_place is None else [space.start_place]
    others += [(0.0,) * len(space.variables), tuple(variable.top for variable in space.variables)]
    for j, variable in enumerate(space.variables):
        ends = () if variable.is_catalogue else ((0.0, variable.low), (1.0, variable.high))
        for end, bound in ends:
            if problem := designs.problem(*(space.point(moved(place, j, end)) for place in others)):
                raise InputError(
                    "--vary: expected bounds that designs can have", f"{variable.name} = {bound:g}:\n{problem}"
                )
    return designs


def _search(
    method: str, differentiation: Differentiation, starts: Sequence[Place], seed: int, watcher: Watcher
) -> list[Local]:
    """The searches that `method` means; of catalogs one, which goes on along gradients of numbers."""
    evaluations, optima = differentiation.evaluations, list[Local]()
    if method in ("slsqp", "trust-constr"):
        for k, place in enumerate(starts):
            title = f"start {k + 1} of {len(starts)}: " if len(starts) > 1 else ""
            with suppress(SpentError):
                optima.append(search_from(place, method, differentiation, watcher, title))
        return optima
    message = ""
    if method == "all":
        evaluations.at(list(product(*(map(float, range(len(v.rows))) for v in evaluations.space.variables))))
    else:
        message = evolve(evaluations, seed, starts[0] if starts else None, watcher.stage)
    first, best = evaluations.searched[0], best_of(evaluations, evaluations.searched)
    if not best.completed or not evaluations.space.numbers:
        return [Local(first, best, None, message)]
    local = search_from(best.place, "slsqp", differentiation, watcher)
    words = "; ".join(text for text in (message, local.message) if text)
    return [Local(first, local.best, local.optimality, words)]


@dataclass(frozen=True, kw_only=True)
class FrontPoint(Local):
    """A point of a Pareto front: the best design for one limit of the second response."""

    point: tuple[object, ...]  # values of the keys
    # values of the first and second response, in `units` of the front
    response: float
    against: float
    price: float  # ∂response/∂against along the front; NaN at its ends
    feasible: bool  # whether the design satisfies all limits


@dataclass(frozen=True, kw_only=True)
class Front(Searched):
    """A Pareto front: `points` from the least `responses[0]` to the least `responses[1]`.

    Designs have the responses of `problem`, then the second response.
    """

    name = "front"
    title = "Pareto front"

    responses: tuple[str, str]
    units: tuple[str, str]
    points: tuple[FrontPoint, ...]

    @property
    def values(self) -> Array:
        """Values (N, 2) of both responses at N points, SI units."""
        return np.array([(one.response, one.against) for one in self.points])

    @property
    def shortfall(self) -> str:
        """Statement that some designs are infeasible; empty if all are feasible."""
        good = all(one.feasible for one in self.points)
        return "" if good else "not all designs of the curve keep the limits: see the table"

    def headline(self) -> str:
        """Number of designs and their responses, in one line."""
        return f"{self.responses[0]} against {self.responses[1]}: {len(self.points)} designs"

    def sections(self) -> Iterator[TextTable]:
        """Table with a line for each design: both responses, shadow price, keys."""
        price = " per ".join(unit or "1" for unit in self.units)
        heading = (*map(with_unit, self.responses, self.units), f"price ({price})", *self.keys, "")
        rows = []
        for one in self.points:
            cost = f"{-one.price:.4g}" if np.isfinite(one.price) else ""
            state = "beyond a limit" if not one.feasible else "" if one.converged else "not converged"
            rows.append((f"{one.response:.6g}", f"{one.against:.6g}", cost, *map(number, one.point), state))
        yield TextTable(heading, rows)

    def remarks(self) -> Iterator[str]:
        """Lines with the method and notes on the accuracy."""
        how = f"{len(self.points)} designs by SLSQP, {self.runs} runs with a tolerance of at most {self.tolerance:g}"
        yield f"how        {how}"
        for one in self.points:
            if one.message and not one.converged:
                yield f"note       {self.responses[1]} {one.against:.6g}: {one.message}"

    def csv_files(self) -> Iterator[CsvFile]:
        """CSV table with one line for each design; `price` is ∂response/∂against along the front."""
        columns = [*self.responses, "price", *self.keys, "converged", "feasible", "message"]
        rows = []
        for one in self.points:
            price = one.price if np.isfinite(one.price) else ""
            states = ("yes" if state else "no" for state in (one.converged, one.feasible))
            rows.append([one.response, one.against, price, *one.point, *states, one.message])
        yield CsvFile("front.csv", columns, rows)

    def diagrams(self) -> list[Diagram]:
        """Diagrams of the front and of all designs."""
        best = [one.best for one in self.points]
        response, against = self.values.T
        curve = Points(
            name="front",
            title=f"{self.responses[0]} against {self.responses[1]}",
            x_label=with_unit(self.responses[1], self.units[1]),
            y_label=with_unit(self.responses[0], self.units[0]),
            x=floats(against),
            y=floats(response),
            sure=tuple(bool(one.converged and one.feasible) for one in self.points),
        )
        return [curve, parallel(self.space, self.problem, self.tried, best, "on the curve", self.responses[1])]


SAME = 1e-6  # of the second response: ends of a front that are one design


def find_front(
    runner: Runs,
    vary: Sequence[str],
    minimise: str,
    against: str,
    points: int,
    subject_to: Sequence[str],
    runs: int,
    tolerance: float,
) -> Front:
    """Compute `points` of the Pareto front of two responses; arguments as of `ffrobot.trade_off`."""
    path, problem = runner.path, read_problem(minimise, None, subject_to)
    space, other = read_space(path, vary), parse_response(against, "--against")
    if other.text == problem.objective.text:
        raise InputError(f'--against: expected another response than "{other.text}", which is minimized')
    if catalogue := next((v for v in space.variables if v.is_catalogue), None):
        raise InputError("--against: expected numbers between bounds", f"the discrete set of {catalogue.name}")
    check_start(path, space, "slsqp")
    both, responses = (problem.objective, other), (*problem.responses, other)
    designs = _designs(runner, space, responses, tolerance, runs)
    tried: dict[Path, Evaluated] = {}

    def least(problem: DesignProblem, start: Place, k: int) -> FrontPoint:
        evaluations, local, title = Evaluations(designs, space, problem), None, f"{k} of {points}"
        differentiation = Differentiation(evaluations, tolerance)
        with suppress(SpentError):
            local = search_from(start, "slsqp", differentiation, runner.watcher, f"{title}: ")
        if local is None or local.spent:
            raise SolveError(f"{path}: ended before {title} points after {runs} runs, as many as allowed")
        tried.update((one.design.folder, one) for one in evaluations.searched)
        if not local.best.completed:
            raise SolveError(f"{path}: no design could be run to its end: {local.message}")
        response, against = (one.value for one in local.best.design.read(both))
        return FrontPoint(
            point=space.point(local.best.place),
            response=response,
            against=against,
            price=_price(local, evaluations.problem, other),
            feasible=evaluations.problem.keeps(local.best.readings),
            **vars(local),
        )

    assert space.start_place is not None  # which `check_start` has seen to
    first = least(problem, space.start_place, 1)
    last = least(replace(problem, objective=other), first.best.place, points)
    high, low = first.against, last.against
    if high - low <= SAME * abs(high):
        raise InputError(
            f'--against: expected responses with different optima: where "{problem.objective.text}" is least,'
            f' "{other.text}" is too'
        )
    front = [first]
    spaced = np.geomspace if low * high > 0.0 else np.linspace  # equal ratios, or steps where the signs differ
    for k, bound in enumerate(map(float, spaced(high, low, points)[1:-1]), start=2):
        limits = (Limit(other, 1.0, bound), *problem.limits)
        front.append(least(replace(problem, limits=limits), front[-1].best.place, k))
    unit, other_unit = (one.unit for one in first.best.design.read(both))
    whole = (replace(one, readings=one.design.read(responses)) if one.completed else one for one in tried.values())
    return Front(
        scene=path,
        responses=(problem.objective.text, other.text),
        units=(unit, other_unit),
        points=(*front, last),
        runs=designs.count,
        tolerance=tolerance,
        space=space,
        problem=problem,
        tried=tuple(whole),
    )


def _price(local: Local, problem: DesignProblem, against: Response) -> float:
    """Return ∂response/∂limit of the second response, the first limit: 0 if inactive, NaN at the ends."""
    if local.optimality is None or not problem.limits or problem.limits[0].response is not against:
        return np.nan
    scale = problem.limits[0].scale * problem.factors(local.best.values)[0]
    return float(-np.nan_to_num(local.optimality.limits[0]) / scale)
