"""Readings of sensors by name, as linear models name them: joints, motors, points, patches, modes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...common.structs import struct
from ...mbs.linear.linearisation import labelled
from ...mbs.model.drives import Drives, PointDrive
from ...mbs.model.known_motion import KnownStates, motion_forces
from ...mbs.model.model import Model, modal_directions
from ...mbs.model.nodes import Section
from ...mbs.model.system import MultibodySystem
from ...mbs.model.tree import KinematicTree
from ...mbs.run.context import WholeLinks, place_of
from ...mbs.scene.space import SPACES
from ..patches.link_patches import LinkPatches
from ..patches.patches import PatchArray
from .records import PERMITTIVITY, Sensor

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
    capacitance of a patch is ε w l/t_p of each layer; one that also drives the link is read through a bridge, which
    leaves this voltage (Dosch, Inman and Garcia, J. Intell. Mater. Syst. Struct. 3, 1992).
    """
    layout = patches.layout
    faces = 2 if layout.face == "both" else 1
    own = faces * layout.layers * PERMITTIVITY * layout.width * layout.length / layout.thickness
    return patches.moment_per_volt / (own if capacitance is None else capacitance)


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
