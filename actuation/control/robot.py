"""What controllers ask of a robot: readings of sensors by name, links, patches, linear and rigid models."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array, Indices, as_floats
from ...common.errors import InputError, SolveError
from ...common.structs import struct
from ...mbs.linear.linearisation import LinearEquations, LinearMechanism, labelled
from ...mbs.model.body import Body
from ...mbs.model.drives import Drives, PointDrive
from ...mbs.model.gears import elastic_joints, resistance, with_compliance
from ...mbs.model.kinematics import ZERO
from ...mbs.model.known_motion import KnownStates, motion_forces
from ...mbs.model.model import Model, build_model, constraint_values, modal_directions
from ...mbs.model.nodes import Section, rows_of_joint
from ...mbs.model.system import MultibodySystem
from ...mbs.model.tree import KinematicTree
from ...mbs.posture.posture import MET, mobility, posture_search
from ...mbs.posture.start import undeformed_posture
from ...mbs.run.context import WholeLinks, place_of
from ...mbs.run.gears import with_motor_coordinates
from ...mbs.run.outcome import Outcome
from ...mbs.scene.space import SPACES
from ..patches.link_patches import LinkPatches
from ..patches.patches import PatchArray, voltage_gain
from .linear import voltages_at
from .records import Sensor

ORDERS = {"value": 0, "rate": 1, "acceleration": 2}


@struct
class Signal:
    """One reading: the coordinate `axis` (0, 1, 2) of a `point`, or `along` (n_v,) times joint and modal coordinates.

    `name`: "joint/NAME", "motor/NAME", "point/BODY.POINT/x" or y or z, "pzt/LAYOUT/k", "modal/BODY/k" (k from 1), with
    "/rate" or "/acceleration" behind it where that is read. `order` counts derivatives, `resolution` and `noise` are
    those of `Sensor`.
    """

    name: str
    order: int
    resolution: float
    noise: float
    along: Array = field(default_factory=lambda: np.zeros(0))
    point: str = ""
    axis: int = 0

    @property
    def of(self) -> str:
        """The name without what is behind it."""
        return self.name if self.order == ORDERS["value"] else self.name.rpartition("/")[0]


class Sensing:
    """What signals read of states of a tree."""

    def __init__(self, model: Model, read: Sequence[Signal]) -> None:
        tree = model.tree
        self._tree, self._count = tree, len(read)
        self._linear = np.array([k for k, signal in enumerate(read) if not signal.point], dtype=int)
        self._order = np.array([read[k].order for k in self._linear], dtype=int)
        self._along = np.reshape([read[k].along for k in self._linear], (len(self._linear), tree.n_v))
        self._where = _places_in_q(tree)
        sections = {signal.point: tree.section(signal.point) for signal in read if signal.point}
        self._points: list[tuple[str, Section, list[tuple[int, int, int]]]] = [
            (point, section, [(k, s.order, s.axis) for k, s in enumerate(read) if s.point == point])
            for point, section in sections.items()
        ]
        accelerated = any(signal.point and signal.order == ORDERS["acceleration"] for signal in read)
        drives = Drives(at_points=tuple(PointDrive(point, {}) for point in sections))
        self._system = MultibodySystem(model, drives) if accelerated else None

    def read(self, q: Array, v: Array, a: Array) -> Array:
        """Readings (T, signals) of q (T, n_q), v and a (T, n_v)."""
        found = np.zeros((len(q), self._count))
        values = np.stack([q[:, self._where] @ self._along.T, v @ self._along.T])
        found[:, self._linear] = np.where(self._order == ORDERS["value"], *values)
        if not self._points:
            return found
        places, forces = self._tree.places(q, v), None
        if self._system is not None:
            none = np.zeros((len(q), len(self._system.model.rows)))
            forces = motion_forces(self._system, KnownStates(q, v, a), np.zeros(len(q)), none)
        for point, section, columns in self._points:
            at = places.at(section)
            orders = [at.r, at.velocity]
            if forces is not None:
                orders.append(forces.of_point(point).a)
            for k, order, axis in columns:
                found[:, k] = orders[order][:, axis]
        return found


def _places_in_q(tree: KinematicTree) -> Indices:
    """(n_v,) where in q the coordinate of each rate is; of orientations, which nothing reads so, some other place."""
    places = np.zeros(tree.n_v, dtype=np.intp)
    for node in tree.nodes:
        if node.joint.q_count == node.joint.freedoms:
            places[node.v] = np.arange(node.q.start, node.q.stop)
        places[node.p_v] = np.arange(node.p_q.start, node.p_q.stop)
    return places


def make_signals(
    model: Model, patches: Mapping[str, LinkPatches], sensor: Sensor, whole: WholeLinks | None = None
) -> Iterator[Signal]:
    """The readings of one sensor of the scene, of whose links some are in pieces where there are `whole` ones.

    Raises `InputError` for a joint without coordinates in the tree.
    """
    order, ending = ORDERS[sensor.measure], "" if sensor.measure == "value" else f"/{sensor.measure}"
    quality = order, sensor.resolution, sensor.noise
    if sensor.joint is not None:
        check_joint(model, sensor.joint)
        sign = model.tree.nodes[model.tree.carried[sensor.joint]].sign
        for name, k in labelled(model, sensor.joint):
            yield Signal(f"{name}{ending}", *quality, along=sign * np.eye(model.tree.n_v)[k])
    elif sensor.motor is not None:
        k = model.driven(sensor.motor).v.start
        yield Signal(f"motor/{sensor.motor}{ending}", *quality, along=np.eye(model.tree.n_v)[k])
    elif sensor.point is not None:
        place = place_of(whole, sensor.point)
        for axis in SPACES[model.scene.space].translations:
            yield Signal(f"point/{sensor.point}/{'xyz'[axis]}{ending}", *quality, point=place, axis=axis)
    elif sensor.pzt is not None:
        body = next(body for body, of_link in patches.items() if sensor.pzt in of_link.arrays)
        volts = volts_on_file(patches[body], sensor.pzt, sensor.capacitance)
        for k, along in enumerate(modal_directions(model, {name: of.T for name, of in volts.items()}), 1):
            yield Signal(f"pzt/{sensor.pzt}/{k}", *quality, along=along)
    elif sensor.modal is not None:
        for k, along in enumerate(_modal_coordinates(model, sensor.modal, whole), 1):
            yield Signal(f"modal/{sensor.modal}/{k}{ending}", *quality, along=along)


def merged(given: Iterable[Signal], needed: Iterable[Signal]) -> tuple[Signal, ...]:
    """The sensors of the scene, and ideal ones for what controllers need besides."""
    by_name = {signal.name: signal for signal in needed} | {signal.name: signal for signal in given}
    return tuple(by_name.values())


def _modal_coordinates(model: Model, link: str, whole: WholeLinks | None) -> Array:
    """(n, n_v) p of a link by v: its own coordinates, or of its pieces."""
    if whole is None or link not in whole.divided:
        return np.eye(model.tree.n_v)[model.tree.nodes[model.tree.index[link]].p_v]
    bodies, rows = whole.divided[link].bodies, whole.divided[link].gathered
    places = [model.tree.nodes[model.tree.index[body]].p_v for body in bodies]
    columns = np.concatenate([np.arange(of_piece.start, of_piece.stop) for of_piece in places])
    found = np.zeros((len(rows), model.tree.n_v))
    found[:, columns] = rows
    return found


def volts_per_turn(patches: PatchArray, capacitance: float | None = None) -> Array:
    """Voltage (k,) of each patch per turn: its charge c [φ'(x2) − φ'(x1)] over its capacitance.

    By reciprocity the charge of a rotation is the moment of a voltage, c (Lee and Moon, J. Appl. Mech. 57, 1990). The
    free capacitance of a patch is that of its layers; one that also drives the link is read through a bridge, which
    leaves this voltage (Dosch, Inman and Garcia, J. Intell. Mater. Syst. Struct. 3, 1992).
    """
    return patches.moment_per_volt / (patches.layout.capacitance() if capacitance is None else capacitance)


def volts_on_file(of_link: LinkPatches, layout: str, capacitance: float | None = None) -> dict[str, Array]:
    """By body that may carry a layout: (k, n) that its patches read per unit of the modes of the body's file."""
    volts, columns = volts_per_turn(of_link.arrays[layout], capacitance), of_link.columns(layout)
    return {name: volts[:, None] * of.turn[:, columns].T for name, of in of_link.bodies.items()}


def check_joint(model: Model, joint: str) -> None:
    """Raise `InputError` unless controllers can read and name the coordinates of a joint."""
    scene = model.scene
    record = next(each for each in scene.joint if each.name == joint)
    if not record.units or joint not in model.tree.carried:
        why = "at which a loop is cut" if record.units else "whose orientation is no list of coordinates"
        raise InputError(
            f"{scene.path}: sensor or controller: joint: expected one with coordinates, found"
            f' "{joint}", a {record.type} joint {why}'
        )
    if record.type == "planar" and model.tree.nodes[model.tree.carried[joint]].backwards:
        raise InputError(
            f"{scene.path}: {record.label}: between: expected the side nearer to the ground first where sensors read a"
            " planar joint, found it second"
        )


def rigid_freedom(model: Model) -> int:
    """How many independent joint coordinates the mechanism with rigid links has where it starts."""
    return mobility(model, undeformed_posture(model).q).freedom + len(model.tree.gears)


class RigidArm:
    """τ(γ, γ̇, γ̈) of all motors with rigid links, by the core, rotors and friction too, without loads.

    The motors' moments are the multipliers of γ = γ(t), affine in γ̈: one evaluation with γ̈ = 0, one for each motor.
    `q` (n_q,) of the tree of `model` is where its `angles` are. Raises `InputError` where the motors do not fit.
    """

    def __init__(self, model: Model, q: Array) -> None:
        freedom, count = rigid_freedom(model), sum(len(columns) for columns in model.motors.values())
        if count != freedom:
            raise InputError(
                f"{model.scene.path}: controller: expected motors that fit the mechanism ({freedom} of them), found"
                f" {count}"
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
        self._search = posture_search(self._model)
        self._system = MultibodySystem(self._model)
        self._q: Array = np.zeros(free.tree.n_q)
        for own, node in zip(free.tree.nodes, model.tree.nodes, strict=True):
            self._q[own.q] = q[node.q]

    def angles(self) -> Array:
        """(motors,) where it stands."""
        return constraint_values(self._model, self._q[None], np.zeros(1))[0][0, self._motors]

    def place(self, gamma: Array) -> tuple[Array, Array]:
        """Coordinates q (n_q,) and C_v at motor angles gamma, from the last place.

        Raises `SolveError` where the links do not reach these angles.
        """
        beside, now = np.zeros((1, len(self._model.rows))), np.zeros(1)
        beside[0, self._motors] = gamma
        q, left = self._model.constraints.postures(self._q[None], now, self._search, beside)
        if not left[0] <= MET:
            raise SolveError(
                f"{self._model.scene.path}: controller: expected joint angles that the rigid links can have, found"
                f" {np.round(gamma, 6)}, {left[0]:.2g} (rad, sizes of the robot) from such: smaller steps of the path,"
                " or a loop that stays nearer to it"
            )
        self._q = q[0]
        return self._q, constraint_values(self._model, q, now)[1][0]

    def terms(self, gamma: Array, gamma_dot: Array) -> tuple[Array, Array]:
        """M (motors, motors) and h (motors,) of τ = M γ̈ + h."""
        q, C_v = self.place(gamma)
        rates = np.zeros(len(C_v))
        rates[self._motors] = gamma_dot
        v: Array = np.linalg.pinv(C_v) @ rates
        self._system.core.keep_independent_rows(q, v)
        friction = -resistance(self._model, q[None], v[None])[0]

        def moments(target: Array) -> Array:
            signs = self._system.row_signs
            multipliers = self._system.core.evaluate(q, v, signs * target, friction, None)[1]
            return -(signs * multipliers)[self._motors]

        h = moments(np.zeros(len(C_v)))
        return np.column_stack([moments(unit) - h for unit in np.eye(len(C_v))[self._motors]]), h

    def moments(self, gamma: Array, gamma_dot: Array, gamma_ddot: Array) -> Array:
        """τ (motors,) N·m, or N."""
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
class LinkModes:
    """A flexible link: `mass` (kg), `length` (m), and the `stiffness` ω² (n,) (rad²/s²) of its modal coordinates p."""

    mass: float
    length: float
    stiffness: Array


@struct
class PatchedLink:
    """The k patches of one link, and the m coordinates of it that they are to serve, the lowest first."""

    inputs: tuple[str, ...]  # names of their voltages, which are those of their readings
    layouts: tuple[str, ...]  # names that sensors know them by
    omega: Array  # (m,) rad/s of these coordinates
    gain: Array  # (k, m) volts per force on each of these coordinates
    volts: Array  # (k, m) that the patches read per unit of each
    own: Array  # (m, n) these coordinates from all modal coordinates p of the link


@struct
class Robot:
    """A robot about the motion of an inverse analysis."""

    model: Model  # its constraint equations are those of loops alone, its gears do not give: see `linear`
    of_links: Mapping[str, LinkPatches]  # patches by link
    source: Outcome  # the inverse analysis

    @property
    def path(self) -> Path:
        """Of the scene."""
        return self.model.scene.path

    @property
    def motor_joints(self) -> tuple[str, ...]:
        """Names of joints with motors, in the order of commands."""
        return tuple(self.model.motors)

    @property
    def motors(self) -> tuple[str, ...]:
        """Names of the coordinates of motors: "NAME", or "NAME 1", "NAME 2" of joints with several."""
        return tuple(name for joint in self.model.motors for name in self.coordinates(joint))

    def coordinates(self, joint: str) -> tuple[str, ...]:
        """Of a joint: its name, or "NAME 1", "NAME 2" where there are several."""
        check_joint(self.model, joint)
        return tuple(name.removeprefix("joint/") for name, _ in labelled(self.model, joint))

    @property
    def elastic_joints(self) -> tuple[str, ...]:
        """Names of joints with compliant gears."""
        return tuple(node.joint.name for node in elastic_joints(self.model))

    @property
    def motors_fit(self) -> bool:
        """Whether there are as many motors as the mechanism with rigid links has freedom."""
        return len(self.motors) == rigid_freedom(self.model)

    @cached_property
    def links(self) -> Mapping[str, LinkModes]:
        """Flexible ones by name."""
        bodies = [node.body for node in self.model.tree.nodes if node.body.n_modes]
        return {body.name: LinkModes(body.mass, body.length or 1.0, body.stiffness) for body in bodies}

    @cached_property
    def patches(self) -> Mapping[str, PatchedLink]:
        """By link, with the modes that its layouts reach together."""
        return {name: self._patched(name, of_link) for name, of_link in self.of_links.items()}

    def _patched(self, name: str, of_link: LinkPatches) -> PatchedLink:
        reached, to_file = of_link.reached, self.model.tree.nodes[self.model.tree.index[name]].body.modal_transform
        inputs = [f"pzt/{layout}/{k}" for layout, of in of_link.arrays.items() for k in range(1, len(of.edges) + 1)]
        volts = np.vstack([volts_on_file(of_link, layout)[name] for layout in of_link.arrays])
        own = reached.coordinates(to_file.T).T
        return PatchedLink(
            tuple(inputs), tuple(of_link.arrays), np.sqrt(reached.stiffness[: reached.served]),
            voltage_gain(of_link.reach), reached.seen(volts), own,
        )  # fmt: skip

    def linear(self, row: int) -> tuple[LinearMechanism, Mapping[str, Array]]:
        """About output `row` of the motion, and what a unit of each voltage does along its s; with gears that give."""
        plant = with_compliance(self.model)
        moved = with_motor_coordinates(self.source, plant)
        linearisation = LinearEquations(plant, moved.q[row])
        found = linearisation.at(float(self.source.time[row]), moved.q[row], moved.v[row], moved.a[row])
        return found, voltages_at(plant, found, self.of_links)

    def rigid(self) -> RigidArm:
        """With rigid links. Raises `InputError` where the motors do not fit the mechanism."""
        return RigidArm(self.model, self.source.q[0])


def input_names(robot: Robot) -> tuple[str, ...]:
    """Names of all commands: motor moments "joint/NAME", then voltages "pzt/LAYOUT/k"."""
    voltages = [name for link in robot.patches.values() for name in link.inputs]
    return tuple([f"joint/{name}" for name in robot.motors] + voltages)


def estimate(volts: Array, count: int) -> Array:
    """(count, k) of coordinates from what patches read of them, volts (k, m): as many as patches distinguish."""
    return as_floats(np.linalg.pinv(volts[:, : min(volts.shape)])[:count])
