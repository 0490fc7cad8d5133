"""The analyses of a scene, run one after the other."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..actuation.context import ActuatedContext
from ..actuation.points import PointForces, forces_at_points, solve_points
from ..common.arrays import Array, Indices
from ..common.errors import FfrobotError, InputError, SolveError, of_file
from ..mbs.posture.reach import turned_guesses
from ..mbs.posture.start import check_turning
from ..mbs.quantities.motion import reported_points
from ..mbs.quantities.reactions import reactions, shared_evenly
from ..mbs.quantities.settling import Settling, commanded_rest, end_points, settling
from ..mbs.quantities.supply import actuator_forces, gear_motions, totals
from ..mbs.quantities.validity import NOTABLE_STIFFNESS_CHANGE
from ..mbs.run.record import Run
from ..mbs.scene.analysis import Analysis, TimedAnalysis
from ..scene.load import load_scene
from ..scene.scene import Scene
from .actuation import Actuation, find_actuation, missing_forces
from .bodies import load_bodies
from .fastest import with_paths
from .mode_choice import mode_levels, reported_modes
from .pieces import bending_of_links, links_in_pieces, wanted_pieces
from .prepare import check_replays, made_solution, with_bodies, with_pieces, with_scene, with_stiffening
from .solution import AnalysisResult, Histories, Solution
from .stresses import find_stresses
from .watcher import Interruption, Watcher
from .whole_links import make_whole_links

if TYPE_CHECKING:
    from ..actuation.feasibility import Feasibility

logger = logging.getLogger(__name__)


Keep = Callable[[Solution], None]


def solve_scene(scene: Scene | Path, watcher: Watcher | None = None, keep: Keep | None = None) -> Solution:
    """Run every analysis of a scene, or of a scene file, in space; stage 1 runs first for links that are out of date.

    Shapers for the robot's frequencies and the fastest motion are found first (see `fastest`).
    With `modes = "auto"` they are run with more and more modes, until the estimated error meets the tolerances.

    An analysis that does not reach its end is kept as far as it got, and ends the run (`Run.check_completed`).
    So does Ctrl-C during an analysis. `keep` is given what there is before an error is raised.
    Raises `InputError` for anything wrong with the scene or the files it names, `SolveError` where no state is found.
    """
    watcher = watcher or Watcher()
    return run_analyses(prepare_scene(scene, watcher), watcher, keep)


def prepare_scene(scene: Scene | Path, watcher: Watcher | None = None) -> Solution:
    """All that analyses start from, nothing solved yet. Raises `InputError` as `solve_scene`."""
    watcher = watcher or Watcher()
    if isinstance(scene, Path):
        scene = load_scene(scene)
    began = time.perf_counter()
    loaded = load_bodies(scene, watcher.stage)
    seconds = {"links and files": time.perf_counter() - began}
    bodies = {body.name: part for body, part in zip(scene.body, loaded, strict=True)}
    counts = {body.name: 1 if body.pieces == "auto" else body.pieces for body in scene.body if body.pieces is not None}
    return with_pieces(made_solution(scene, bodies, seconds), counts, watcher)


def run_analyses(solution: Solution, watcher: Watcher, keep: Keep | None = None) -> Solution:
    """Run the analyses of a prepared solution; they resume from `solution.earlier` if present."""
    check_turning(solution.model)
    check_replays(solution)
    with Interruption(watcher) as interruption:
        judge = partial(_judged, replace(solution, earlier={}), interruption)
        scene, notes = with_paths(solution.scene, solution.model, judge, watcher.stage)
        solution = replace(with_scene(solution, scene) if notes else solution, path_notes=notes)
        if any(body.modes == "auto" for body in scene.body):
            solution = _with_enough_modes(solution, interruption)
        elif any(body.pieces == "auto" for body in scene.body):
            solution = _with_enough_pieces(solution, interruption)
        else:
            solution = _completed(solution, interruption)
        if any(analysis.is_checked for analysis in scene.analysis):
            from .finer import with_finer_check

            solution = with_finer_check(solution, prepare_scene, watcher)
        solution = _with_deviations(solution, interruption)
        if keep is not None and solution.outcomes:
            keep(solution)
    if solution.failure is not None:
        raise solution.failure
    return solution


def _with_deviations(solution: Solution, interruption: Interruption) -> Solution:
    """The solution with what is left of completed motions where the robot is not its model, where that is asked for."""
    results, failure = dict(solution.analyses), solution.failure
    for name, result in solution.analyses.items():
        if getattr(result.analysis, "robustness", None) is None or result.status != "completed":
            continue
        from .robustness import deviations

        interruption.watcher.stage(f'robustness of "{name}"')
        try:
            with of_file(solution.scene.path):
                context = _context(solution, result.analysis, results, interruption)
                results[name] = replace(result, deviations=deviations(context, result.run))
        except Exception as error:
            failure = failure or error
    return replace(solution, analyses=results, failure=failure)


def _with_enough_modes(solution: Solution, interruption: Interruption) -> Solution:
    """The scene solved with as many modes as its tolerances need: see `mode_search`."""
    from .mode_search import ModeSearch, error_tolerances

    search = ModeSearch(error_tolerances(solution.scene), mode_levels(solution.scene, solution.bodies))
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
    """The scene solved with links in as many pieces as they bend far, those of `pieces = "auto"`."""
    solution = _completed(solution, interruption)
    given = {body.name: body.pieces for body in solution.scene.body if isinstance(body.pieces, int)}
    while solution.failure is None and not interruption.requested and (more := wanted_pieces(solution)):
        solution = _completed(with_pieces(solution, {**given, **more}, interruption.watcher), interruption)
    return solution


def _judged(solution: Solution, interruption: Interruption, trial: Scene) -> Feasibility | None:
    """What the one analysis of a scene asks of motors and patches; None where it fails."""
    try:
        solved = _completed(with_scene(solution, trial), interruption)
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
    """All analyses run, all of them stiffened where `geometric_stiffening = "auto"` asks for that."""
    completed = _run_all(solution, interruption) or _run_all(with_stiffening(solution), interruption)
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
                result = _result(solution, run, results)
        except Exception as error:  # raised once the integration is kept
            return _unread(replace(solution, analyses=results, seconds=seconds), run, error)
        automatic = solution.scene.geometric_stiffening == "auto" and not solution.stiffened
        if automatic and result.stiffening_effect > NOTABLE_STIFFNESS_CHANGE and run.status != "interrupted":
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
    solution: Solution, analysis: Analysis, results: Mapping[str, AnalysisResult], interruption: Interruption
) -> ActuatedContext:
    others = (other for other in solution.scene.analysis if other.takes_actuation)
    return ActuatedContext(
        model=solution.model,
        outcomes={name: result.run for name, result in results.items()},
        progress=lambda t: interruption.advance(t, analysis.last_time),
        is_replayed=analysis.is_checked or any(other.source == analysis.name for other in others),
        earlier=solution.earlier.get(analysis.name),
        points=solution.points,
        at_points=partial(forces_at_points, solution.points),
        patches=solution.patches,
        links=solution.links,
        carrying={name: body.carrying for name, body in solution.bodies.items()},
        whole=make_whole_links(solution),
    )


def _result(solution: Solution, run: Run, earlier: Mapping[str, AnalysisResult]) -> AnalysisResult:
    """What is read off a run; what has peaks at its outputs and between, as far as that is known."""
    seen, sharing = shared_evenly(replace(run, links=links_in_pieces(solution)))
    twists = {joint: gear.curve for joint, gear in gear_motions(seen).items()}  # splines through outputs
    known = {joint: curve for joint, curve in twists.items() if curve is not None}
    closest = seen
    if run.closer is not run and len(known) == len(twists):
        closest = shared_evenly(replace(run.closer, links=seen.links, twists=known))[0]
    histories = _histories(solution, closest, np.searchsorted(closest.time, run.time))
    energies, momentum = totals(seen)
    result = AnalysisResult(
        run=seen,
        energies=energies,
        momentum=momentum,
        histories=histories,
        sharing=sharing,
        bending=bending_of_links(solution, closest),
        point_forces=histories.point_forces if closest is seen else _point_forces(solution, run),
        settling=_settling(solution, seen, earlier),
    )
    return replace(result, predicted_shift=_predicted_shift(solution, result))


def _settling(solution: Solution, run: Run, earlier: Mapping[str, AnalysisResult]) -> dict[str, Settling]:
    """By point, of a run that goes on after the paths that it, or the analysis that it replays, follows."""
    analysis = run.analysis
    source = earlier.get(analysis.source or "") if analysis.takes_actuation else None
    commanding = run if source is None else source.run
    if not isinstance(analysis, TimedAnalysis) or run.status != "completed":
        return {}
    rest = commanded_rest(commanding)
    if rest is None or not rest.since < run.time[-1]:
        return {}
    metrics = getattr(run.details, "metrics", None)
    lowest = rest.frequency if metrics is None else metrics.lowest_frequency
    points = list(end_points(solution.scene, reported_points(run)))
    return settling(replace(run.closer, links=run.links), rest, points, analysis.settled, lowest)


def _predicted_shift(solution: Solution, result: AnalysisResult) -> dict[str, Array]:
    """Shift (T, 3), m, of all points by modal forces that nothing supplies; of links in pieces as of the whole links.

    None where the joints of whole links cannot say how the pieces move.
    """
    run, of = result.run, result.histories
    missing = {} if of.actuation is None else missing_forces(of.run, of.actuation)
    if not missing:
        return {}
    from ..actuation.feasibility import quasi_static_shift

    points = [f"{body}.{label}" for body, labels in reported_points(run).items() for label in labels]
    if (whole := make_whole_links(solution)) is not None:
        try:
            run = whole.as_links(run)
        except InputError:
            return {}
    return quasi_static_shift(run, {name: forces[of.outputs] for name, forces in missing.items()}, points)


def _actuation(solution: Solution, run: Run) -> Actuation | None:
    """What a run asks of motors and patches; None where nothing is asked of them."""
    if actuator_forces(run) is None or not run.analysis.is_motion:
        return None
    actuation = find_actuation(solution.scene, run, solution.bodies, solution.patches)
    if (missed := actuation.feasibility.unsupplied) is not None and missed.point:
        from ..mbs.analysis.operating_points import open_loop_growth

        missed = replace(missed, growth=open_loop_growth(run))
        actuation = replace(actuation, feasibility=replace(actuation.feasibility, unsupplied=missed))
    return actuation


def _histories(solution: Solution, run: Run, outputs: Indices) -> Histories:
    return Histories(
        run=run,
        outputs=outputs,
        reactions=reactions(run),
        actuation=_actuation(solution, run),
        stresses=find_stresses(run, solution.parts or solution.bodies, solution.patches, solution.divided),
        point_forces=_point_forces(solution, run),
    )


def _point_forces(solution: Solution, run: Run) -> dict[str, PointForces]:
    if run.analysis.allocates_patches and any(row.is_trajectory for row in run.model.rows):
        return {name: solve_points(points, run) for name, points in solution.points.items()}
    return {}


def _log(run: Run) -> None:
    of, end = run.statistics, run.time[-1] if len(run.time) else 0.0
    work = f"{of.steps} steps, {of.rejected} rejected, {of.evaluations} evaluations, {of.wall_seconds:.3f} s"
    how = f"integrator {of.integrator.name}: {of.integrator.reason}"
    logger.info('analysis "%s": %s at t = %g s, %s; %s', run.analysis.name, of.status, end, work, how)
