"""The analyses of a scene, run one after the other."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ..actuation.context import PlanarActuatedContext, PlanarWholeLinks
from ..actuation.patches.patches import with_factors as patches_with
from ..actuation.patches.voltages import Voltages, allocation, solve_voltages
from ..actuation.points import with_factors as points_with
from ..common.arrays import Array
from ..common.errors import of_file
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.analysis.replay import ActuatorSet
from ..mbs.model.raised_mass import by_body
from ..mbs.quantities.stiffening import NOTABLE, loads_on_modes
from ..mbs.quantities.validity import bending
from ..scene.kinds import AnyKind
from ..scene.pieces import bodies_in_pieces, places_on_pieces
from ..scene.scene import Scene
from .bent_links import with_advice, worst_of_pieces
from .divided import as_divided
from .enough import completed, is_replayed, log_outcome, progress_of, with_enough_modes, with_enough_pieces
from .evaluation import evaluated
from .finer import check_on, finer_scene
from .mode_choice import mode_levels, reported
from .mode_search import ModeSearch, error_tolerances
from .paths import with_paths
from .pieces import as_one_link, wanted_pieces
from .prepare import prepare, stiffened, with_bodies, with_pieces
from .solution import AnalysisResult, Solution
from .warnings import warnings_of
from .watcher import Interruption, Watcher

Keep = Callable[[Solution], None]


def solve(scene: Scene | Path, watcher: Watcher | None = None, keep: Keep | None = None) -> Solution:
    """Run every analysis of a scene or a scene file; stage 1 runs first for links that are not up to date.

    Shapers for the robot's frequencies and the fastest motion are found first (see `paths`).
    With `modes = "auto"` they are run with more and more modes, until the estimated error meets the tolerances.

    An analysis that does not reach its end is kept as far as it got, and ends the run: see `check_completed`.
    So does Ctrl-C during an analysis. `keep` is given what there is before an error is raised, and before Ctrl-C
    interrupts again.
    Raises `InputError` for anything wrong with the scene or the files it names, `SolveError` where no state is found.
    """
    watcher = watcher or Watcher()
    return run_analyses(prepare(scene, watcher), watcher, keep)


def run_analyses(solution: Solution, watcher: Watcher, keep: Keep | None = None) -> Solution:
    """What `solve` does with everything prepared; analyses go on from where `solution.earlier` has them."""
    with Interruption(watcher.stopping) as interruption:
        solution, path_notes = with_paths(
            solution, lambda trial: _evaluated(_completed(trial, watcher, interruption)), watcher.stage
        )
        if any(body.modes == "auto" for body in solution.scene.body):
            solution = _with_enough_modes(solution, watcher, interruption)
        elif any(body.pieces == "auto" for body in solution.scene.body):
            solution = _with_enough_pieces(solution, watcher, interruption)
        else:
            solution = _completed(solution, watcher, interruption)
        solution = replace(_checked(_evaluated(solution), watcher), path_notes=path_notes)
        if keep is not None and solution.analyses:
            keep(solution)
    if solution.failure is not None:
        raise solution.failure
    return solution


def _evaluated(solution: Solution) -> Solution:
    """The solution with all that follows from its outcomes; without it where finding it fails."""
    results, failure = dict(solution.analyses), solution.failure
    for name, result in results.items():
        try:
            with of_file(solution.scene.path):
                results[name] = _with_peaks(solution, result)
        except Exception as error:
            failure = failure or error
    return replace(solution, analyses=results, failure=failure)


def _with_peaks(solution: Solution, result: AnalysisResult) -> AnalysisResult:
    """The result with all that follows from its outcome; what is judged by peaks, by those between outputs."""
    closer = result.outcome.closer
    is_all = closer is result.outcome
    found = evaluated(solution, told_of_links(solution, result), is_judged=is_all)
    if is_all:
        return found
    voltages = _voltages(solution, closer)
    between = evaluated(solution, told_of_links(solution, replace(result, outcome=closer, voltages=voltages)))
    found = replace(found, feasibility=between.feasibility, closer=between)
    return replace(found, warnings=tuple(warnings_of(solution.scene, found)))


def told_of_links(solution: Solution, result: AnalysisResult) -> AnalysisResult:
    """The result of links in pieces as that of the one link each, and whether links that bend far can be divided."""
    divide = partial(bodies_in_pieces, solution.scene)
    if solution.whole is None:
        return replace(result, bending=with_advice(result.bending, divide))
    outcome = _told(solution, result.outcome)
    bent = with_advice(worst_of_pieces(result.bending, solution.divided), divide)
    voltages = {name: _unmet_of_link(solution, name, of_pieces) for name, of_pieces in result.voltages.items()}
    return replace(result, outcome=outcome, bending=bent, voltages=voltages)


def _unmet_of_link(solution: Solution, name: str, voltages: Voltages) -> Voltages:
    """Voltages with the modal forces that they leave of a link in place of those of its pieces."""
    if name not in solution.divided:
        return voltages
    link = as_divided(solution.bodies[name], solution.divided[name], solution.parts)
    return replace(voltages, unmet=voltages.unmet @ link.spread)


def _checked(solution: Solution, watcher: Watcher) -> Solution:
    """The solution with completed analyses replayed on finer links where the scene asks for that."""
    wanted = [
        name for name, result in solution.analyses.items()
        if result.outcome.analysis.is_checked and result.outcome.status == "completed"
    ]  # fmt: skip
    if not wanted:
        return solution
    results, failure = dict(solution.analyses), solution.failure
    try:
        finer = prepare(finer_scene(solution.scene, solution.bodies), watcher)
        finer = stiffened(finer) if solution.stiffened else finer
        for name in wanted:
            watcher.stage(f'check of "{name}" on finer links')
            check = check_on(results[name].outcome, solution, finer, watcher)
            results[name] = replace(results[name], check=check)
    except Exception as error:
        failure = failure or error
    return replace(solution, analyses=results, failure=failure)


def _with_enough_modes(solution: Solution, watcher: Watcher, interruption: Interruption) -> Solution:
    """The scene solved with as many modes as its tolerances need: see `mode_search`."""
    return with_enough_modes(
        solution,
        ModeSearch(error_tolerances(solution.scene), mode_levels(solution.scene, solution.bodies)),
        lambda last, bodies: _completed(with_bodies(last, bodies), watcher, interruption),
        partial(reported, solution.scene),
        interruption,
    )


def _with_enough_pieces(solution: Solution, watcher: Watcher, interruption: Interruption) -> Solution:
    """The scene solved with links in as many pieces as they bend far, those of `pieces = "auto"`."""
    return with_enough_pieces(
        solution,
        lambda trial: _completed(trial, watcher, interruption),
        lambda last, counts: with_pieces(last, counts, watcher),
        wanted_pieces,
        interruption,
    )


def _completed(solution: Solution, watcher: Watcher, interruption: Interruption) -> Solution:
    return completed(solution, lambda trial: _run_all(trial, watcher, interruption), stiffened)


def _run_all(solution: Solution, watcher: Watcher, interruption: Interruption) -> Solution | None:
    """The analyses up to the first that fails; None where `geometric_stiffening = "auto"` asks for them all again."""
    bodies = solution.parts or solution.bodies
    stiffening = {name: body.planar.stiffening for name, body in bodies.items()}
    links = {name: body.modal for name, body in bodies.items() if body.modal is not None}
    results: dict[str, AnalysisResult] = {}
    for analysis in solution.scene.analysis:
        if interruption.requested and results:
            break
        began = time.perf_counter()
        watcher.stage(f'analysis "{analysis.name}"')
        try:
            with of_file(solution.scene.path):
                outcome = analysis.run(_context(solution, analysis, results, watcher, interruption))
                assert isinstance(outcome, PlanarOutcome)
        except Exception as error:  # raised once the analyses before it are kept
            if not results:
                raise
            return replace(solution, analyses=results, failure=error)
        bent = bending(outcome.closer, links, loads_on_modes(outcome.closer, stiffening), solution.stiffened)
        change = max((of.stiffness_change for of in bent.values()), default=0.0)
        automatic = solution.scene.geometric_stiffening == "auto" and not solution.stiffened
        if automatic and change > NOTABLE and outcome.status != "interrupted":
            return None
        voltages = _voltages(solution, outcome)
        results[analysis.name] = AnalysisResult(outcome, bent, time.perf_counter() - began, voltages)
        log_outcome(outcome)
        if outcome.failed:
            break
    return replace(solution, analyses=results)


def _voltages(solution: Solution, outcome: PlanarOutcome) -> dict[str, Voltages]:
    """Of the patches, by link."""
    if outcome.F_p is None:
        return {}
    return {
        body: solve_voltages(array, outcome.F_p[:, outcome.modal_columns(*array.carriers)])
        for body, array in solution.acting_patches.items()
    }


def _context(
    solution: Solution,
    analysis: AnyKind,
    results: Mapping[str, AnalysisResult],
    watcher: Watcher,
    interruption: Interruption,
) -> PlanarActuatedContext:
    return PlanarActuatedContext(
        model=solution.model,
        outcomes={name: result.outcome for name, result in results.items()},
        make_actuators=lambda raised: _actuator_set(solution, raised=raised),
        progress=progress_of(analysis, watcher, interruption),
        is_replayed=is_replayed(analysis, solution.scene.analysis),
        earlier=solution.earlier.get(analysis.name),
        patches=solution.acting_patches,
        links=solution.links,
        whole=_whole_links(solution),
    )


def _whole_links(solution: Solution) -> PlanarWholeLinks | None:
    """What analyses have to know of the links beside their pieces; None where no link is in pieces."""
    if solution.whole is None:
        return None
    links = {name: as_divided(solution.bodies[name], body, solution.parts) for name, body in solution.divided.items()}
    return PlanarWholeLinks(
        solution.whole, solution.patches, links, places_on_pieces(solution.divided), partial(_told, solution)
    )


def _told(solution: Solution, outcome: PlanarOutcome) -> PlanarOutcome:
    """An outcome of the pieces as that of the links."""
    assert solution.whole is not None
    return as_one_link(outcome, solution.whole, solution.bodies, solution.divided, solution.parts)


def _actuator_set(solution: Solution, *, raised: bool) -> ActuatorSet:
    """The actuators of the scene, fresh for one run."""
    factors: dict[str, Array] = {body.name: np.ones(body.n_modes) for body in solution.model.bodies}
    factors |= by_body(solution.model) if raised else {}
    patches = {
        array.carriers[0]: patches_with(array, np.concatenate([factors[name] for name in array.carriers]))
        for array in solution.acting_patches.values()
    }
    points = {name: points_with(one, factors[name]) for name, one in solution.points.items()}
    return ActuatorSet(
        {name: allocation(array, limited=False) for name, array in patches.items()},
        {name: allocation(array, limited=True) for name, array in patches.items()},
        {name: one.actuator() for name, one in points.items()},
    )
