"""Robots as controllers use them: names, sensors, links, patches, linear and rigid models."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError, SolveError
from ...common.structs import struct
from ...mbs.linear.linearisation import LinearEquations, LinearMechanism, labelled
from ...mbs.model.body import Body
from ...mbs.model.build import build_model
from ...mbs.model.gears import elastic_joints, resistance, with_compliance
from ...mbs.model.kinematics import ZERO
from ...mbs.model.model import MET, Model
from ...mbs.model.nodes import rows_of_joint
from ...mbs.model.system import MultibodySystem
from ...mbs.posture.posture import mobility
from ...mbs.posture.start import undeformed_posture
from ...mbs.run.gears import with_motor_coordinates
from ...mbs.run.record import Run
from ..context import ActuatedContext
from ..patches.link_patches import LinkPatches
from ..patches.patches import voltage_gain
from .linear import with_voltages
from .linear_model import numbers
from .records import Controller, JointPid, Lqr, ModalVelocity, PythonController, Sensor
from .signals import check_joint


def rigid_freedom(model: Model) -> int:
    """The number of DOF of the mechanism with rigid links in its initial posture, with those of gears."""
    return mobility(model, undeformed_posture(model).q).freedom + len(model.tree.gears)


class RigidArm:
    """Robot with rigid links: torques τ(γ, γ̇, γ̈), SI, of all motors, with rotors and friction, without loads.

    `q` (n_q,), m and rad, is the first configuration of `model`. Raises `InputError` where motors do not fit its DOF.
    """

    def __init__(self, model: Model, q: Array) -> None:
        freedom, count = rigid_freedom(model), len(model.motor_columns)
        if count != freedom:
            raise InputError(
                f"controller: expected motors that fit the mechanism ({freedom} of them)",
                f"{count}; name them with motor = true",
            )
        scene = model.scene.model_copy(update={"load": (), "trajectory": ()})
        free = build_model(scene, [_rigid(node.body) for node in model.tree.nodes])
        motors = [
            row
            for joint, columns in free.motors.items()
            for row in rows_of_joint(
                joint, free.tree.nodes[free.tree.carried[joint]], columns, [ZERO] * len(columns), free.sign(joint)
            )
        ]
        self._model = replace(free, rows=(*free.rows, *motors))
        self._motors = np.arange(len(free.rows), len(free.rows) + len(motors))
        self._system = MultibodySystem(self._model)
        self._q: Array = np.zeros(free.tree.n_q)
        for own, node in zip(free.tree.nodes, model.tree.nodes, strict=True):
            self._q[own.q] = q[node.q]

    def mobility(self) -> Array:
        """Accelerations (motors,) of each motor per unit torque of its own, others free, at rest; SI units."""
        angles = self._model.constraints.values(self._q[None], np.zeros(1))[0][0, self._motors]
        return np.diag(np.linalg.inv(self.terms(angles, np.zeros_like(angles))[0]))

    def place(self, gamma: Array) -> tuple[Array, Array]:
        """Move from the last posture to motor angles `gamma` (motors,), rad or m.

        Return coordinates q (n_q,) and the Jacobian C_v (constraint equations, n_v), SI. Raises `SolveError` where the
        links do not reach these angles.
        """
        beside, now = np.zeros((1, len(self._model.rows))), np.zeros(1)
        beside[0, self._motors] = gamma
        q, left = self._model.constraints.moved(self._q[None], now, beside)
        if not left[0] <= MET:
            raise SolveError(
                "controller: expected joint angles that the rigid links can have",
                f"{np.round(gamma, 6)}, {left[0]:.2g} (rad, sizes of the robot) from such: smaller steps of the path,"
                " or a loop that stays nearer to it",
            )
        self._q = q[0]
        return self._q, self._model.constraints.values(q, now)[1][0]

    def terms(self, gamma: Array, gamma_dot: Array) -> tuple[Array, Array]:
        """M (motors, motors) and h (motors,) of τ = M γ̈ + h, SI units, by γ and γ̇ (motors,)."""
        q, C_v = self.place(gamma)
        rates = np.zeros(len(C_v))
        rates[self._motors] = gamma_dot
        v = np.linalg.pinv(C_v) @ rates
        self._system.core.keep_independent_rows(q, v)
        friction = -resistance(self._model, q[None], v[None])[0]

        def moments(target: Array) -> Array:
            signs = self._model.row_signs
            multipliers = self._system.core.evaluate(q, v, signs * target, friction, None)[1]
            return -(signs * multipliers)[self._motors]

        h = moments(np.zeros(len(C_v)))
        return np.column_stack([moments(unit) - h for unit in np.eye(len(C_v))[self._motors]]), h

    def moments(self, gamma: Array, gamma_dot: Array, gamma_ddot: Array) -> Array:
        """τ (motors,), N·m or N, for angles, rates and accelerations (motors,) of motors; SI units."""
        M, h = self.terms(gamma, gamma_dot)
        return M @ gamma_ddot + h


def _rigid(body: Body) -> Body:
    none, empty = np.zeros((3, 0)), np.zeros((0, 0))
    points = {name: replace(at, translation=none, rotation=none) for name, at in body.points.items()}
    return replace(
        body, S_bar=none, I_bar=np.zeros((3, 3, 0)), S_bar_kl=np.zeros((3, 3, 0, 0)), h_spin=np.zeros(0),
        S_spin=empty, stiffness=np.zeros(0), damping=empty, points=MappingProxyType(points), modal_transform=empty,
        reduction=None, attachment_modes=0, stiffening=None,
    )  # fmt: skip


@struct
class PatchSignals:
    """The k patches of one link, and the m uncoupled modal coordinates that they excite, the lowest first."""

    inputs: tuple[str, ...]  # names of the voltages, and of the readings
    omega: Array  # (served,) rad/s, natural frequencies without attachment modes
    gain: Array  # (k, m) V√kg/N, voltages per force on each of these coordinates
    volts: Array  # (k, m) V/(m·√kg), readings per unit of each coordinate
    own: Array  # (m, n) these coordinates from all n modal coordinates p of the link, no unit


@struct
class ControlledRobot:
    """Robot, SI units, with motors and patches on the motion of an inverse analysis, about which it is linearized."""

    model: Model  # with constraint equations of loops alone, and with rigid gears
    of_links: Mapping[str, LinkPatches]  # patches by link
    source: Run  # the inverse analysis

    @cached_property
    def plant(self) -> Model:
        """The robot with its compliant gears."""
        return with_compliance(self.model)

    @property
    def path(self) -> Path:
        """Path of the scene file."""
        return self.model.scene.path

    @property
    def motors(self) -> tuple[str, ...]:
        """Names of the coordinates of motors: "NAME", or "NAME 1", "NAME 2" of joints with several."""
        return tuple(name for joint in self.model.motors for name in self.coordinates(joint))

    def coordinates(self, joint: str) -> tuple[str, ...]:
        """Names of a joint's coordinates: its name, or "NAME 1", "NAME 2"."""
        check_joint(self.model, joint)
        return tuple(name.removeprefix("joint/") for name, _ in labelled(self.model, joint))

    @property
    def elastic_joints(self) -> tuple[str, ...]:
        """Names of joints with compliant gears."""
        return tuple(node.joint.name for node in elastic_joints(self.model))

    @property
    def motors_fit(self) -> bool:
        """Whether there are as many motors as the mechanism with rigid links has DOF."""
        return len(self.motors) == rigid_freedom(self.model)

    @cached_property
    def links(self) -> Mapping[str, Body]:
        """Equations of the flexible links, by name."""
        return {node.body.name: node.body for node in self.model.tree.nodes if node.body.n_modes}

    @cached_property
    def patches(self) -> Mapping[str, PatchSignals]:
        """Patches by link, with the modes that its layouts reach together."""
        signals = {}
        for name, of_link in self.of_links.items():
            reached, arrays, own = of_link.reach.modes, of_link.arrays, of_link.bodies[name]
            to_file = self.model.tree.nodes[self.model.tree.index[name]].body.modal_transform
            signals[name] = PatchSignals(
                inputs=tuple(f"pzt/{layout}/{k}" for layout, of in arrays.items() for k in range(1, len(of.edges) + 1)),
                omega=np.sqrt(reached.stiffness[: reached.served]),
                gain=voltage_gain(of_link.reach),
                volts=reached.forces(np.linalg.solve(own.capacitance, own.charge.T)),
                own=reached.coordinates(to_file.T).T,
            )
        return signals

    def linear(self, row: int, points: Mapping[str, str] = MappingProxyType({})) -> LinearMechanism:
        """Linearize about output no. `row`; inputs are motors, voltages, forces on `points` (of the model, by name)."""
        moved = with_motor_coordinates(self.source, self.plant)
        linearisation = LinearEquations(self.plant, moved.q[row], points)
        found = linearisation.at(float(self.source.time[row]), moved.q[row], moved.v[row], moved.a[row])
        return with_voltages(self.plant, found, self.of_links)

    def rigid(self) -> RigidArm:
        """The robot with rigid links at the start. Raises `InputError` if motors do not fit the mechanism."""
        return RigidArm(self.model, self.source.q[0])


def whole_robot(context: ActuatedContext, source: Run) -> ControlledRobot:
    """The robot of an analysis about the motion `source`, with whole links in place of subdivided ones."""
    if context.whole is None:
        return ControlledRobot(context.model.without_paths(), context.patches, source)
    return ControlledRobot(context.whole.model.without_paths(), context.patches, context.whole.as_links(source))


def input_names(robot: ControlledRobot) -> tuple[str, ...]:
    """Return names of all commands: motor torques "joint/NAME", then voltages "pzt/LAYOUT/k"."""
    voltages = [name for link in robot.patches.values() for name in link.inputs]
    return tuple([f"joint/{name}" for name in robot.motors] + voltages)


def estimate(volts: Array, count: int) -> Array:
    """The matrix (≤ count, k), m·√kg/V, from readings of k patches to estimates of the lowest coordinates.

    `volts` (k, m), V/(m·√kg): readings per unit of each coordinate.
    """
    return np.linalg.pinv(volts[:, : min(volts.shape)])[:count]


def _ideal(subject: Mapping[str, str], *, rate: bool = True) -> Iterator[Sensor]:
    yield Sensor.model_validate(subject)
    if rate:
        yield Sensor.model_validate({**subject, "measure": "rate"})


def needed_sensors(robot: ControlledRobot, controllers: Sequence[Controller]) -> Iterator[Sensor]:
    """Yield the ideal sensors that the `controllers` of an analysis need where the scene has none."""
    for record in controllers:
        if isinstance(record, JointPid):
            for joint in record.joints:
                is_rated = joint in record.derivative and record.rate == "measured"
                yield from _ideal({record.side: joint}, rate=is_rated)
        elif not isinstance(record, PythonController | ModalVelocity):
            for joint in robot.model.motors:
                yield from _ideal({"joint": joint})
        if isinstance(record, Lqr):
            for joint in robot.elastic_joints:
                yield from _ideal({"motor": joint})
        if isinstance(record, ModalVelocity | Lqr):
            bending = robot.patches if record.sensor == "pzt" else robot.links
            bodies = record.bodies if isinstance(record, ModalVelocity) else tuple(bending)
            for body in bodies:
                if record.sensor == "pzt":
                    yield from (Sensor(pzt=layout) for layout in robot.of_links[body].arrays)
                else:
                    yield from _ideal({"modal": body})


def estimated_sensors(robot: ControlledRobot, controllers: Sequence[Controller], tip: str) -> Iterator[Sensor]:
    """Yield ideal sensors of all that an observer estimates: the tip, coordinates, rates, the controllers' readings."""
    model = robot.model
    subjects = [{"joint": one.name} for one in model.scene.joint if one.units and one.name in model.tree.carried]
    subjects += [{"motor": name} for name in robot.elastic_joints] + [{"modal": name} for name in robot.links]
    yield Sensor(point=tip)
    for subject in subjects:
        yield from _ideal(subject)
    yield from needed_sensors(robot, controllers)


def default_tip(model: Model) -> str:
    """The tool point "BODY.POINT" of the scene, or the tip of the last link."""
    if (tool := model.scene.tool_point) is not None:
        return tool
    body = next(node.body for node in reversed(model.tree.nodes) if node.body.points)
    return f"{body.name}.{'tip' if 'tip' in body.points else next(iter(body.points))}"


@struct
class Setup:
    """Data for making a controller; SI units."""

    robot: ControlledRobot
    # names of commands (torques N·m or N, voltages V) and readings, as `Signal` has them
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    times: Array  # (K,) of the samples, s
    sample_time: float  # s
    delay: float  # s, after which a command acts
    reference: Array  # (K, outputs) readings on the motion of the robot
    feed_forward: Array  # (K, inputs) commands to which those of controllers are added

    def robot_coordinates(self, joints: Iterable[str]) -> Iterator[tuple[str, str]]:
        """Yield each joint with the name of each of its coordinates: "NAME", or "NAME 1", "NAME 2"."""
        for joint in joints:
            yield from ((joint, name) for name in self.robot.coordinates(joint))

    @property
    def has_estimates(self) -> bool:
        """Whether an observer adds "estimate/NAME" to the readings."""
        return any(name.startswith("estimate/") for name in self.outputs)

    def columns(self, *names: str) -> Indices:
        """Indices (names,) of readings in y, or of their estimates. Raises `InputError` for unknown ones."""
        of = [f"estimate/{name}" if self.has_estimates and name not in self.outputs else name for name in names]
        return np.array(numbers(of, self.outputs, "controller: expected readings"), dtype=int)

    def places(self, *names: str) -> Indices:
        """Indices (names,) of commands in u. Raises `InputError` for a joint without motor."""
        return np.array(numbers(names, self.inputs, "controller: expected commands"), dtype=int)

    def modal_columns(self, body: str, m: int, ending: str = "/rate") -> Indices:
        """Indices (m,) in y of the lowest m modal rates of a body, or of coordinates for an empty `ending`."""
        return self.columns(*(f"modal/{body}/{k}{ending}" for k in range(1, m + 1)))
