"""What follows from the motion and forces of an analysis: what patches and motors can do, stresses."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

from ..actuation.feasibility import Feasibility, MotorFeasibility, judge_motors, judge_patches
from ..actuation.patches.patches import with_patch_count
from ..actuation.points import PointForces, solve_point_forces
from ..actuation.prediction import predicted_shift, unmet_modal_forces
from ..common.arrays import Array
from ..mbs.analysis.outcome import Outcome
from ..mbs.quantities.observation import modes_of_file
from ..mbs.quantities.stress import BodyStress, body_stress
from .solution import AnalysisResult, Solution


def evaluated(solution: Solution, result: AnalysisResult) -> AnalysisResult:
    """The result with all that follows from its outcome."""
    began, outcome = time.perf_counter(), result.outcome
    result = replace(
        result,
        point_forces=_point_forces(solution, outcome),
        predicted_shift=_predicted_shift(solution, result),
        feasibility=_feasibility(solution, result),
        stresses=_stresses(solution, outcome),
    )
    return replace(result, seconds=result.seconds + time.perf_counter() - began)


def _point_forces(solution: Solution, outcome: Outcome) -> dict[str, PointForces]:
    if not (outcome.analysis.allocates_patches and any(outcome.assembly.is_trajectory)):
        return {}
    return {body: solve_point_forces(points, outcome) for body, points in solution.points.items()}


def _predicted_shift(solution: Solution, result: AnalysisResult) -> dict[str, Array]:
    if result.outcome.F_p is None or not solution.patches:
        return {}
    return predicted_shift(result.outcome, unmet_modal_forces(result.outcome, result.voltages))


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
        trial = partial(with_patch_count, solution.scene.path, array.layout, loaded.modal, loaded.planar)
        patches[body] = judge_patches(array, result.voltages[body], outcome, trial)
    return Feasibility(_judge_motors(solution, outcome), patches)


def _judge_motors(solution: Solution, outcome: Outcome) -> dict[str, MotorFeasibility]:
    return judge_motors(outcome, {joint.name: joint for joint in solution.scene.joint})


def _stresses(solution: Solution, outcome: Outcome) -> dict[str, BodyStress]:
    """Of the bodies whose files hold modal stresses."""
    found = {
        name: body_stress(body.modal, modes_of_file(outcome, body.planar))
        for name, body in solution.bodies.items()
        if body.modal is not None
    }
    return {name: stress for name, stress in found.items() if stress is not None}
