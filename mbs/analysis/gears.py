"""Compliant gears in 3D: what motors must do behind them for a motion found with rigid ones.

The equations are those of `elastic_joints`, with the rotor's acceleration about its axis in space.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ..joints.twist_spring import TwistSpring
from ..model.frame_motors import turning_motors
from ..model.gears import elastic_joints, with_compliance
from ..model.known_motion import KnownStates, States, required_forces, rotor_torques
from ..model.model import Model
from ..model.motors import MotorForces, motor_forces
from ..model.transmission import compliance, rotor
from ..model.tree import Node
from .elastic_joints import GearSpring, gear_motion
from .outcome import GearMotion, Outcome
from .replay import supplied_in

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

REPEATS = 1e-12  # of what bodies feel of twists: a change that no longer counts
CONTRACTS = 0.5  # of one change the next one at most, where rotors on outer bodies feel their own twist, or it is noise


class Supplied(NamedTuple):
    """What motors and modes supply in a motion of the links: see `supplied_through_gears`.

    Attributes:
        forces: τ, of motors in front of compliant gears, and F_p.
        gears: by joint with such a gear.
    """

    forces: MotorForces
    gears: Mapping[str, GearMotion]


def supplied_through_gears(
    model: Model,
    state: States,
    time: Array,
    wanted: Array,
    twists: Mapping[str, BSpline] | None = None,
) -> Supplied:
    """What carries the motion `state` at `time` (T,), for which rigid gears need `wanted` (T, n_v).

    Compliant gears let their rotors turn by N δ more. Then the rotor needs J N² δ̈ of its motor (`elastic_joints`), and
    the body that carries it, which turns with Ω_a, the moment J N (δ̈ z + δ̇ Ω_a × z): the rate of J N δ̇ z. That is
    shared among motors and modes as all else. Moments in front of one gear contain what others add: all follow again,
    gear by gear inwards, and until they repeat. `twists`: δ(t) by joint where they are known.

    Raises `InputError` for such a joint without a motor, or with a load.
    """
    felt = np.zeros_like(wanted)
    elastic = [] if model.tree.gears else elastic_joints(model)
    if not elastic:
        return Supplied(motor_forces(model, state.q, wanted), {})
    _refuse_loads(model, elastic)
    compliant, torques = with_compliance(model), rotor_torques(model, state, time)
    rigid = required_forces(compliant, _in_motor_coordinates(compliant, state, None), time)
    change = np.inf
    for passes in count(1):
        forces = motor_forces(model, state.q, wanted + felt)
        gears = {
            node.joint.name: _gear(
                model, state, time, node, torques[:, model.tree.index[node.body.name]], forces, twists
            )
            for node in elastic
        }
        needed = required_forces(compliant, _in_motor_coordinates(compliant, state, gears), time) - rigid
        before, felt = felt, needed[:, : felt.shape[1]]
        for gear in compliant.tree.gears:  # but for what their springs do along their own joints
            of = gears[gear.joint.joint.name].twist
            felt[:, gear.joint.v.start] += gear.sign * (gear.spring.moment(of[:, 0]) + gear.damping * of[:, 1])
        change, last = float(np.abs(felt - before).max(initial=0.0)), change
        if change <= REPEATS * float(np.abs(felt).max(initial=0.0)):
            break
        if passes > len(elastic) and change > CONTRACTS * last:
            break
    moments = {**forces.moments, **{joint: gear.moment[:, None] for joint, gear in gears.items()}}
    return Supplied(replace(forces, moments=moments), gears)


def _refuse_loads(model: Model, elastic: Sequence[Node]) -> None:
    for load in model.scene.load:
        if any(load.joint == node.joint.name for node in elastic):
            raise InputError(
                f"{model.scene.path}: expected no [[load]] on joints with stiffness in inverse analyses and"
                f' equilibria, found one on "{load.joint}"'
            )


def _gear(
    model: Model,
    state: States,
    time: Array,
    node: Node,
    torque: Array,
    forces: MotorForces,
    twists: Mapping[str, BSpline] | None,
) -> GearMotion:
    """Of the gear in the joint of `node`, whose rotor takes `torque` (T,), J u̇, where it is rigid."""
    joint, (inertia, N) = node.joint.name, rotor(node)
    where = f'{model.scene.path}: joint "{joint}"'
    spring = GearSpring(*(compliance(node) or (TwistSpring((np.inf,)), 0.0)), inertia * N**2, where)
    curve = None if twists is None else twists[joint]
    return gear_motion(spring, time, forces.moments[joint][:, 0], N * torque, _along(node, state), curve)


def _along(node: Node, state: States) -> Array:
    """γ, its rate and acceleration (T, 3), of the joint as the scene has it."""
    of_joint = ((state.q, node.q), (state.v, node.v), (state.a, node.v))
    columns = np.column_stack([values[:, part.start] for values, part in of_joint])
    return -columns if node.backwards else columns


def _in_motor_coordinates(compliant: Model, state: States, gears: Mapping[str, GearMotion] | None) -> KnownStates:
    """The motion of links with motors as far ahead as `gears` say, or not at all."""
    if gears is not None:
        return KnownStates(*with_motors(compliant, (state.q, state.v, state.a), gears))
    motors = np.array([_along(gear.joint, state) for gear in compliant.tree.gears]).transpose(2, 1, 0)
    return KnownStates(*(np.hstack(pair) for pair in zip((state.q, state.v, state.a), motors, strict=True)))


class MotorCoordinates(NamedTuple):
    """A motion in the coordinates of a robot whose gears give.

    Attributes:
        q, v, a: (T, n_q), (T, n_v), (T, n_v).
        gears: by joint, those that are rigid in the motion; none where they give in it, too.
        moments: (T, k) by joint, of all motors where gears are rigid in the motion.
    """

    q: Array
    v: Array
    a: Array
    gears: Mapping[str, GearMotion]
    moments: Mapping[str, Array]


def with_motor_coordinates(run: Outcome, model: Model) -> MotorCoordinates:
    """The motion of `run` in the coordinates of `model`: where its gears give, motors as far ahead as they have to be.

    Raises `InputError` where motors turn frames and modes tilt the joint's axis: no angle goes with their moments.
    """
    if not model.tree.gears or run.model.tree.gears:
        return MotorCoordinates(run.q, run.v, run.a, {}, {})
    turning = set(turning_motors(run.model)).intersection(gear.joint.joint.name for gear in model.tree.gears)
    if turning:
        raise InputError(
            f'{model.scene.path}: motors: expected "section" where joints with stiffness are driven, controlled or'
            f" linear and modes tilt the joint's axis ({quoted(sorted(turning))}),"
            ' found "frame"'
        )
    forces, gears = supplied_through_gears(run.model, run, run.time, supplied_in(run))
    q, v, a = with_motors(model, (run.q, run.v, run.a), gears)
    return MotorCoordinates(q, v, a, gears, forces.moments)


def with_motors(model: Model, rigid: Sequence[Array], gears: Mapping[str, GearMotion]) -> list[Array]:
    """Q, v, a (T, …) of `model`, whose gears give, from those of a robot with `rigid` gears, and of its motors."""
    known = [gears[gear.joint.joint.name] for gear in model.tree.gears]
    more = (np.column_stack([getattr(of, order) for of in known]) for order in ("angle", "rate", "acceleration"))
    return [np.hstack(pair) for pair in zip(rigid, more, strict=True)]
