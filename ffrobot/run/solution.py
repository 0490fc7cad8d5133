"""Stage 2 from a scene file: bodies, model, analyses."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..actuation.control.closed_loop import LoopRecord, run_closed_loop
from ..actuation.control.linear_analysis import LinearAnalysis, analyse, linear_models
from ..actuation.control.placement import Placed
from ..actuation.feasibility import Feasibility
from ..actuation.patches.patches import PatchArray, check_reach, patch_array
from ..actuation.patches.patches import with_factors as on_patches
from ..actuation.patches.structure import StructureEffect
from ..actuation.patches.voltages import Voltages, allocation, solve_voltages
from ..actuation.points import PointForces, PointSet, point_set, with_points
from ..actuation.points import with_factors as on_points
from ..common.arrays import Array
from ..common.errors import InputError
from ..mbs.analysis.analyses import Outcome, run_forward, run_pcid, run_static
from ..mbs.analysis.earlier_run import EarlierRun
from ..mbs.analysis.elastic_joints import add_transmission
from ..mbs.analysis.fcid import run_fcid
from ..mbs.analysis.motors_only import run_motors_only
from ..mbs.analysis.operating_points import operating_points
from ..mbs.analysis.replay import ActuatorSet
from ..mbs.model.model import ModalLoad, Model, build_model
from ..mbs.model.planar_body import PlanarBody
from ..mbs.model.raised_mass import mass_factors
from ..mbs.quantities.stiffening import NOTABLE, estimated_effect
from ..mbs.quantities.stress import BodyStress
from ..mbs.scene.analysis_records import Analysis
from ..mbs.scene.load import load_scene
from ..mbs.scene.scene import Scene
from .bodies import LoadedBody, add_patches, load_bodies
from .evaluation import ALLOCATED, evaluate, place_patches
from .interruption import Interruption
from .mode_choice import ErrorEstimate, ModeChoice, error_tolerances, reported, truncation_levels
from .omissions import skipped as skipped_lines

logger = logging.getLogger(__name__)


class Watcher:
    """Is told how a solve goes; the command line shows it, a library user need not care."""

    def stage(self, title: str) -> None:
        """Something that may take long begins."""

    def advance(self, t: float, end: float) -> bool:
        """An analysis has reached time t of `end`; False stops it."""
        return True


@dataclass(frozen=True)
class Solution:
    """Everything a solve computed.

    Attributes:
        structure: what patches that are part of their link change of it, by body.
        outcomes: by analysis, in the order of the scene.
        voltages: by analysis and body.
        point_forces: likewise.
        predicted_shift: by analysis and point, (T, 2) m: what voltages within their limits leave undone.
        feasibility: by analysis.
        loops: what happened at the samples, by analysis of kind "closed-loop".
        linear: linear models, by analysis; placements: of patches, likewise.
        stresses: by analysis and body, where modal body files hold modal stresses.
        seconds: wall time by stage.
        mode_choice: where `modes = "auto"`.
        stiffened: whether geometric stiffening is in the equations.
        stiffening_effects: by analysis, the largest relative change of a mode's stiffness by the loads of the run.
        skipped: what the scene did not need, one line each.
        earlier: runs of analyses to go on with, from a results file: see `resume`.
    """

    scene: Scene
    model: Model
    bodies: Mapping[str, LoadedBody]
    patches: Mapping[str, PatchArray]
    points: Mapping[str, PointSet] = field(default_factory=dict)
    structure: Mapping[str, StructureEffect] = field(default_factory=dict)
    outcomes: dict[str, Outcome] = field(default_factory=dict)
    voltages: dict[str, dict[str, Voltages]] = field(default_factory=dict)
    point_forces: dict[str, dict[str, PointForces]] = field(default_factory=dict)
    predicted_shift: dict[str, dict[str, Array]] = field(default_factory=dict)
    feasibility: dict[str, Feasibility] = field(default_factory=dict)
    loops: dict[str, LoopRecord] = field(default_factory=dict)
    stresses: dict[str, dict[str, BodyStress]] = field(default_factory=dict)
    linear: dict[str, LinearAnalysis] = field(default_factory=dict)
    placements: dict[str, Placed] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    skipped: tuple[str, ...] = ()
    mode_choice: ModeChoice | None = None
    stiffened: bool = False
    stiffening_effects: dict[str, float] = field(default_factory=dict)
    earlier: Mapping[str, EarlierRun] = field(default_factory=dict)


def solve(scene: Scene | Path, watcher: Watcher | None = None) -> Solution:
    """Run every analysis of a scene or a scene file; stage 1 runs first for links that are not up to date.

    With `modes = "auto"` they are run with more and more modes, until the estimated error meets the tolerances.

    An analysis that does not reach its end is kept as far as it got, and ends the run: see `Outcome.check_completed`.
    So does Ctrl-C during an analysis.
    Raises `InputError` for anything wrong with the scene or the files it names, `SolveError` where no state is found.
    """
    watcher = watcher or Watcher()
    return run_analyses(prepare(scene, watcher), watcher)


def run_analyses(solution: Solution, watcher: Watcher) -> Solution:
    """What `solve` does with everything prepared; analyses go on from where `solution.earlier` has them."""
    with Interruption() as interruption:
        if any(body.modes == "auto" for body in solution.scene.body):
            solution = _with_enough_modes(solution, watcher, interruption)
        else:
            solution = _completed(solution, watcher, interruption)
    evaluate(solution)
    return solution


def _with_enough_modes(solution: Solution, watcher: Watcher, interruption: Interruption) -> Solution:
    """The scene solved with as many modes as its tolerances need: see `mode_choice`."""
    began = time.perf_counter()
    tolerances = error_tolerances(solution.scene)
    every = truncation_levels(solution.scene, _whole(solution.bodies))
    estimate, tried, k = ErrorEstimate(), [], 0
    while True:
        last = time.perf_counter()
        solution = _completed(_with_bodies(solution, every[k]), watcher, interruption)
        tried.append(sum(body.n_modes for body in every[k].values()))
        completed = all(outcome.status == "completed" for outcome in solution.outcomes.values())
        if completed:
            estimate.add({name: reported(solution, name) for name in solution.outcomes})
        more = len(every) - 1 - k
        if not more or interruption.requested or (completed and estimate.meets(tolerances)):
            break
        k = len(every) - 1 if not completed or estimate.is_hopeless(tolerances, more - 1) else k + 1
    errors = estimate.errors if completed else {}
    if not more:
        errors = {name: dict.fromkeys(of, 0.0) for name, of in errors.items()}
    highest = [
        max(float(np.sqrt(b.stiffness.max(initial=0.0))) for b in level.values()) for level in (every[k], every[-1])
    ]
    choice = ModeChoice(errors, estimate.differences, tried, last - began, (highest[0], highest[1]))
    return replace(solution, mode_choice=choice)


def _whole(bodies: Mapping[str, LoadedBody]) -> dict[str, PlanarBody]:
    """The planar bodies with all their modes."""
    return {n: b.planar if b.planar.reduction is None else b.planar.reduction.whole for n, b in bodies.items()}


def _with_bodies(solution: Solution, planar: Mapping[str, PlanarBody]) -> Solution:
    """The scene with some of its bodies replaced, nothing solved yet."""
    bodies = {name: replace(b, planar=planar.get(name, b.planar)) for name, b in solution.bodies.items()}
    return _assembled(solution.scene, bodies, solution.structure, dict(solution.seconds), solution.stiffened)


def _completed(solution: Solution, watcher: Watcher, interruption: Interruption) -> Solution:
    """All analyses run, all of them stiffened where `geometric_stiffening = "auto"` asks for that."""
    if not _run_all(solution, watcher, interruption):
        solution = stiffened(solution)
        _run_all(solution, watcher, interruption)
    return solution


def stiffened(solution: Solution) -> Solution:
    """The scene with geometric stiffening, nothing solved yet."""
    return _assembled(solution.scene, solution.bodies, solution.structure, solution.seconds, stiffened=True)


def _run_all(solution: Solution, watcher: Watcher, interruption: Interruption) -> bool:
    """Run the analyses; False where `geometric_stiffening = "auto"` asks for all of them again, stiffened."""
    stiffening = {name: body.planar.stiffening for name, body in solution.bodies.items()}
    for analysis in solution.scene.analysis:
        started = time.perf_counter()
        outcome = _run(solution, analysis, watcher, interruption)
        effect = estimated_effect(outcome, stiffening)
        automatic = solution.scene.geometric_stiffening == "auto" and not solution.stiffened
        if automatic and effect > NOTABLE and outcome.status != "interrupted":
            return False
        solution.stiffening_effects[analysis.name] = effect
        solution.outcomes[analysis.name] = outcome
        if outcome.F_p is not None:
            solution.voltages[analysis.name] = {
                body: solve_voltages(array, outcome.F_p[:, outcome.modal_columns(body)])
                for body, array in solution.patches.items()
            }
        if analysis.kind == "linear":
            solution.linear[analysis.name] = analyse(linear_models(outcome, solution.patches))
        if analysis.placement is not None:
            solution.placements[analysis.name] = place_patches(solution, analysis.placement, outcome)
        solution.seconds[analysis.name] = time.perf_counter() - started
        _log(outcome)
        if outcome.failed:
            break
    return True


def _log(outcome: Outcome) -> None:
    logger.info(
        'analysis "%s": %s at t = %g s, %d steps, %d rejected, %d evaluations, %.3f s; integrator %s: %s',
        outcome.analysis.name, outcome.status, outcome.time[-1], outcome.steps, outcome.rejected, outcome.evaluations,
        outcome.wall_seconds, outcome.integrator.name, outcome.integrator.reason,
    )  # fmt: skip


def prepare(scene: Scene | Path, watcher: Watcher | None = None) -> Solution:
    """Everything of a scene but its analyses: bodies, patches, model. Raises `InputError` as `solve` does."""
    watcher = watcher or Watcher()
    began = time.perf_counter()
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    bodies = {body.name: loaded for body, loaded in zip(scene.body, load_bodies(scene, watcher.stage), strict=True)}
    seconds = {"links and files": time.perf_counter() - began}
    structure = add_patches(scene, bodies)
    first = truncation_levels(scene, _whole(bodies))[0]
    bodies = {name: replace(body, planar=first.get(name, body.planar)) for name, body in bodies.items()}
    return _assembled(scene, bodies, structure, seconds, stiffened=scene.geometric_stiffening is True)


def _assembled(
    scene: Scene,
    bodies: Mapping[str, LoadedBody],
    structure: Mapping[str, StructureEffect],
    seconds: dict[str, float],
    stiffened: bool,
) -> Solution:
    """The equations of a scene, with or without geometric stiffening."""
    _check_stiffening(scene, bodies, stiffened)
    patches = {
        layout.body: patch_array(scene.path, layout, modal, bodies[layout.body].planar)
        for layout in scene.pzt
        if (modal := bodies[layout.body].modal) is not None
    }
    if any(analysis.kind in ALLOCATED for analysis in scene.analysis) and scene.trajectory:
        for array in patches.values():
            check_reach(scene.path, array)
    points = {
        layout.body: point_set(scene.path, layout, bodies[layout.body].modal, bodies[layout.body].planar)
        for layout in scene.actuation_points
    }
    bodies = {
        name: replace(body, planar=with_points(body.planar, points[name])) if name in points else body
        for name, body in bodies.items()
    }
    planar = [body.planar if stiffened else replace(body.planar, stiffening=None) for body in bodies.values()]
    model = build_model(scene, planar, _voltage_loads(scene, patches))
    skipped = tuple(skipped_lines(scene, bodies))
    return Solution(
        scene, model, bodies, patches, points, structure, seconds=seconds, skipped=skipped, stiffened=stiffened
    )


def _check_stiffening(scene: Scene, bodies: Mapping[str, LoadedBody], stiffened: bool) -> None:
    """Raise `InputError` for a stiffened body whose file does not say how."""
    for name, body in bodies.items():
        if stiffened and body.modal is not None and body.planar.stiffening is None:
            raise InputError(
                f"{scene.path}: geometric_stiffening: expected modal bodies with geometric stiffness, found none in"
                f' that of "{name}"'
            )


def _run(solution: Solution, analysis: Analysis, watcher: Watcher, interruption: Interruption) -> Outcome:
    model, end, earlier = solution.model, analysis.end, solution.earlier.get(analysis.name)
    watcher.stage(f'analysis "{analysis.name}"')

    def progress(t: float) -> bool:
        return watcher.advance(t, end) and not interruption.requested

    if analysis.kind in ("linear", "placement"):
        return operating_points(model, analysis, solution.outcomes[analysis.source] if analysis.source else None)
    if analysis.kind == "static":
        return add_transmission(run_static(model, analysis))
    if analysis.kind == "fcid":
        return add_transmission(run_fcid(model, analysis))
    if analysis.kind == "motors-only":
        return add_transmission(run_motors_only(model, analysis, progress))
    if analysis.kind == "pcid":
        replayed = any(later.actuation == analysis.name for later in solution.scene.analysis)
        return add_transmission(run_pcid(model, analysis, replayed, progress, earlier))
    source = solution.outcomes[analysis.actuation] if analysis.actuation else None
    if analysis.kind == "closed-loop":
        assert source is not None
        outcome, loop = run_closed_loop(model, analysis, source, solution.patches, progress)
        solution.loops[analysis.name] = loop
        return outcome
    prescribed = source is not None and source.shape is not None
    return run_forward(model, analysis, source, _actuator_set(solution, raised=not prescribed), progress, earlier)


def _actuator_set(solution: Solution, *, raised: bool) -> ActuatorSet:
    """The actuators of the scene, fresh for one run; in coordinates with raised masses where these are integrated."""
    factors = {body.name: np.sqrt(mass_factors(body)) if raised else np.ones(1) for body in solution.model.bodies}
    patches = {name: on_patches(array, factors[name]) for name, array in solution.patches.items()}
    points = {name: on_points(one, factors[name]) for name, one in solution.points.items()}
    return ActuatorSet(
        {name: allocation(array, limited=False) for name, array in patches.items()},
        {name: allocation(array, limited=True) for name, array in patches.items()},
        {name: one.actuator() for name, one in points.items()},
    )


def _voltage_loads(scene: Scene, patches: Mapping[str, PatchArray]) -> list[ModalLoad]:
    return [
        ModalLoad(load.pzt, patches[load.pzt].Phi_V[:, k], function)
        for load in scene.load
        if load.pzt is not None
        for k, function in enumerate(load.components.values())
    ]
