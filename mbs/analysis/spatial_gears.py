"""Gears that give in space: what motors must do behind them for a motion found with rigid ones.

The equations are those of the plane (`elastic_joints`), with the rotor's acceleration about its axis in space.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..model.spatial_gears import elastic_joints
from ..model.spatial_known_motion import States, rotor_torques
from ..model.spatial_model import SpatialModel
from ..model.spatial_transmission import compliance, rotor
from .elastic_joints import GearSpring, gear_motion
from .outcome import GearMotion, Outcome
from .spatial_replay import motor_forces_of


def gears_of_motion(
    model: SpatialModel, state: States, time: Array, moments: Mapping[str, Array]
) -> dict[str, GearMotion]:
    """By joint with a gear that gives, where `model` takes it for rigid: see `elastic_joints.add_transmission`.

    `moments` (T, 1) by joint are what motors supply in the motion `state` at `time` (T,).
    Raises `InputError` for such a joint without a motor, or with a load.
    """
    if model.tree.gears:
        return {}
    elastic = elastic_joints(model)
    for load in model.scene.load:
        if any(load.joint == node.joint.name for node in elastic):
            raise InputError(
                f"{model.scene.path}: expected no [[load]] on joints with stiffness in inverse analyses and"
                f' equilibria, found one on "{load.joint}"'
            )
    torques, found = rotor_torques(model, state, time) if elastic else np.zeros((0, 0)), {}
    for node in elastic:
        of_gear, (inertia, N) = compliance(node) or (0.0, 0.0), rotor(node)
        sign, torque = -1.0 if node.backwards else 1.0, torques[:, model.tree.index[node.body.name]]
        of_joint = ((state.q, node.q), (state.v, node.v), (state.a, node.v))
        gamma = sign * np.column_stack([values[:, part.start] for values, part in of_joint])
        where = f'{model.scene.path}: joint "{node.joint.name}"'
        spring = GearSpring(*of_gear, inertia * N**2, where)
        found[node.joint.name] = gear_motion(spring, time, moments[node.joint.name][:, 0], N * torque, gamma)
    return found


class WoundUp(NamedTuple):
    """A motion in the coordinates of a robot whose gears give.

    Attributes:
        q, v, a: (T, n_q), (T, n_v), (T, n_v).
        gears: by joint, those that are firm in the motion; none where they give in it, too.
    """

    q: Array
    v: Array
    a: Array
    gears: Mapping[str, GearMotion]


def wound_up(run: Outcome, model: SpatialModel) -> WoundUp:
    """The motion of `run` in the coordinates of `model`: where its gears give, motors as far ahead as they have to be.

    Raises `InputError` where motors turn frames: what a gear carries then is not along its joint alone.
    """
    if not model.tree.gears or run.model.tree.gears:
        return WoundUp(run.q, run.v, run.a, {})
    if model.scene.motors == "frame":
        raise InputError(
            f'{model.scene.path}: motors: expected "section" where joints with stiffness are driven, controlled or'
            ' linear, found "frame"'
        )
    gears = gears_of_motion(run.model, run, run.time, motor_forces_of(run).moments)
    q, v, a = with_motors(model, (run.q, run.v, run.a), gears)
    return WoundUp(q, v, a, gears)


def with_motors(model: SpatialModel, firm: Sequence[Array], gears: Mapping[str, GearMotion]) -> list[Array]:
    """Q, v, a (T, …) of `model`, whose gears give, from those of a robot with `firm` gears, and of its motors."""
    known = [gears[gear.joint.joint.name] for gear in model.tree.gears]
    more = (np.column_stack([getattr(of, order) for of in known]) for order in ("angle", "rate", "acceleration"))
    return [np.hstack(pair) for pair in zip(firm, more, strict=True)]
