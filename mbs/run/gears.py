"""Compliant gears: motor torques that produce, through them, a motion found with rigid gears. SI units.

Inverse analyses and equilibria take gears for rigid. Twists δ = θ_m − γ, as quintic splines through the outputs, and
torques follow from their motion by docs/theory.md, (26) and (27).
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, SolveError, quoted
from ...common.libraries import scipy
from ..joints.joint import TwistSpring
from ..model.gears import with_compliance
from ..model.known_motion import KnownStates, States, required_forces, rotor_torques
from ..model.model import Model
from ..model.nodes import Node, rotor
from ..model.system import MotorForces, MultibodySystem, motor_forces, path_forces, turning_motors
from .record import GearCurve, GearMotion, Run

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, PPoly

REPEATS = 1e-12  # of what bodies feel of twists: a change that no longer counts
CONTRACTS = 0.5  # of one change the next one at most, where rotors on outer bodies feel their own twist, or it is noise


def supplied_in(run: Run) -> Array:
    """Generalized forces (T, n_v), N·m, N and, on modes, N/√kg, that paths or a prescribed shape require."""
    if run.required is not None:
        return run.required
    return path_forces(run.model, run.time, run.q, run.multipliers)


class Supplied(NamedTuple):
    """Forces of motors and on modes that a motion of the links requires, through compliant gears."""

    forces: MotorForces  # τ, of motors in front of compliant gears, and F_p
    gears: Mapping[str, GearMotion]  # by joint with such a gear


def supplied_through_gears(run: Run) -> Supplied:
    """Motor and modal forces of a run, with the motion of its compliant gears.

    Twists δ add moments on rotors and on the bodies that carry them (docs/theory.md, (26), (27)), which motors and
    modes supply. Moments in front of a gear contain those of other gears: all are found anew until they repeat. Twists
    and torques that the run knows are taken from it.

    Raises `InputError` for a compliant gear without a motor, or with a load on its joint.
    """
    model, time, twists = run.model, run.time, run.twists
    compliant, wanted = with_compliance(model), supplied_in(run)
    if compliant is model:
        return Supplied(motor_forces(model, run.q, wanted), {})
    elastic = compliant.tree.gears
    for load in model.scene.load:
        if any(load.joint == gear.joint.joint.name for gear in elastic):
            raise InputError(
                f"{model.scene.path}: expected no [[load]] on joints with stiffness in inverse analyses and equilibria",
                f'one on "{load.joint}"',
            )
    felt, torques, known = np.zeros_like(wanted), rotor_torques(MultibodySystem(model), run, time), []
    for gear in elastic:
        joint, (inertia, N) = gear.joint.joint.name, rotor(gear.motor)
        where = f'{model.scene.path}: joint "{joint}"'
        spring = GearSpring(gear.spring, gear.damping, inertia * N**2, where)
        known.append((joint, spring, N * torques[:, model.tree.index[gear.joint.body.name]], _along(gear.joint, run)))
    system = MultibodySystem(compliant)
    rigid = required_forces(system, with_motors(compliant, run, {}), time)
    is_found, change = bool(twists) and all(of.torque is not None for of in twists.values()), np.inf
    for passes in count(1):
        forces = motor_forces(model, run.q, wanted + felt)
        gears = {
            joint: gear_motion(spring, time, forces.moments[joint][:, 0], torque, along, twists.get(joint))
            for joint, spring, torque, along in known
        }
        if is_found:
            break
        needed = required_forces(system, with_motors(compliant, run, gears), time) - rigid
        before, felt = felt, needed[:, : felt.shape[1]]
        for gear in elastic:  # but for what their springs do along their own joints
            of = gears[gear.joint.joint.name].twist
            felt[:, gear.joint.v.start] += gear.sign * (gear.spring.moment(of[:, 0]) + gear.damping * of[:, 1])
        change, last = float(np.abs(felt - before).max(initial=0.0)), change
        repeats = change <= REPEATS * float(np.abs(felt).max(initial=0.0))
        if repeats or (passes > len(elastic) and change > CONTRACTS * last):
            break
    moments = {**forces.moments, **{joint: of.moment[:, None] for joint, of in gears.items()}}
    return Supplied(replace(forces, moments=moments), gears)


def _along(node: Node, state: States) -> Array:
    """γ, its rate and acceleration (T, 3), of the joint as the scene has it."""
    of_joint = ((state.q, node.q), (state.v, node.v), (state.a, node.v))
    columns = np.column_stack([values[:, part.start] for values, part in of_joint])
    return -columns if node.backwards else columns


class MotorCoordinates(NamedTuple):
    """Motion in the coordinates of a robot with compliant gears."""

    # (T, n_q), (T, n_v), (T, n_v), SI
    q: Array
    v: Array
    a: Array
    gears: Mapping[str, GearMotion]  # by joint; {} where run and model have the same gears
    moments: Mapping[str, Array]  # (T, k) N·m or N, by joint, of all motors; {} likewise


def with_motor_coordinates(run: Run, model: Model) -> MotorCoordinates:
    """The motion of `run` in coordinates of `model`, its motors advanced by the twist of compliant gears.

    Raises `InputError` where motors turn frames and modes tilt the joint's axis: no angle belongs to their moments.
    """
    if not model.tree.gears or run.model.tree.gears:
        return MotorCoordinates(run.q, run.v, run.a, {}, {})
    turning = set(turning_motors(run.model)).intersection(gear.joint.joint.name for gear in model.tree.gears)
    if turning:
        raise InputError(
            f'{model.scene.path}: motors: expected "section" where joints with stiffness are driven, controlled or'
            f" linearized and modes tilt the joint's axis ({quoted(sorted(turning))})",
            '"frame"',
        )
    forces, gears = supplied_through_gears(run)
    return MotorCoordinates(*with_motors(model, run, gears), gears, forces.moments)


def with_motors(model: Model, rigid: States, gears: Mapping[str, GearMotion]) -> KnownStates:
    """States of `model`, which has compliant gears, from `rigid` ones and the twists of `gears`, by joint.

    Motors of joints not in `gears` are untwisted.
    """
    known = [(gear.joint, gears.get(gear.joint.joint.name)) for gear in model.tree.gears]
    motors = np.array([_along(node, rigid) + (0.0 if of is None else of.twist) for node, of in known])
    parts = zip((rigid.q, rigid.v, rigid.a), motors.transpose(2, 1, 0), strict=True)
    return KnownStates(*(np.hstack(pair) for pair in parts))


DEGREE = 5
UNRESOLVED = 0.001  # of a motor's largest moment: what every second output may change of it
MOST_STEPS = 50
SLOWEST = 1e4  # s, of a gear to give way, per second of the analysis: beyond, splines do not find its twist


class GearSpring(NamedTuple):
    """Compliant gear: spring k(δ) (N·m), damping c (N·m·s/rad), rotor inertia J N² (kg·m²); `where`: its name."""

    spring: TwistSpring
    damping: float
    inertia: float
    where: str


def gear_motion(
    spring: GearSpring, time: Array, tau: Array, rotor: Array, gamma: Array, curve: GearCurve | None = None
) -> GearMotion:
    """The motion of a gear from the motor torque `tau` (T,), N·m, with a rigid gear, at `time` (T,), s.

    `rotor` (T,), N·m: the part of it that accelerates the rotor; `gamma` (T, 3): the joint's coordinate, rad, its rate
    and acceleration; `curve`: δ(t), τ(t), where they are known.
    Raises `InputError` if damping delays the twist so much that torques do not determine it.
    """
    lasts, longest = spring.damping / min(spring.spring.slopes), SLOWEST * (time[-1] - time[0])
    if len(time) > 1 and lasts > longest:
        raise InputError(
            f"{spring.where}: damping: expected a compliant gear that relaxes within {longest:.3g} s (damping /"
            f" stiffness, {SLOWEST:g} times the analysis)",
            f"{lasts:.3g} s; without stiffness it does not deform at all",
        )
    transmitted, unresolved = tau - rotor, 0.0
    is_known = curve is not None
    if curve is None and len(time) > DEGREE:
        curve = GearCurve(_twist(spring, time, transmitted))
    twist = _read(curve.twist, time) if curve else np.pad(spring.spring.twist(transmitted)[:, None], ((0, 0), (0, 2)))
    moment = tau + spring.inertia * twist[:, 2] if curve is None or curve.torque is None else curve.torque(time)
    largest = float(np.abs(moment).max())
    if not is_known and len(time) > 2 * DEGREE + 1 and largest:
        coarse = tau[::2] + spring.inertia * _read(_twist(spring, time[::2], transmitted[::2]), time[::2])[:, 2]
        unresolved = float(np.abs(coarse - moment[::2]).max()) / largest
    angle, rate, acceleration = (gamma + twist).T
    return GearMotion(
        gear_moment=transmitted,
        angle=angle,
        rate=rate,
        acceleration=acceleration,
        moment=moment,
        unresolved=unresolved,
        twist=twist,
        curve=curve,
    )


def _read(curve: "BSpline | PPoly", time: Array) -> Array:
    return np.column_stack([curve(time), curve.derivative(1)(time), curve.derivative(2)(time)])


def _twist(gear: GearSpring, time: Array, moment: Array) -> "scipy.interpolate.BSpline":
    """δ(t) with k(δ) + c δ̇ = `moment` at all outputs: a quintic spline without knots next to the ends.

    By Newton, which ends where no output changes its part of the spring. Raises `SolveError` where it does not.
    """
    from scipy.sparse.linalg import spsolve

    knots, n = scipy.interpolate.make_interp_spline(time, moment, k=DEGREE).t, len(time)
    values = scipy.interpolate.BSpline.design_matrix(time, knots, DEGREE)
    widths = DEGREE / (knots[DEGREE + 1 : DEGREE + n] - knots[1:n])
    differences = scipy.sparse.diags([-widths, widths], [0, 1], shape=(n - 1, n))
    rates = scipy.interpolate.BSpline.design_matrix(time, knots[1:-1], DEGREE - 1) @ differences
    twist = gear.spring.twist(moment)
    for _ in range(MOST_STEPS):
        slope = gear.spring.slope(twist)
        left = (scipy.sparse.diags(slope) @ values + gear.damping * rates).tocsc()
        coefficients = spsolve(left, moment - gear.spring.moment(twist) + slope * twist)
        twist = values @ coefficients
        if np.array_equal(gear.spring.slope(twist), slope):
            return scipy.interpolate.BSpline(knots, coefficients, DEGREE)
    raise SolveError(
        f"{gear.where}: expected the twist of its gear within {MOST_STEPS} iterations",
        "none: smooth the path, or refine output_step",
    )


def unresolved_gears(gears: Mapping[str, GearMotion]) -> Iterator[str]:
    """Yield warnings on motors whose torques the outputs do not resolve."""
    for joint, motion in gears.items():
        if motion.unresolved > UNRESOLVED:
            yield (
                f'joint "{joint}": outputs are too far apart for its motor behind a compliant gear: with every second'
                f" one its torque changes by {100 * motion.unresolved:.2g} %; smooth the path or refine output_step"
            )
