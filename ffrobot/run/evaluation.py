"""What follows from the motion and forces of an analysis: what patches and motors can do, stresses."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from ..actuation.feasibility import Feasibility, ModalMotion, judge_patches
from ..actuation.motors import MotorFeasibility, judge_motors
from ..actuation.patches.composite import Placed, section_loads
from ..actuation.patches.patches import with_patch_count
from ..actuation.patches.voltages import voltage_gain
from ..actuation.points import PointForces, solve_point_forces
from ..actuation.prediction import predicted_shift, unmet_modal_forces, unsupplied
from ..actuation.unsupplied import Unsupplied
from ..common.arrays import Array
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.quantities.attachment_error import mode_error, modes_in_motion, start_jolt, start_of
from ..mbs.quantities.link_loads import LinkLoads, link_loads
from ..mbs.quantities.observation import modes_of_file
from ..mbs.quantities.stress import (
    BodyStress,
    SectionLoads,
    body_stress,
    has_stresses,
    mode_acceleration,
    mode_displacement,
)
from .solution import AnalysisResult, Solution
from .spatial_actuation import FORCES_AT_POINTS
from .warnings import warnings_of

ROUNDING = 1e-6  # of the largest modal force: less is what ill-conditioned patches leave


def evaluated(solution: Solution, result: AnalysisResult, *, is_judged: bool = True) -> AnalysisResult:
    """The result with all that follows from its outcome; what motors and patches can do only where it `is_judged`."""
    began, outcome = time.perf_counter(), result.outcome
    shift, unsupplied = _unmet(solution, result)
    # modes know nothing of those that are not there
    is_resolved = outcome.analysis.is_integrated and not any(body.rigid_in for body in solution.bodies.values())
    feasibility = _feasibility(solution, result) if is_judged else None
    result = replace(
        result,
        point_forces=_point_forces(solution, outcome),
        predicted_shift=shift,
        feasibility=feasibility and replace(feasibility, unsupplied=unsupplied),
        stresses=_stresses(solution, outcome),
        mode_error=mode_error(modes_in_motion(outcome.computed)) if is_resolved else None,
        start_jolt=start_jolt(start_of(outcome.computed)) if outcome.analysis.is_integrated else 0.0,
    )
    result = replace(result, warnings=tuple(warnings_of(solution.scene, result)))
    return replace(result, seconds=result.seconds + time.perf_counter() - began)


def _point_forces(solution: Solution, outcome: PlanarOutcome) -> dict[str, PointForces]:
    if not (outcome.analysis.allocates_patches and any(outcome.assembly.is_trajectory)):
        return {}
    return {body: solve_point_forces(points, outcome) for body, points in solution.points.items()}


def _unmet(solution: Solution, result: AnalysisResult) -> tuple[dict[str, Array], Unsupplied | None]:
    """What modal forces that patches leave undone do to points; empty where none are left."""
    outcome = result.outcome
    if outcome.F_p is None:
        return {}, None
    unmet = unmet_modal_forces(outcome, result.voltages)
    lacking = tuple(_without_means(solution, result))
    if not (solution.patches or lacking):
        return {}, None
    shift = predicted_shift(outcome, unmet)
    with_patches = bool(solution.patches)
    found = unsupplied(outcome, unmet, shift, lacking, with_patches=with_patches) if lacking else None
    if found is not None and found.angles_kept <= outcome.analysis.tolerance * outcome.assembly.system.length:
        found = None
    return (shift if with_patches or found else {}), found


def _without_means(solution: Solution, result: AnalysisResult) -> Iterator[str]:
    """Bodies of whose modal forces something is left without any limit on voltages."""
    outcome, F_p = result.outcome, result.outcome.F_p
    analyses = (other for other in solution.scene.analysis if other.source == outcome.analysis.name)
    if F_p is None or any(getattr(other, "apply", None) in FORCES_AT_POINTS for other in analyses):
        return
    for body in outcome.assembly.model.links:
        needed = F_p[:, outcome.modal_columns(body.name)]
        if body.name in solution.patches:
            patches = solution.patches[body.name]
            needed = (needed - result.voltages[body.name].required @ patches.Phi_V.T)[:, : patches.served]
        if body.name not in solution.points and np.abs(needed).max(initial=0.0) > ROUNDING * np.abs(F_p).max(
            initial=0.0
        ):
            yield body.name


def _feasibility(solution: Solution, result: AnalysisResult) -> Feasibility | None:
    """Whether motors and patches can do what an inverse analysis or an equilibrium found."""
    outcome = result.outcome
    if outcome.F_p is None:
        found = outcome.analysis.applicable and outcome.tau is not None
        return Feasibility(_judge_motors(solution, outcome), {}) if found else None
    patches = {}
    for body, array in solution.patches.items():
        loaded = solution.bodies[body]
        assert loaded.modal is not None
        counts = partial(with_patch_count, solution.scene.path, array.layout, loaded.modal, loaded.planar)
        p = outcome.q[:, outcome.coordinates(body)][:, 3:]
        motion = ModalMotion(outcome.time, p, outcome.F_p[:, outcome.modal_columns(body)])
        patches[body] = judge_patches(
            array, result.voltages[body], motion, None if outcome.analysis.is_repeated else counts
        )
    return Feasibility(_judge_motors(solution, outcome), patches)


def _judge_motors(solution: Solution, outcome: PlanarOutcome) -> dict[str, MotorFeasibility]:
    return judge_motors(outcome, {joint.name: joint for joint in solution.scene.joint})


def _stresses(solution: Solution, outcome: PlanarOutcome) -> dict[str, BodyStress]:
    """Of the bodies whose files hold modal stresses; by mode acceleration where files and loads allow it."""
    links = {name: link for name, link in solution.links.items() if has_stresses(link)}
    known = [name for name, link in links.items() if link.stress_loads]
    loads = link_loads(outcome, known) if known else {}
    found = {}
    for name, link in links.items():
        planar = solution.bodies[name].planar
        p = modes_of_file(outcome, planar)
        if name not in loads:
            found[name] = body_stress(link, mode_displacement(p))
            continue
        sections = _sections(solution, name, p, loads[name])
        recovery = mode_acceleration(link, planar.modal_transform, p, loads[name].sizes, sections)
        found[name] = body_stress(link, recovery)
    return found


def _sections(solution: Solution, body: str, p: Array, loads: LinkLoads) -> SectionLoads | None:
    """What the patches of a body, of file coordinates p (T, n), do to its sections, where they are part of it."""
    patches = solution.patches.get(body)
    if patches is None or not patches.layout.adds_stiffness or not np.isfinite(patches.authority).all():
        return None
    voltages = loads.modal_force @ voltage_gain(patches).T
    return section_loads(Placed(patches.layout, patches.edges), solution.links[body], p, voltages)
