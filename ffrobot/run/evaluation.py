"""What follows from the motion and forces of the analyses: what patches and motors can do, stresses, placements."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING

from ..actuation.control.linear_analysis import linear_models
from ..actuation.control.placement import Placed, place
from ..actuation.feasibility import Feasibility, MotorFeasibility, judge_motors, judge_patches
from ..actuation.patches.patches import with_patch_count
from ..actuation.points import solve_point_forces
from ..actuation.prediction import predicted_shift, unmet_modal_forces
from ..common.errors import InputError
from ..mbs.analysis.analyses import Outcome
from ..mbs.quantities.observation import modes_of_file
from ..mbs.quantities.stress import BodyStress, body_stress
from ..mbs.scene.control_records import Placement

if TYPE_CHECKING:
    from .solution import Solution

ALLOCATED = ("pcid", "fcid", "static")  # kinds of analysis whose forces patches and actuation points have to meet


def evaluate(solution: Solution) -> None:
    """What follows from the motion and forces of all analyses."""
    for name, outcome in solution.outcomes.items():
        started = time.perf_counter()
        try:
            _judge_actuation(solution, outcome)
            solution.stresses[name] = _stresses(solution, outcome)
        except Exception as error:  # raised once the analyses themselves are kept
            solution.failures.append(error)
        solution.seconds[name] += time.perf_counter() - started


def _judge_actuation(solution: Solution, outcome: Outcome) -> None:
    """What patches and actuation points have to do for what an inverse analysis found, and whether they can."""
    name = outcome.analysis.name
    if outcome.F_p is not None:
        if solution.patches:
            unmet = unmet_modal_forces(outcome, solution.voltages[name])
            solution.predicted_shift[name] = predicted_shift(outcome, unmet)
        solution.feasibility[name] = _judge(solution, outcome)
    elif outcome.inversion is not None:
        solution.feasibility[name] = Feasibility(_judge_motors(solution, outcome), {})
    if outcome.analysis.kind in ALLOCATED and any(outcome.assembly.is_trajectory):
        solution.point_forces[name] = {
            body: solve_point_forces(points, outcome) for body, points in solution.points.items()
        }


def _judge(solution: Solution, outcome: Outcome) -> Feasibility:
    """Whether motors and patches can do what an inverse analysis found."""
    scene, name = solution.scene, outcome.analysis.name
    patches = {}
    for body, array in solution.patches.items():
        loaded = solution.bodies[body]
        assert loaded.modal is not None
        trial = partial(with_patch_count, scene.path, array.layout, loaded.modal, loaded.planar)
        patches[body] = judge_patches(array, solution.voltages[name][body], outcome, trial)
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


def place_patches(solution: Solution, wanted: Placement, outcome: Outcome) -> Placed:
    """The best places for the patches of one body, about `outcome` or over the path that it stands on."""
    path, loaded = solution.scene.path, solution.bodies[wanted.body]
    assert loaded.modal is not None
    model, F_p = None, None
    if wanted.criterion == "voltage":
        source = solution.outcomes[str(outcome.analysis.source)]
        if source.F_p is None:
            raise InputError(
                f'{path}: analysis "{outcome.analysis.name}": placement.criterion: expected motors that fit the'
                f' mechanism for "voltage", found {len(solution.model.motors)} for {solution.model.degrees_of_freedom}'
            )
        F_p = source.F_p[:, source.modal_columns(wanted.body)]
    else:
        (model,) = linear_models(outcome, {})
    layout = solution.patches[wanted.body].layout
    return place(path, wanted, layout, loaded.modal, loaded.planar, model, F_p)
