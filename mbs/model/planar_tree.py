"""A planar mechanism in joint coordinates, as the core's recursion integrates it (docs/developer/kernel.md).

It is made of what a `MechanismSystem` is made of: bodies hang on the joints of the spanning forest, the joints that
close loops and the trajectories are rows, loads act along coordinates of joints or on points.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .. import _core
from .._core import TimeFunction
from ..joints.measure import Marker, Measure
from .model import ZERO, Constraint
from .system import MechanismSystem
from .tree_cuts import TreeCuts, axis_of
from .tree_layout import FREE, Coordinate, Layout, Node, NotInTreeError, turned_by

COMPONENTS = {_core.MeasureKind.x: 0, _core.MeasureKind.y: 1, _core.MeasureKind.angle: 2, _core.MeasureKind.gear: 2}
"""Of a planar wrench, of the force along a measure whose direction is that of the ground."""

TRANSMITTED = {
    _core.MeasureKind.x: _core.JointComponent.x,
    _core.MeasureKind.y: _core.JointComponent.y,
    _core.MeasureKind.angle: _core.JointComponent.moment,
    _core.MeasureKind.slide: _core.JointComponent.across,
}
"""What of a joint's force and moment a constraint of it is, by the kind of its measure."""


class Share(NamedTuple):
    """Of a force along a measure, which acts `size` times on a component of the wrench on a marker."""

    marker: Marker
    component: int
    size: float


class PlanarTree:
    """A core model of a planar system in joint coordinates, and what acts on it.

    Attributes:
        core: bodies, joints, rows.
        scene: what rows follow, loads, friction.
        drives: where those drives of the system act whose forces are set from outside.
        bodies: number in the system of each body of the tree; after these it has what rotors turn beside it.
        both: the system and the tree, with what is one in the other.
        constraints: of the system that are rows of `core`: trajectories, and joints that are cut. After these come
            those of rotors beside the tree.
    """

    def __init__(self, assembly: MechanismSystem, motors: Iterable[Measure] = (), *, is_forced: bool = False) -> None:
        """`motors`: along which forces are to be found that take the place of those of trajectories.

        `is_forced`: forces from outside act along all joints. Raises `NotInTreeError`.
        """
        model, self._assembly, self._layout = assembly.model, assembly, Layout(assembly.model)
        of_bodies = [node for node in self._layout.nodes if node.beside is None]
        self.bodies = [assembly.index[node.body.name] for node in of_bodies]
        modes = {number: node.modes for number, node in zip(self.bodies, of_bodies, strict=True)}
        self.scene, self.drives = _core.TreeScene(), _core.DrivesOnTree([modes[k] for k in range(len(modes))])
        self._wrenches: dict[Marker, int] = {}
        self._turned_by_wrenches: set[Marker] = set()
        self._along: list[tuple[Array, TimeFunction]] = []
        self._at_points: list[tuple[int, int, float, TimeFunction]] = []
        self._driven: set[int] = set(range(self._layout.size)) if is_forced else set()
        self._rotors: dict[int, tuple[float, float]] = {}
        self._cuts = TreeCuts(self.scene, self._wrench)
        cut = self._layout.cut
        self.constraints = tuple(c for c in assembly.constraints if c.is_trajectory or c.owner in cut)
        rows = [self._row(constraint) for constraint in self.constraints]
        rows += [self._turned(node) for node in self._layout.nodes[len(of_bodies) :]]
        self._add_loads()
        self._add_what_joints_have()
        reactions = self._reactions(motors)
        self.scene.keeps_all_rows, self.scene.has_loops = True, bool(cut)
        self.scene.most_bent = [node.body.inertia for node in self._layout.nodes]
        wrenches = [self._layout.place(marker) for marker in self._wrenches]
        for at, marker in zip(wrenches, self._wrenches, strict=True):
            at.only_forces = marker not in self._turned_by_wrenches
        bodies = [self._body(number, node) for number, node in enumerate(self._layout.nodes)]
        self.core = _core.PlanarModel(
            bodies, self._layout.ground_markers(), rows, wrenches, np.array(model.scene.gravity)
        )
        self.both = _core.SystemOnTree(assembly.system, self.core, self.scene, self.bodies, self.drives, reactions)

    def state(self, q: Array, v: Array) -> tuple[Array, Array]:
        """(q, v) of the tree for those of the system, (coordinates,) each."""
        found = self.motion(q, v, np.zeros_like(v))
        return found[0], found[1]

    def motion(self, q: Array, v: Array, a: Array) -> Array:
        """Coordinates of the tree, their rates and accelerations (3, …, n_v), for those of the system (…, coordinates).

        The dots: nothing, or times.
        """
        times, system = q.shape[:-1], [np.ascontiguousarray(np.atleast_2d(values)) for values in (q, v, a)]
        found = np.zeros((3, len(system[0]), self._layout.size))
        for number, node in zip(self.bodies, self._layout.nodes, strict=False):
            first, n = int(self._assembly.first[number]), node.body.n_modes
            for of_tree, of_system in zip(found, system, strict=True):
                of_tree[:, node.modes : node.modes + n] = of_system[:, first + 3 : first + 3 + n]
                if node.kind == FREE.kind:
                    of_tree[:, node.first : node.modes] = of_system[:, first : first + 3]
        measures, coordinates = self._joints()
        along = [(measure, order) for order in range(3) for measure in measures]
        readings = _core.Sensing(self._assembly.system, along, []).read(*system)
        indices, signs = [c.number for c in coordinates], np.array([c.sign for c in coordinates])
        found[:, :, indices] = signs * readings.reshape(len(readings), 3, -1).swapaxes(0, 1)
        return found.reshape(3, *times, -1)

    def evaluate(
        self, t: float, q: Array, v: Array, steering: _core.ExternalLoads | None = None
    ) -> tuple[Array, Array]:
        """Accelerations (coordinates,) and multipliers (constraints,) of the system at a state of it, as it is.

        Under `steering` from outside, if any.
        """
        found = self.both.at(t, *self.state(q, v), steering)
        return found.a[0], found.multipliers[0]

    @property
    def modes(self) -> dict[str, range]:
        """Where p of each body is in q and v."""
        nodes = self._layout.nodes
        return {node.body.name: range(node.modes, node.modes + node.body.n_modes) for node in nodes}

    @property
    def layout(self) -> Layout:
        """Which coordinate is whose."""
        return self._layout

    def given_forces(self, t: float) -> tuple[Array, Array]:
        """Of the loads at time t: along v (n_v,), and on the wrenches of `core` (3 wrenches,); N, N·m."""
        force, wrench = np.zeros(self._layout.size), np.zeros((len(self._wrenches), 3))
        for direction, magnitude in self._along:
            force += magnitude(t)[0] * direction
        for number, component, size, magnitude in self._at_points:
            wrench[number, component] += size * magnitude(t)[0]
        return force, wrench.ravel()

    def _joints(self) -> tuple[list[_core.Measure], list[Coordinate]]:
        """Measures that are coordinates of the tree: of joints, of motors behind gears, of rotors beside it."""
        joints = [joint.coordinate("section") for joint in self._assembly.model.scene.joint]
        moving = [m for m in joints if m is not None] + [gear.motor for gear in self._assembly.model.gears]
        measures = [*self._assembly.joint_measures, *self._assembly.gear_measures]
        found = [(core, self._layout.coordinate(m)) for core, m in zip(measures, moving, strict=True)]
        in_tree = [(core, coordinate) for core, coordinate in found if coordinate is not None]
        for node in self._layout.nodes:
            if node.beside is not None:
                in_tree.append((self._assembly.core_measure(node.beside), self._in_tree(node.beside)))
        return [core for core, _ in in_tree], [coordinate for _, coordinate in in_tree]

    @property
    def row_signs(self) -> Array:
        """(rows,) −1 where the row, its target and its multiplier count the tree's coordinate, not the joint's."""
        found = [self._layout.coordinate(constraint.measure) for constraint in self.constraints]
        return np.array([1.0 if coordinate is None else coordinate.sign for coordinate in found])

    def _row(self, constraint: Constraint) -> _core.RowModel:
        measure, found = constraint.measure, _core.RowModel()
        found.name = measure.label.partition(",")[0]
        coordinate = self._layout.coordinate(measure)
        self.scene.add_target(constraint.target, 1.0 if coordinate is None else coordinate.sign)
        if coordinate is not None:
            found.kind, found.coordinate = _core.RowKind.coordinate, coordinate.number
            return found
        if measure.kind == _core.MeasureKind.gear:
            raise NotInTreeError(f"a constraint of a ratio of angles ({measure.label})")
        if measure.kind == _core.MeasureKind.slide:
            found.kind, found.f = _core.RowKind.slide, np.array([*measure.direction, 0.0])
        else:
            component = COMPONENTS[measure.kind]
            found.kind = _core.RowKind.rotation if component == 2 else _core.RowKind.point
            found.f = np.eye(3)[component]
        found.a, found.b = self._layout.place(measure.a), self._layout.place(measure.b, -measure.offset)
        return found

    def _turned(self, node: Node) -> _core.RowModel:
        """What a rotor beside the tree turns by, or goes, is what it measures."""
        assert node.beside is not None
        found = _core.RowModel()
        found.name, found.coordinate, found.f = node.beside.label, node.first, axis_of(node.beside)
        found.kind = _core.RowKind.rotation if node.beside.carries_moment else _core.RowKind.slide
        found.a, found.b = self._layout.place(node.beside.a), self._layout.place(node.beside.b)
        self.scene.add_target(ZERO, 1.0)
        return found

    def _add_loads(self) -> None:
        """The drives of the system: `drives` has where they act, `scene` their magnitudes, and forces of the motion."""
        for number, (measure, magnitude) in enumerate(self._assembly.drives):
            if (coordinate := self._layout.coordinate(measure)) is not None:
                self._driven.add(coordinate.number)
                self.drives.add_along(number, coordinate.number, coordinate.sign)
                if magnitude is not ZERO:
                    self._along.append((coordinate.sign * np.eye(self._layout.size)[coordinate.number], magnitude))
                continue
            if measure.kind == _core.MeasureKind.slide:
                self.drives.add_along_cut(number, self._cuts.along(measure))
                if magnitude is not ZERO:
                    self.scene.add_cut_load(self._cuts.along(measure), magnitude)
                continue
            for marker, component, size in _shares(measure):
                wrench = self._wrench(marker, has_moment=component == COMPONENTS[_core.MeasureKind.angle])
                self.drives.add_at_point(number, wrench, component, size)
                if magnitude is not ZERO:
                    self._at_points.append((wrench, component, size, magnitude))
        for marker, function in self._assembly.model.state_forces:
            self.scene.add_point_force(self._wrench(marker), function)
        for load in self._assembly.model.modal_loads:
            node = next(node for node in self._layout.nodes if node.body.name == load.body)
            direction: Array = np.zeros(self._layout.size)
            direction[node.modes : node.modes + node.body.n_modes] = load.vector
            self._along.append((direction, load.magnitude))
        for direction, magnitude in self._along:
            self.scene.add_load(direction, magnitude)
        for wrench, component, size, magnitude in self._at_points:
            self.scene.add_point_load(wrench, component, magnitude, size)

    def _reactions(self, motors: Iterable[Measure]) -> _core.ReactionsOnTree:
        """What the constraints of the system are in the tree, and `motors`."""
        found, signs = _core.ReactionsOnTree(), self.row_signs
        rows = {constraint: k for k, constraint in enumerate(self.constraints)}
        nodes = {node.joint.name: k for k, node in enumerate(self._layout.nodes) if node.joint is not None}
        rotors = {node.gear.rotor: node.body for node in self._layout.nodes if node.gear is not None}
        for number, constraint in enumerate(self._assembly.constraints):
            if (row := rows.get(constraint)) is not None:
                found.add_row(number, row, signs[row], constraint.is_trajectory)
            elif constraint.owner in rotors:
                g = self._assembly.model.scene.gravity[COMPONENTS[constraint.measure.kind]]
                found.add_weight(number, rotors[constraint.owner].mass * g)
            else:
                node = nodes[constraint.owner]
                component = TRANSMITTED[constraint.measure.kind]
                found.add_joint(number, node, component, self._layout.nodes[node].backwards)
        for measure in motors:
            if (motor := self._layout.motor(measure)) is not None:
                found.add_motor(*motor)
            else:
                found.add_motor_along_cut(self._cuts.along(measure))
        return found

    def _wrench(self, marker: Marker, *, has_moment: bool = True) -> int:
        if has_moment:
            self._turned_by_wrenches.add(marker)
        return self._wrenches.setdefault(marker, len(self._wrenches))

    def _add_what_joints_have(self) -> None:
        """Friction, rotors, gears that give."""
        model = self._assembly.model
        for measure, friction in model.frictions:
            if (coordinate := self._layout.coordinate(measure)) is None:
                self._cuts.resist(measure, friction)
                continue
            index = coordinate.number
            self._driven.add(index)
            self.scene.add_joint_force(index, index, 0.0, 0.0, friction.viscous, friction.coulomb, friction.speed)
        for measure, inertia in model.rotors:
            is_gear = measure.kind == _core.MeasureKind.gear
            index, sign = self._in_tree(turned_by(measure))
            # it sits on the first side and spins with N Ω_second − (N − 1) Ω_first
            N = measure.gear_ratios[0] if is_gear else 1.0
            self._rotors[index] = inertia, 1.0 - N if is_gear and sign < 0 else N
        for gear in model.gears:
            motor, _ = self._in_tree(gear.motor)
            self._driven.add(motor)
            self._rotors[motor] = gear.inertia, gear.ratio
            if (coordinate := self._layout.coordinate(gear.coordinate)) is not None:
                joint, sign = coordinate
                self._driven.add(joint)
                self.scene.add_gear((motor, motor), (joint, joint), sign, gear.stiffness, gear.damping)
            else:
                self._cuts.add_gear(gear, motor)

    def _in_tree(self, measure: Measure) -> Coordinate:
        """Of what has a coordinate of its own, in the tree or beside it."""
        coordinate = self._layout.coordinate(measure)
        assert coordinate is not None, measure.label
        return coordinate

    def _body(self, number: int, node: Node) -> _core.PlanarBody:
        body = _core.PlanarBody()
        body.name, body.data = node.body.name, self._layout.data(number)
        body.parent, body.parent_marker, body.inboard_marker = node.inner.body, node.inner.marker, node.outer.marker
        body.joint = node.kind
        coordinates = range(node.first, node.modes)
        body.driven = not self._driven.isdisjoint(coordinates)
        # Else the core may take the frame's coordinates where modes turn the section: same motion, other numbers.
        body.of_section = bool(np.any(body.data.markers[node.outer.marker].Phi))
        for index in self._rotors.keys() & coordinates:
            body.rotor_inertia, body.gear_ratio = self._rotors[index]
        return body


def told_in_joints(assembly: MechanismSystem, kind: str, motors: Iterable[Measure] = ()) -> PlanarTree:
    """The tree of an analysis that knows no other coordinates. Raises `InputError` for what cannot be told in it."""
    try:
        return PlanarTree(assembly, motors)
    except NotInTreeError as why:
        raise InputError(
            f'{assembly.model.scene.path}: expected for kind = "{kind}" quantities that joint coordinates define,'
            f" found {why}"
        ) from None


def _shares(measure: Measure) -> Iterator[Share]:
    """Of a force along a measure that is no coordinate of the tree, and does not turn with its first side."""
    of_b, of_a = measure.angle_ratios
    for marker, size in ((measure.b, of_b), (measure.a, -of_a)):
        if marker.body is not None:
            yield Share(marker, COMPONENTS[measure.kind], size)
