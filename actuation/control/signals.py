"""Readings of sensors by name, as in linear models: joints, motors, points, patches, modes. SI units."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field
from typing import Any, get_args

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, check_known, quoted
from ...common.structs import struct
from ...mbs.linear.linearisation import LinearMechanism, labelled
from ...mbs.model.drives import Drives, PointDrive
from ...mbs.model.known_motion import KnownStates, motion_forces
from ...mbs.model.model import Model
from ...mbs.model.nodes import Section
from ...mbs.model.system import MultibodySystem
from ...mbs.run.context import WholeLinks, place_of, strain_directions
from ...mbs.scene.space import SPACES
from ..context import ActuatedContext
from .records import Measure, Sensor

ORDERS = {measure: order for order, measure in enumerate(get_args(Measure))}
STEP = 2.0**-13  # of differences of readings of points, in rad, m, √kg·m and these per s


@struct
class Signal:
    """One reading, SI: coordinate `axis` (0, 1, 2) of a `point`, or `along` (n_v,) times joint and modal coordinates.

    `by_volts` (k,) times voltages of all patches is added, by strains that modes lack.
    `name`: "joint/NAME", "motor/NAME", "point/BODY.POINT/x" or y or z, "strain/BODY.POINT", "pzt/LAYOUT/k",
    "modal/BODY/k" (k from 1), followed by "/rate", … where that is measured.
    """

    name: str
    sensor: Sensor
    along: Array = field(default_factory=lambda: np.zeros(0))
    by_volts: Array | float = 0.0
    point: str = ""
    axis: int = 0

    @property
    def order(self) -> int:
        """Order of the time derivative that is measured: 0, 1 or 2 (from `ORDERS`)."""
        return ORDERS[self.sensor.measure]


class Sensing:
    """Readings of signals in states of a model; SI units."""

    def __init__(self, model: Model, read: Sequence[Signal]) -> None:
        tree = model.tree
        self._tree, self.signals = tree, read
        self._linear = np.array([k for k, signal in enumerate(read) if not signal.point], dtype=int)
        self._by_volts = [k for k, signal in enumerate(read) if np.any(signal.by_volts)]
        self._order = np.array([read[k].order for k in self._linear], dtype=int)
        self._along = np.reshape([read[k].along for k in self._linear], (len(self._linear), tree.n_v))
        # (n_v,) index in q of the coordinate of each rate; for orientations another one, which nothing reads
        self._where = np.zeros(tree.n_v, dtype=np.intp)
        for node in tree.nodes:
            if node.joint.q_count == node.joint.freedoms:
                self._where[node.v] = np.arange(node.q.start, node.q.stop)
            self._where[node.p_v] = np.arange(node.p_q.start, node.p_q.stop)
        sections = {signal.point: tree.section(signal.point) for signal in read if signal.point}
        self._points: list[tuple[str, Section, int, list[int], list[int]]] = []  # by order: where in readings, axes
        for point, order in dict.fromkeys((s.point, s.order) for s in read if s.point):
            columns = [k for k, s in enumerate(read) if (s.point, s.order) == (point, order)]
            self._points.append((point, sections[point], order, columns, [read[k].axis for k in columns]))
        accelerated = any(signal.point and signal.order in (2, 3) for signal in read)
        self._gravity = np.zeros(3)
        self._gravity[: len(model.scene.gravity)] = model.scene.gravity
        drives = Drives(at_points=tuple(PointDrive(point, {}) for point in sections))
        self._system = MultibodySystem(model, drives) if accelerated else None

    def read(self, q: Array, v: Array, a: Array, V: Array | None = None) -> Array:
        """Readings (T, signals), SI units, in states q (T, n_q), v and a (T, n_v), under voltages V (T, k)."""
        found = np.zeros((len(q), len(self.signals)))
        values = q[:, self._where] @ self._along.T, v @ self._along.T
        found[:, self._linear] = np.where(self._order == ORDERS["value"], *values)
        if V is not None:
            for k in self._by_volts:
                found[:, k] += V @ self.signals[k].by_volts
        if not self._points:
            return found
        places, forces = self._tree.places(q, v), None
        if self._system is not None:
            none = np.zeros((len(q), len(self._system.model.rows)))
            forces = motion_forces(self._system, KnownStates(q, v, a), np.zeros(len(q)), none)
        for point, section, order, columns, axes in self._points:
            at = places.at(section)
            a = at.r if forces is None else forces.of_point(point).a
            of = (at.r, at.velocity, a, a - self._gravity, at.omega)[order]
            in_axes = order >= ORDERS["accelerometer"]
            found[:, columns] = (np.einsum("tij,ti->tj", at.F, of) if in_axes else of)[:, axes]
        return found

    def rows(self, about: LinearMechanism) -> tuple[Array, Array, Array]:
        """Derivatives (signals, f) of readings by s, ṡ and s̈, SI units, for a linear mechanism of the same tree.

        Exact of coordinates; of points by differences, to 1e-11. In moving loops the second rate of ∂q/∂s is left out.
        """
        n_v = self._tree.n_v
        H, H_dot = about.transformation[:n_v], about.transformation_rate[:n_v]
        zero = np.zeros_like(H)
        steps = np.concatenate([[H, H_dot, zero], [zero, H, 2 * H_dot], [zero, zero, H]], axis=2)  # of q, v and a
        found = np.zeros((len(self.signals), steps.shape[2]))
        of_rates = self._order == ORDERS["rate"]
        found[self._linear] = np.where(of_rates[:, None], self._along @ steps[1], self._along @ steps[0])
        if self._points:
            dq, dv, da = (STEP * np.concatenate([k * step.T for k in (1.0, -1.0, 2.0, -2.0)]) for step in steps)
            read = self.read(self._tree.integrate(about.q, dq), about.v + dv, about.a + da)
            ahead, behind, far, farther = read.reshape(4, -1, len(self.signals))
            slopes = (8 * (ahead - behind) - (far - farther)).T / (12 * STEP)
            others = np.setdiff1d(np.arange(len(self.signals)), self._linear)
            found[others] = slopes[others]
        by_s, by_rate, by_acceleration = np.split(found, 3, axis=1)
        return by_s, by_rate, by_acceleration


def readings_at(model: Model, mechanism: LinearMechanism, read: Sequence[Signal]) -> dict[str, Sequence[Any]]:
    """Return, by name, each reading's derivatives by s, ṡ, s̈ (f,) of the `mechanism` and by voltages (k,), SI."""
    rows = zip(read, *Sensing(model, read).rows(mechanism), strict=True)
    return {signal.name: (*slopes, signal.by_volts) for signal, *slopes in rows}


def make_signals(
    model: Model, context: ActuatedContext, sensors: Iterable[Sensor], whole: WholeLinks | None = None
) -> list[Signal]:
    """The readings of sensors of the scene, in order; `whole`: links that the model has subdivided.

    Raises `InputError` for a joint without coordinates in the tree, and for strain where the link has no such point.
    """
    return [signal for sensor in sensors for signal in _of_sensor(model, context, sensor, whole)]


def _of_sensor(model: Model, context: ActuatedContext, sensor: Sensor, whole: WholeLinks | None) -> Iterator[Signal]:
    ending = "" if sensor.measure == "value" else f"/{sensor.measure}"
    volts, links = strain_directions(model, context.patches), context.patches.values()
    if sensor.joint is not None:
        check_joint(model, sensor.joint)
        sign = model.tree.nodes[model.tree.carried[sensor.joint]].sign
        for name, k in labelled(model, sensor.joint):
            yield Signal(f"{name}{ending}", sensor, along=sign * np.eye(model.tree.n_v)[k])
    elif sensor.motor is not None:
        k = model.driven(sensor.motor).v.start
        yield Signal(f"motor/{sensor.motor}{ending}", sensor, along=np.eye(model.tree.n_v)[k])
    elif sensor.point is not None:
        place, space = place_of(whole, sensor.point), SPACES[model.scene.space]
        for axis in space.rotations if sensor.measure == "gyro" else space.translations:
            yield Signal(f"point/{sensor.point}/{'xyz'[axis]}{ending}", sensor, point=place, axis=axis)
    elif sensor.pzt is not None:
        of_link = next(of for of in links if sensor.pzt in of.arrays)
        C = np.sum([of.capacitance for name, of in of_link.bodies.items() if name in model.tree.index], axis=0)
        C = C if sensor.capacitance is None else sensor.capacitance * np.eye(len(C))
        by_charge = np.linalg.inv(C)[of_link.columns(sensor.pzt)]
        along = by_charge @ model.modal_directions({name: of.charge for name, of in of_link.bodies.items()})
        by_volts = -model.compliance(along, volts)
        by_volts[:, [of is of_link for of in links for _ in of.edges]] += by_charge @ of_link.static
        for k, pair in enumerate(zip(along, by_volts, strict=True), 1):
            yield Signal(f"pzt/{sensor.pzt}/{k}", sensor, *pair)
    elif sensor.modal is not None:
        for k, along in enumerate(_modal_coordinates(model, sensor.modal, whole), 1):
            yield Signal(f"modal/{sensor.modal}/{k}{ending}", sensor, along=along)
    elif sensor.strain is not None:
        link, _, place = sensor.strain.partition(".")
        points = context.links[link].stress
        wanted = f'a point of [stress] in the link file of "{link}" ({quoted(points)})'
        check_known(place, points, f"sensor: strain: expected {wanted}")
        coordinates = _modal_coordinates(model, link, whole)
        tree, at, of = (model if whole is None else whole.model).tree, points[place], context.patches.get(link)
        body = tree.nodes[tree.index[link]].body
        row = at.strain[0] @ body.modal_transform
        is_beside = of is not None and of.is_beside(at.position)
        if is_beside:  # modes bend here, too, where patches do
            row = np.linalg.solve(context.links[link].stiffness, at.strain[0]) @ body.on_file.T * body.stiffness
        along = row @ coordinates
        yield Signal(f"strain/{sensor.strain}", sensor, along, -is_beside * model.compliance(along[None], volts)[0])


def filters(read: Sequence[Signal], T: float) -> tuple[Array, Array, Array, Array]:
    """Discrete A (m, m), B (m, p), C (p, m), D (p, p) from true values to p readings, in the unit of each.

    High-pass filters, exact for values that change linearly between samples every T (s), come before delays.
    """
    p = len(read)
    A, B, C, D = np.zeros((0, 0)), np.zeros((0, p)), np.zeros((p, 0)), np.eye(p)

    def joined(k: int, own: tuple[float, float, float, float]) -> None:  # in series behind reading k
        nonlocal A, B, C
        a, b, c, d = own
        A = np.block([[A, np.zeros((len(A), 1))], [b * C[k : k + 1], np.array([[a]])]])
        B = np.vstack([B, b * D[k]])
        D[k] *= d
        C = np.hstack([C, np.zeros((p, 1))])
        C[k] *= d
        C[k, -1] = c

    for k, sensor in enumerate(signal.sensor for signal in read):
        if sensor.high_pass is not None:
            rate = 2 * np.pi * sensor.high_pass * T
            a, b = np.exp(-rate), -np.expm1(-rate) / rate
            joined(k, (float(a), float((a - 1) * b), 1.0, float(b)))
        for _ in range(round(sensor.delay / T)):
            joined(k, (0.0, 1.0, 1.0, 0.0))
    return A, B, C, D


class Filter:
    """Filter of samples, one after the other (see `filters`); settled at the first sample."""

    def __init__(self, read: Sequence[Signal], T: float) -> None:
        self._matrices = filters(read, T)
        self._w: Array | None = None

    def __call__(self, y: Array) -> Array:
        """Readings (signals,) for their true values y (signals,) at the next sample."""
        A, B, C, D = self._matrices
        if not len(A):
            return y
        w = np.linalg.solve(np.eye(len(A)) - A, B @ y) if self._w is None else self._w
        self._w = A @ w + B @ y
        return C @ w + D @ y


def merged(given: Iterable[Signal], needed: Iterable[Signal]) -> tuple[Signal, ...]:
    """Join the scene's sensors and the ideal ones that controllers need; the scene's win where names are equal."""
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


def check_joint(model: Model, joint: str) -> None:
    """Raise `InputError` unless controllers can read and name the coordinates of a joint."""
    scene = model.scene
    record = next(each for each in scene.joint if each.name == joint)
    if not record.units or joint not in model.tree.carried:
        why = "at which a loop is cut" if record.units else "whose orientation is no list of coordinates"
        raise InputError(
            "sensor or controller: joint: expected one with coordinates",
            f'"{joint}", a {record.type} joint {why}',
        )
    if record.type == "planar" and model.tree.nodes[model.tree.carried[joint]].backwards:
        raise InputError(
            f"{record.label}: between: expected the side nearer to the ground first where sensors read a planar joint",
            "it second",
        )
