"""The analyses of a scene, run one after the other."""

import logging
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..actuation.context import ActuatedContext
from ..actuation.points import forces_at_points
from ..common.errors import FfrobotError, InputError, SolveError, of_file
from ..mbs.posture.path_start import path_start
from ..mbs.posture.start import check_turning, turned_guesses
from ..mbs.quantities.validity import NOTABLE_STIFFNESS_CHANGE
from ..mbs.run.record import Run
from ..mbs.scene.analysis import Analysis
from ..scene.scene import Scene
from .fastest import with_paths
from .mode_search import ModeSearch, reported_modes
from .pieces import make_whole_links, wanted_pieces
from .prepare import prepare_scene, unsolved, with_bodies, with_pieces
from .result import AnalysisResult, Solution
from .watcher import Interruption, Watcher

if TYPE_CHECKING:
    from ..actuation.feasibility import Feasibility

logger = logging.getLogger(__name__)

Keep = Callable[[Solution], None]


def solve_scene(
    scene: Scene | Path,
    watcher: Watcher | None = None,
    keep: Keep | None = None,
    wanted: frozenset[str] | None = None,
) -> Solution:
    """Run every analysis of a scene or a scene file; stage 1 runs first for links that are out of date.

    An analysis that does not reach its end, or is stopped by Ctrl-C, is kept up to there and ends the run
    (`Run.check_completed`). `keep` is called with the solution, also before an error is raised. Only datasets and
    groups `wanted`, "ANALYSIS/NAME", are evaluated for the results file; None: all.
    Raises `InputError` for anything wrong with the scene or the files it names, `SolveError` where no state is found.
    """
    watcher = watcher or Watcher()
    return run_analyses(replace(prepare_scene(scene, watcher), wanted=wanted), watcher, keep)


def run_analyses(solution: Solution, watcher: Watcher, keep: Keep | None = None) -> Solution:
    """Run the analyses of a prepared solution, from `solution.earlier` on where present.

    `keep` is called with the new solution, also before an error is raised, if it has all of `earlier`.
    """
    scene, model = solution.scene, solution.model
    check_turning(model)
    checked = [analysis.name for analysis in scene.analysis if analysis.is_checked]
    is_compliant = any(getattr(joint, "stiffness", None) is not None for joint in scene.joint)
    if checked and (is_compliant or not model.motors):  # robots that nothing simulates on finer links
        wanted = 'expected motors, and joints without stiffness, for "finer"'
        raise InputError(f'{scene.path}: analysis "{checked[0]}": check: {wanted}')
    with Interruption(watcher) as interruption:
        judge = partial(_judged, replace(solution, earlier={}), interruption)
        scene, notes = with_paths(scene, model, judge, watcher.stage)
        solution = replace(unsolved(replace(solution, scene=scene)) if notes else solution, path_notes=notes)
        if any(body.modes == "auto" for body in scene.body):
            solution = _with_enough_modes(solution, interruption)
        else:
            solution = _completed(solution, interruption)
            if any(body.pieces == "auto" for body in scene.body):
                solution = _with_enough_pieces(solution, interruption)
        if checked:
            from .finer import with_finer_check

            solution = with_finer_check(solution, watcher)
        solution = _with_deviations(solution, interruption)
        if keep is not None and solution.outcomes and solution.earlier.keys() <= solution.outcomes.keys():
            keep(solution)
    if solution.failure is not None:
        raise solution.failure
    return solution


def _with_deviations(solution: Solution, interruption: Interruption) -> Solution:
    results, failure = dict(solution.analyses), solution.failure
    for name, result in solution.analyses.items():
        if getattr(result.analysis, "robustness", None) is None or result.status != "completed":
            continue
        from .robustness import deviations

        interruption.watcher.stage(f'robustness of "{name}"')
        try:
            with of_file(solution.scene.path):
                context = _context(solution, result.analysis, results, interruption)
                results[name] = result.having(deviations=deviations(context, result.run))
        except Exception as error:
            failure = failure or error
    return replace(solution, analyses=results, failure=failure)


def _with_enough_modes(solution: Solution, interruption: Interruption) -> Solution:
    search = ModeSearch(solution.scene, solution.bodies)
    while True:
        solution = _completed(with_bodies(solution, search.bodies), interruption)
        if solution.failure is not None:
            return solution
        results = solution.analyses
        is_whole = len(results) == len(solution.scene.analysis) and all(
            of.status == "completed" for of in results.values()
        )
        reported = {name: reported_modes(result) for name, result in results.items()} if is_whole else None
        search.add(reported, last=interruption.requested)
        if search.is_over:
            return replace(solution, mode_choice=search.choice())


def _with_enough_pieces(solution: Solution, interruption: Interruption) -> Solution:
    """The scene solved again with links in as many pieces as they bend far, those of `pieces = "auto"`."""
    given = {body.name: body.pieces for body in solution.scene.body if isinstance(body.pieces, int)}
    while solution.failure is None and not interruption.requested:
        if not (more := wanted_pieces(solution, list(solution.outcomes.values()))):
            break
        solution = _completed(with_pieces(solution, given | more, interruption.watcher), interruption)
    return solution


def _judged(solution: Solution, interruption: Interruption, trial: Scene) -> "Feasibility | None":
    """What the one analysis of a scene asks of motors and patches; None where it fails."""
    try:
        solved = _completed(unsolved(replace(solution, scene=trial)), interruption)
        if solved.unread is not None:
            assert solved.failure is not None
            raise solved.failure
        (result,) = solved.analyses.values()
    except SolveError as error:
        numerical = FfrobotError | ArithmeticError | np.linalg.LinAlgError | None
        if not isinstance(error.__cause__, numerical):  # a fault of the program, which the log has
            raise
        return None
    return None if result.run.failed or result.actuation is None else result.actuation.feasibility


def _completed(solution: Solution, interruption: Interruption) -> Solution:
    """All analyses run; all of them again with geometric stiffening where its "auto" finds that they need it."""
    completed = _run_all(solution, interruption) or _run_all(unsolved(replace(solution, stiffened=True)), interruption)
    assert completed is not None
    return completed


def _run_all(solution: Solution, interruption: Interruption) -> Solution | None:
    """The analyses up to the first that fails; None where `geometric_stiffening = "auto"` asks for them all again."""
    results: dict[str, AnalysisResult] = {}
    seconds = dict(solution.seconds)
    for analysis in solution.scene.analysis:
        if interruption.requested and results:
            break
        interruption.watcher.stage(f'analysis "{analysis.name}"')
        began = time.perf_counter()
        interruption.keeps, interruption.at_once = bool(results), True
        try:
            with of_file(f'{solution.scene.path}: analysis "{analysis.name}"'):
                run = analysis.run(_context(solution, analysis, results, interruption))
                assert isinstance(run, Run)
            if not results:
                texts = (*run.statistics.warnings, *turned_guesses(solution.scene))
                run = replace(run, statistics=replace(run.statistics, warnings=texts))
        except Exception as error:  # raised once the analyses before it are kept
            if not results:
                raise
            return replace(solution, analyses=results, seconds=seconds, failure=error)
        except KeyboardInterrupt:
            if not results:
                raise
            break
        finally:
            interruption.at_once = False
        try:
            with of_file(solution.scene.path), run.arithmetic:
                result = AnalysisResult.of(solution, run, results)
        except Exception as error:  # raised once the integration is kept
            return _unread(replace(solution, analyses=results, seconds=seconds), run, error)
        automatic = solution.scene.geometric_stiffening == "auto" and not solution.stiffened
        if automatic and run.status != "interrupted" and result.stiffening_effect > NOTABLE_STIFFNESS_CHANGE:
            return None
        results[analysis.name] = result
        seconds[analysis.name] = time.perf_counter() - began
        _log(run)
        if run.failed:
            break
    return replace(solution, analyses=results, seconds=seconds)


def _unread(solution: Solution, run: Run, error: Exception) -> Solution:
    """The solution with a run whose outputs failed with `error`: its states are kept where `resume` takes them up."""
    kept = replace(run, statistics=replace(run.statistics, status="not evaluated"))
    if run.continuation is None or not solution.goes_on(kept):
        if not solution.analyses:
            raise error
        return replace(solution, failure=error)
    if isinstance(error, FfrobotError):
        return replace(solution, unread=kept, failure=error)
    logger.error('analysis "%s": outputs failed', run.analysis.name, exc_info=error)
    failure = SolveError(
        f'{solution.scene.path}: analysis "{run.analysis.name}": outputs failed after the integration, which is kept'
        f" for --resume: {type(error).__name__}: {error}"
    )
    failure.__cause__ = error
    return replace(solution, unread=kept, failure=failure)


def _context(
    solution: Solution, analysis: Analysis, results: dict[str, AnalysisResult], interruption: Interruption
) -> ActuatedContext:
    sources = [other.source for other in solution.scene.analysis if other.takes_actuation]
    return ActuatedContext(
        model=solution.model,
        outcomes={name: result.run for name, result in results.items()},
        path=path_start(solution.model, analysis.last_time) if analysis.starts_on_path else None,
        progress=lambda t: interruption.advance(t, analysis.last_time),
        is_replayed=analysis.is_checked or analysis.name in sources,
        earlier=solution.earlier.get(analysis.name),
        points=solution.points,
        at_points=partial(forces_at_points, solution.points),
        patches=solution.patches,
        links=solution.links,
        carrying={name: body.carrying for name, body in solution.bodies.items()},
        whole=make_whole_links(solution),
    )


def _log(run: Run) -> None:
    of, end = run.statistics, run.time[-1] if len(run.time) else 0.0
    work = f"{of.steps} steps, {of.rejected} rejected, {of.evaluations} evaluations, {of.wall_seconds:.3f} s"
    how = f"integrator {of.integrator.name}: {of.integrator.reason}"
    logger.info('analysis "%s": %s at t = %g s, %s; %s', run.analysis.name, of.status, end, work, how)
