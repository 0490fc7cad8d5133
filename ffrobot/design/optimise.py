"""The best design of a scene: `ffrobot optimise`. Every design is a run that is kept, as those of sensitivities are.

Numbers are sought by SLSQP or trust-constr with gradients, from the scene's own values and further starts of a Latin
hypercube; catalogs, and goals that are rough, by differential evolution or by trying every row. What is found last
is judged by central differences: multipliers of limits and bounds, and how far the gradient is from theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from itertools import product
from pathlib import Path

from scipy.stats.qmc import LatinHypercube

from ..common.errors import InputError, SolveError
from ..run.watcher import Watcher
from ..sweep.files import run_files
from .designs import Designs, Runs, changes_for, may_repeat
from .evaluations import Evaluations, SpentError, write_designs
from .goals import read_problem, with_motors
from .local_search import Local, best_of, combinations, evolve, rank, search_from
from .optimality import Differentiation
from .optimum_record import Optimum
from .variables import Place, Space, read_space

BEST = "best"  # folder of the best design's scene
EVERY = 500  # combinations of rows: more are sought among


def find_optimum(
    runner: Runs, vary: Sequence[str], minimise: str | None, maximise: str | None, subject_to: Sequence[str],
    method: str, starts: int, seed: int, runs: int, tolerance: float,
) -> Optimum:  # fmt: skip
    """See `ffrobot.optimise`."""
    path, problem = runner.path, read_problem(minimise, maximise, subject_to)
    space = read_space(path, vary)
    problem = with_motors(problem, space)
    chosen = _method(space, method, runs)
    check_start(path, space, chosen)
    fixed = changes_for(path, problem.goals, tolerance, keep_steps=may_repeat(space.keys))
    designs = Designs(runner, space.keys, space.own, fixed)
    check_bounds(designs, space)
    evaluations = Evaluations(designs, space, problem, runs)
    differentiation = Differentiation(evaluations, tolerance)
    try:
        searches = _search(chosen, differentiation, _starts(space, starts, seed), seed, runner.watcher)
    finally:
        if evaluations.searched:
            write_designs(evaluations, runner.folder / "designs.csv")
    best = min(searches, key=lambda one: rank(evaluations, one.best))
    if not best.best.completed:
        raise SolveError(f"{path}: no design could be run to its end; the first one: {evaluations.failures[0]}")
    return _optimum(runner, chosen, evaluations, best, searches, tolerance)


def _method(space: Space, method: str, most: int) -> str:
    catalogues, combined = any(v.is_catalogue for v in space.variables), combinations(space)
    if method == "auto":
        return "slsqp" if not catalogues else "all" if 0 < combined <= min(EVERY, most) else "differential-evolution"
    if method in ("slsqp", "trust-constr") and catalogues:
        raise InputError(
            f'optimise: method: expected "differential-evolution" where there are discrete sets, found "{method}"'
        )
    if method == "all" and not combined:
        raise InputError('optimise: method: expected discrete sets alone for "all", found a number between bounds')
    if method == "all" and combined > most:
        raise InputError(f"optimise: expected at most {most} designs in the discrete sets (--runs), found {combined}")
    return method


def check_start(path: Path, space: Space, method: str) -> None:
    """Raise `InputError` where a search along gradients could not begin at the scene itself."""
    for variable, start in zip(space.variables, space.start(), strict=True):
        if start is None and method in ("slsqp", "trust-constr"):
            values = [value for key, value in zip(space.keys, space.own, strict=True) if key in variable.keys]
            raise InputError(
                f"{path}: --vary: expected bounds of {variable.name} that hold the value where the search begins,"
                f" {' and '.join(f'{value:g}' for value in values)}, found {variable.low:g}:{variable.high:g}"
            )


def check_bounds(designs: Designs, space: Space) -> None:
    """Raise `InputError` for a bound that is impossible wherever the others are, before any run."""
    others = [] if space.start_place is None else [space.start_place]
    others += [(0.0,) * len(space.variables), tuple(variable.top for variable in space.variables)]
    for j, variable in enumerate(space.variables):
        ends = () if variable.is_catalogue else ((0.0, variable.low), (1.0, variable.high))
        for end, bound in ends:
            points = (space.point((*place[:j], end, *place[j + 1 :])) for place in others)
            if problem := designs.problem(*points):
                raise InputError(
                    f"--vary: expected bounds that designs can have, found {variable.name} = {bound:g}:\n{problem}"
                )


def _starts(space: Space, count: int, seed: int) -> list[Place]:
    """The scene itself, where it is in all bounds and catalogs, and places of a Latin hypercube."""
    found = [] if space.start_place is None else [space.start_place]
    if count > 1:
        sample = LatinHypercube(len(space.variables), seed=seed).random(count - 1)
        found += [tuple(map(float, row)) for row in sample]
    return found


def _search(
    method: str, differentiation: Differentiation, starts: Sequence[Place], seed: int, watcher: Watcher
) -> list[Local]:
    """The searches that `method` means; of catalogs one, which goes on along gradients of numbers."""
    evaluations = differentiation.evaluations
    if method in ("slsqp", "trust-constr"):
        return _from_starts(method, differentiation, starts, watcher)
    message = ""
    if method == "all":
        evaluations.at(list(product(*(map(float, range(len(v.rows))) for v in evaluations.space.variables))))
    else:
        message = evolve(evaluations, seed, starts[0] if starts else None, watcher.stage)
    first, best = evaluations.searched[0], best_of(evaluations, evaluations.searched)
    if not best.completed or all(variable.is_catalogue for variable in evaluations.space.variables):
        return [Local(first, best, None, message)]
    found = search_from(best.place, "slsqp", differentiation, watcher.stage)
    words = "; ".join(text for text in (message, found.message) if text)
    return [Local(first, found.best, found.optimality, words)]


def _from_starts(
    method: str, differentiation: Differentiation, starts: Sequence[Place], watcher: Watcher
) -> list[Local]:
    found: list[Local] = []
    for k, place in enumerate(starts):
        title = f"start {k + 1} of {len(starts)}: " if len(starts) > 1 else ""
        with suppress(SpentError):
            found.append(search_from(place, method, differentiation, partial(_tell, watcher, title)))
    return found


def _tell(watcher: Watcher, title: str, text: str) -> None:
    watcher.stage(title + text)


def _optimum(
    runs: Runs, method: str, evaluations: Evaluations, best: Local, searches: Sequence[Local], tolerance: float
) -> Optimum:
    space, problem = evaluations.space, evaluations.problem
    with best.best.design.results() as results:
        verdict = results.verdict
    point = space.point(best.best.place)
    changes = {key: value for key, value, own in zip(space.keys, point, space.own, strict=True) if value != own}
    folder = runs.folder / BEST
    scene = run_files(runs.path, changes, folder).write(folder)
    return Optimum(
        runs.path, problem, space, method, best.start, best.best, best.optimality, best.message,
        tuple(searches), evaluations.runs, tuple(evaluations.failures), tolerance, verdict,
        scene if runs.kept else None, designs=runs.folder / "designs.csv" if runs.kept else None,
        tried=tuple(evaluations.searched),
    )  # fmt: skip
