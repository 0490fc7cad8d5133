"""The robot on its path with motors behind compliant gears: torques that these transmit, and those of motors.

docs/theory.md, Motors and patches together. A gear transmits τ_s = K δ + D δ̇, the torque of a rigid gear without its
own rotor, and the motor supplies I δ̈ more, I = J N².
"""

import copy
from dataclasses import KW_ONLY, fields, replace

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError, quoted
from ...common.structs import struct
from ..inversion.servo import Servo
from ..joints.joint import TwistSpring
from ..model.gears import compliance, elastic_joints
from ..model.known_motion import rotor_torques
from ..model.model import Model
from ..model.nodes import rotor
from ..model.system import MultibodySystem, turning_motors

SAMPLES = 5  # along the path, at which the torque of a gear is found in two ways
TINY = 1e-300
SAME = 1e-8  # of the largest torque of its motor, these two


@struct
class Gears:
    """Compliant gears (k,): numbers `columns` of motors, K (N·m/rad), D (N·m·s/rad), I of rotors at joints (kg·m²)."""

    joints: tuple[str, ...]
    columns: Indices
    stiffness: Array
    damping: Array
    inertia: Array


@struct
class GearedServo(Servo):
    """A robot on its path with k compliant gears; torques (N, motors + k), N·m or N.

    Torques are those of motors with rigid gears, then of gears. `without` (k,): the robot less one gear's rotor each.
    """

    _: KW_ONLY
    gears: Gears
    without: tuple[Servo, ...]

    def forces(self, times: Array, p: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """Residual modal forces r (N, n), N/√kg, and torques (N, motors + k), N·m or N.

        At `times` (N,), s, with p, ṗ = v, p̈ = a (N, n), m·√kg and s.
        """
        r, tau = super().forces(times, p, v, a)
        of_gears = [
            servo.motion.motion(times.tolist(), p, v, a, self.postures(times)).tau[:, [column]]
            for servo, column in zip(self.without, self.gears.columns, strict=True)
        ]
        return r, np.hstack([tau, *of_gears])

    def slopes(self, times: Array, p: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Derivatives (N, n + motors + k, n), SI units, of residual modal forces and torques by p̈, ṗ and p.

        At `times` (N,), s; p, ṗ = v and p̈ = a are (N, n), m·√kg and s.
        """
        found = [super().slopes(times, p, v, a)]
        for servo, column in zip(self.without, p.shape[1] + self.gears.columns, strict=True):
            M, D, K = servo.slopes(times, p, v, a)
            found.append((M[:, [column]], D[:, [column]], K[:, [column]]))
        M, D, K = (np.concatenate(parts, axis=1) for parts in zip(*found, strict=True))
        return M, D, K

    def reactions(self, times: Array, p: Array, v: Array, a: Array) -> Array:
        """Return what the torque I δ̈, N·m, of each of k rotors adds to `forces`, per N·m: (N, k, n + motors).

        Modal forces, N/√kg, and torques of motors, N·m or N, but 0 of its own. At `times` (N,), s; p, ṗ = v and p̈ = a
        are (N, n), m·√kg and s.
        """
        M, shares = super().slopes(times, p, v, a)[0], list[Array]()
        for servo, column in zip(self.without, p.shape[1] + self.gears.columns, strict=True):
            of_rotor = M - servo.slopes(times, p, v, a)[0]
            own = of_rotor[:, column]
            share = np.einsum("Tfn,Tn->Tf", of_rotor, own) / np.maximum((own**2).sum(axis=1), TINY)[:, None]
            share[:, column] = 0.0
            shares.append(share)
        return np.stack(shares, axis=1)

    def quasi_static(self, times: Array, p: Array) -> Array:
        """Torques of motors (N, motors), N·m or N, at `times` (N,), s, for constant p (N, n), m·√kg."""
        return super().quasi_static(times, p)[:, : -len(self.without)]

    def slowed(self, factor: float) -> Servo:
        """The servo on the same path in `factor` times the time."""
        slower = tuple(servo.slowed(factor) for servo in self.without)
        return replace(super().slowed(factor), without=slower)  # type: ignore[call-arg]


def with_gears(servo: Servo) -> Servo:
    """The same robot with the torques of its compliant gears; itself where all gears are rigid.

    Raises `InputError` for gears and motors that `kind = "tracking"` does not support.
    """
    model = servo.model
    elastic = elastic_joints(model)
    if not elastic:
        return servo
    springs = dict[str, tuple[TwistSpring, float]]()
    for node in elastic:
        known = compliance(node)
        assert known is not None
        if known[0].knots:
            raise InputError(
                'expected one stiffness of each gear for kind = "tracking"',
                f'steps in joint "{node.joint.name}": a torque that is smooth would need a motor that is not. Use a'
                " mean stiffness",
            )
        springs[node.joint.name] = known
    if turning := set(turning_motors(model)).intersection(springs):
        raise InputError(
            f'{model.scene.path}: motors: expected "section" for kind = "tracking" with compliant gears in joints'
            f" whose axes modes tilt ({quoted(sorted(turning))})",
            '"frame"',
        )
    if loaded := sorted({load.joint for load in model.scene.load if load.joint in springs}):
        raise InputError(f"{model.scene.path}: expected no [[load]] on joints with stiffness", f'one on "{loaded[0]}"')
    rotors, motors = [rotor(node) for node in elastic], motor_names(model)
    gears = Gears(
        joints=tuple(springs),
        columns=np.array([motors.index(joint) for joint in springs]),
        stiffness=np.array([spring.slopes[0] for spring, _ in springs.values()]),
        damping=np.array([damping for _, damping in springs.values()]),
        inertia=np.array([inertia * ratio**2 for inertia, ratio in rotors]),
    )
    without = tuple(replace(servo, model=without_rotor(model, node.joint.name)) for node in elastic)
    of_servo = {one.name: getattr(servo, one.name) for one in fields(servo)}
    geared = GearedServo(**of_servo, gears=gears, without=without)
    _check_rotors(geared, np.array([ratio for _, ratio in rotors]))
    return geared


def _check_rotors(servo: GearedServo, ratios: Array) -> None:
    """Refuse a rotor on a body that its own motor turns, so that links would feel the gear.

    A gear transmits τ − N J ψ̈ with the spin ψ̇ of its rotor. Without the rotor a motor takes as much less only where
    the body that carries the rotor does not turn along with it.
    """
    model, gears = servo.model, servo.gears
    times = servo.end * np.linspace(0.0, 1.0, SAMPLES + 2)[1:-1]
    still = np.zeros((SAMPLES, len(servo.scale)))
    states = servo.motion.motion(times.tolist(), still, still, still, servo.postures(times))
    spin_up = rotor_torques(MultibodySystem(model), states, times)
    torques = servo.forces(times, still, still, still)[1]
    for k, joint in enumerate(gears.joints):
        tau, tau_s = torques[:, gears.columns[k]], torques[:, k - len(gears.joints)]
        off = tau - ratios[k] * spin_up[:, model.tree.carried[joint]] - tau_s
        if np.abs(off).max() > SAME * np.abs(tau).max():
            is_backwards = model.driven(joint).backwards
            remedy = "Exchange its sides in `between`" if is_backwards else "Put the motor on another joint of the loop"
            raise InputError(
                'expected motors on bodies that they do not turn themselves for kind = "tracking" with compliant gears',
                f'that of joint "{joint}" on its first body, which turns with it. {remedy}',
            )


def motor_names(model: Model) -> list[str]:
    """Names of the joints of motors, one for each torque."""
    return [joint for joint, columns in model.motors.items() for _ in columns]


def without_rotor(model: Model, joint: str) -> Model:
    """The robot without the inertia of a joint's rotor."""
    tree = copy.copy(model.tree)
    tree.nodes = tuple(
        replace(node, joint=node.joint.model_copy(update={"rotor_inertia": 0.0})) if node.joint.name == joint else node
        for node in tree.nodes
    )
    return replace(model, tree=tree)
