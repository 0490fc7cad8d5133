"""Compliant gears: the robot with its rotors as bodies, and what motors must do for a motion found without them.

Inverse analyses and equilibria take gears for rigid: their motion is that of the links, and their rotors turn with
them. What a gear transmits is then known, and where its motor has to be follows (`add_transmission`; Spong 1987).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .. import _core
from ..fields.waypoints import spline
from ..joints.measure import Marker, Measure
from ..joints.transmission import ElasticGear
from ..model.model import ZERO, Constraint, Model
from ..model.planar_body import PlanarBody, from_rigid_body
from ..model.system import MechanismSystem
from ..model.transmissions import joint_gears, joint_rotors
from ..scene.bodies import RigidBody
from ..solve.initial_state import output_angle
from ..solve.state import State
from .outcome import GearMotion
from .planar_outcome import PlanarOutcome

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

DEGREE = 5
UNRESOLVED = 0.001  # of a motor's largest moment: what every second output may change of it
SLOWEST = 1e4  # s, of a gear to give way, per second of the analysis: beyond, splines do not find its twist


def with_compliance(model: Model) -> Model:
    """The robot with compliant gears where the scene says so: rotors are bodies, and motors turn them.

    A rotor's frame stays where it is, at the origin: its mass is a payload of the first body. Raises `InputError` for
    such a gear in a joint without a motor.
    """
    gears = tuple(joint_gears(model.scene))
    if not gears or model.gears:
        return model
    for gear in gears:
        if gear.joint not in model.motors:
            raise InputError(
                f'{model.scene.path}: joint "{gear.joint}": stiffness: expected a joint with a motor, found one without'
            )
    pins = [
        Constraint(
            Measure(gear.rotor, kind, Marker(None), Marker(gear.rotor)),
            ZERO,
            gear.rotor,
            kind.name,
            is_trajectory=False,
        )
        for gear in gears
        for kind in (_core.MeasureKind.x, _core.MeasureKind.y)
    ]
    firm = [joint for joint in model.scene.joint if joint.elastic_gear("section") is None]
    rigid = model.scene.model_copy(update={"joint": tuple(firm)})
    turned = {gear.coordinate: gear.motor for gear in gears}
    return replace(
        model,
        bodies=(*model.bodies, *(_rotor(model, gear) for gear in gears)),
        joints=(*model.joints, *pins),
        motors={name: turned.get(row, row) for name, row in model.motors.items()},
        loads=tuple((turned.get(row, row), size) for row, size in model.loads),
        rotors=tuple(joint_rotors(rigid)),
        gears=gears,
    )


def _rotor(model: Model, gear: ElasticGear) -> PlanarBody:
    """J N² about its center; its mass moves nowhere and only makes it as large as the body beside it."""
    beside = next(model.body(end.body) for end in (gear.coordinate.a, gear.coordinate.b) if end.body is not None)
    inertia = gear.inertia * gear.ratio**2
    mass = inertia * beside.mass / beside.inertia
    return from_rigid_body(gear.rotor, RigidBody(mass=mass, inertia=inertia, center=(0.0, 0.0)))


def add_transmission(outcome: PlanarOutcome) -> PlanarOutcome:
    """An inverse analysis or equilibrium with what motors must do behind compliant gears.

    With the rigid rotor's angle ψ = N γ + α_a the gear transmits τ_s = τ − J N ψ̈. The twist δ = θ_m − γ follows from
    k δ + c δ̇ = τ_s as a quintic spline through the outputs, and the motor's moment is τ_s + J N (ψ̈ + N δ̈). Left out is
    that the first body feels J N δ̈ besides: nothing where it is the ground, 1/N of the moment's own change elsewhere.
    """
    gears = tuple(joint_gears(outcome.assembly.model.scene))
    if not gears or outcome.assembly.model.gears or outcome.tau is None or len(outcome.time) != len(outcome.tau):
        return outcome
    for gear in gears:
        if any(row == gear.coordinate for row, _ in outcome.assembly.model.loads):
            raise InputError(
                f'{outcome.assembly.model.scene.path}: analysis "{outcome.analysis.name}": expected no [[load]] on'
                f' joints with stiffness in kind = "{outcome.analysis.kind}", found one on "{gear.joint}"'
            )
    motions = dict[str, GearMotion]()
    for gear in gears:
        m = list(outcome.assembly.model.motors).index(gear.joint)
        gamma, alpha = _angles(outcome, gear)
        tau, psi_ddot = outcome.tau[:, m], gear.ratio * gamma[:, 2] + alpha[:, 2]
        where = f'{outcome.assembly.model.scene.path}: joint "{gear.joint}"'
        spring = GearSpring(gear.stiffness, gear.damping, gear.inertia * gear.ratio**2, where)
        motions[gear.joint] = gear_motion(spring, outcome.time, tau, gear.inertia * gear.ratio * psi_ddot, gamma)
    return replace(outcome, gears=motions, look_closer=None)  # twists are splines through even outputs


def _angles(outcome: PlanarOutcome, gear: ElasticGear) -> tuple[Array, Array]:
    """γ and α_a with their rates and accelerations, each (T, 3)."""
    ground = Measure("", _core.MeasureKind.angle, Marker(None), gear.coordinate.a)
    rows = [gear.coordinate, *([] if gear.coordinate.a.body is None else [ground])]
    model = outcome.assembly.model
    assembly = MechanismSystem(model, model.joints, (), rows)
    along = [(row, order) for row in assembly.motor_measures for order in range(3)]
    x = (np.ascontiguousarray(values) for values in (outcome.q, outcome.v, outcome.a))
    read = _core.Sensing(assembly.system, along, []).read(*x)
    return read[:, :3], read[:, 3:] if len(rows) > 1 else np.zeros((len(read), 3))


class GearSpring(NamedTuple):
    """k (N·m/rad), c (N·m·s/rad), and J N² (kg·m²) of the rotor in front of it; `where` messages say it is."""

    stiffness: float
    damping: float
    inertia: float
    where: str


def gear_motion(
    spring: GearSpring, time: Array, tau: Array, rotor: Array, gamma: Array, curve: BSpline | None = None
) -> GearMotion:
    """Of a gear whose motor supplies `tau` (T,) where it is rigid, `rotor` (T,) of which its rotor takes, J N ψ̈.

    `gamma` (T, 3): the joint's coordinate, its rate and acceleration. `curve`: δ(t) where it is known.
    Raises `InputError` where damping holds it so long that its moments say nothing of its twist.
    """
    lasts, longest = spring.damping / spring.stiffness, SLOWEST * (time[-1] - time[0])
    if len(time) > 1 and lasts > longest:
        raise InputError(
            f"{spring.where}: damping: expected a compliant gear that relaxes within {longest:.3g} s (damping /"
            f" stiffness, {SLOWEST:g} times the analysis), found {lasts:.3g} s; without stiffness it does not give at"
            " all"
        )
    transmitted, unresolved = tau - rotor, 0.0
    is_known = curve is not None
    curve = curve if is_known or len(time) <= DEGREE else _twist(spring, time, transmitted)
    twist = _read(curve, time) if curve else np.pad(transmitted[:, None] / spring.stiffness, ((0, 0), (0, 2)))
    moment = tau + spring.inertia * twist[:, 2]
    largest = float(np.abs(moment).max())
    if not is_known and len(time) > 2 * DEGREE + 1 and largest:
        coarse = tau[::2] + spring.inertia * _read(_twist(spring, time[::2], transmitted[::2]), time[::2])[:, 2]
        unresolved = float(np.abs(coarse - moment[::2]).max()) / largest
    angle, rate, acceleration = (gamma + twist).T
    return GearMotion(transmitted, angle, rate, acceleration, moment, unresolved, twist, curve)


def _read(curve: BSpline, time: Array) -> Array:
    """Value, rate and acceleration (T, 3)."""
    return np.column_stack([curve(time), curve.derivative(1)(time), curve.derivative(2)(time)])


def _twist(gear: GearSpring, time: Array, moment: Array) -> BSpline:
    """δ(t) with k δ + c δ̇ = `moment` at all outputs: a quintic spline without knots next to the ends."""
    from scipy.interpolate import BSpline, make_interp_spline
    from scipy.sparse import diags
    from scipy.sparse.linalg import spsolve

    knots, n = make_interp_spline(time, moment, k=DEGREE).t, len(time)
    values = BSpline.design_matrix(time, knots, DEGREE)
    widths = DEGREE / (knots[DEGREE + 1 : DEGREE + n] - knots[1:n])
    differences = diags([-widths, widths], [0, 1], shape=(n - 1, n))
    rates = BSpline.design_matrix(time, knots[1:-1], DEGREE - 1) @ differences
    return BSpline(knots, spsolve((gear.stiffness * values + gear.damping * rates).tocsc(), moment), DEGREE)


def with_rotors(source: PlanarOutcome, model: Model) -> PlanarOutcome:
    """The motion of an inverse analysis in the coordinates of `model`, whose gears give. Its own `model` stays behind.

    Raises `InputError` where motors do not fit the mechanism, and nothing is known of its rotors.
    """
    if not model.gears or source.assembly.model.gears:
        return source
    if not source.gears:
        raise InputError(
            f'{model.scene.path}: analysis "{source.analysis.name}": expected motors that fit the mechanism'
            f" ({model.degrees_of_freedom} of them) for joints with stiffness, found {len(model.motors)}"
        )
    columns: list[list[Array]] = [[source.q], [source.v], [source.a]]
    for gear in model.gears:
        known = source.gears[gear.joint]
        alpha = _angles(source, gear)[1]
        for order, values in enumerate((known.angle, known.rate, known.acceleration)):
            fixed = np.zeros((len(values), 2))  # the rotor's frame
            columns[order] += [fixed, (values + alpha[:, order] / gear.ratio)[:, None]]
    q, v, a = (np.hstack(parts) for parts in columns)
    known_rows = source.assembly.constraints
    pins = [constraint for constraint in model.joints if constraint not in known_rows]
    assembly = MechanismSystem(model, [*known_rows, *pins])
    lambda_ = np.zeros((len(q), len(assembly.constraints)))  # nothing pulls at the pins
    lambda_[:, [assembly.constraints.index(row) for row in known_rows]] = source.lambda_
    return replace(source, assembly=assembly, motion=replace(source.motion, q=q, v=v, a=a, multipliers=lambda_))


def rotors_like(model: Model, state: State, source: PlanarOutcome) -> State:
    """The state of links with rotors wound against them as `source`, a motion with rotors, has them at its start."""
    q, v = source.q[0].copy(), source.v[0].copy()
    n = len(state.q)
    for gear in model.gears:
        rotor = source.assembly.first[source.assembly.index[gear.rotor]] + 2
        for x, now in ((q, state.q), (v, state.v)):
            x[rotor] += output_angle(source.assembly, gear, now) - output_angle(source.assembly, gear, x)
    q[:n], v[:n] = state.q, state.v
    return State(q, v)


def drive_sizes(source: PlanarOutcome, limit: Array) -> list[_core.TimeFunction]:
    """The moments of motors between the outputs of `source`, cut at `limit` (motors,): a function of time for each."""
    tau = source.motor_moments
    assert tau is not None
    cut = np.clip(tau, -limit, limit)
    return spline(source.time, cut, 1 if np.any(cut != tau) else DEGREE)


def unresolved_gears(gears: Mapping[str, GearMotion]) -> Iterator[str]:
    """What to tell of motors whose moments the outputs do not resolve."""
    for joint, motion in gears.items():
        if motion.unresolved > UNRESOLVED:
            yield (
                f'joint "{joint}": outputs are too far apart for its motor behind a compliant gear: with every second'
                f" one its moment changes by {100 * motion.unresolved:.2g} %; smooth the path or refine output_step"
            )
