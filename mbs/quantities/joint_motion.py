"""Coordinates of the joints, and of motors behind gears that give, over time."""

from __future__ import annotations

from dataclasses import dataclass

from ...common.arrays import Array
from .. import _core
from ..analysis.planar_outcome import PlanarOutcome
from ..model.system import MechanismSystem


@dataclass(frozen=True)
class JointMotion:
    """γ of the second side of a joint on the first, one row per output; angles count turns."""

    coordinate: Array  # (T,) rad, or m where prismatic
    rate: Array  # (T,) rad/s, or m/s


def joint_motions(outcome: PlanarOutcome) -> dict[str, JointMotion]:
    """Of all joints that move, by name: between sections or between frames, as `motors` of the scene says.

    Of links in pieces, between their sections as they were computed.
    """
    outcome = outcome.computed
    model = outcome.assembly.model
    measures = {joint.name: joint.coordinate(model.scene.motors) for joint in model.scene.joint}
    moving = {name: measure for name, measure in measures.items() if measure is not None}
    assembly = MechanismSystem(model, model.joints, (), list(moving.values()))
    along = [(measure, order) for measure in assembly.motor_measures for order in (0, 1)]
    readings = _core.Sensing(assembly.system, along, []).read(outcome.q, outcome.v, outcome.a)
    return {name: JointMotion(*readings[:, 2 * k : 2 * k + 2].T.copy()) for k, name in enumerate(moving)}


def motor_motion(outcome: PlanarOutcome, joint: str) -> JointMotion | None:
    """θ_m of the motor of a joint whose gear gives, behind the gear; None of others, which move as their joint does."""
    if joint in outcome.gears:
        return JointMotion(outcome.gears[joint].angle, outcome.gears[joint].rate)
    model = outcome.assembly.model
    rows = [gear.motor for gear in model.gears if gear.joint == joint]
    if not rows:
        return None
    assembly = MechanismSystem(model, model.joints, (), rows)
    along = [(assembly.motor_measures[0], order) for order in (0, 1)]
    return JointMotion(*_core.Sensing(assembly.system, along, []).read(outcome.q, outcome.v, outcome.a).T.copy())
