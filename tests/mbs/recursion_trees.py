"""Planar mechanisms of scenes as trees for the recursion, and the states of both in one another's coordinates."""

from dataclasses import dataclass

import numpy as np
from marker_measures import Kind
from mechanisms import random_state

from ffrobot.mbs import _core

r = _core


def planar_data(body):
    """The invariants of a `PlanarBody`; markers are added by whoever uses them."""
    data = r.PlanarData()
    data.mass, data.inertia, data.first_moment = body.mass, body.inertia, body.first_moment
    data.stiffness, data.damping = body.stiffness, body.damping
    data.S_bar, data.h, data.j = body.S_bar, body.h, body.j
    data.S_tilde, data.m_xy = body.S_tilde, body.m_xy
    if body.stiffening is not None:
        data.K, data.m_xy = body.stiffening.by_affine_fields, body.m_xy + body.stiffening.rotary
    return data


class Markers:
    """Markers of one body (or of the ground), each point and angle once; number 0 is the frame."""

    def __init__(self, body=None):
        self.body, self.list, self.numbers = body, [], {}
        self("", (0.0, 0.0), 0.0)

    def __call__(self, point, position=(0.0, 0.0), angle=0.0):
        key = (point, *position, angle)
        if key not in self.numbers:
            self.numbers[key] = len(self.list)
            self.list.append(self._marker(point, position, angle))
        return self.numbers[key]

    def _marker(self, point, position, angle):
        marker = r.PlanarMarker()
        marker.position, marker.angle = np.array(position, dtype=float), angle
        marker.Phi = np.zeros((3, self.body.n_modes if self.body else 0))
        if self.body and point:
            at = self.body.points[point]
            marker.position, marker.Phi = at.position, np.vstack([at.translation, at.rotation])
            if self.body.stiffening is not None:
                marker.K = list(self.body.stiffening.K_points.get(point, []))
        return marker


@dataclass
class Tree:
    """A model of the recursion with the order of its bodies and rows in terms of the assembly's."""

    model: object
    bodies: list  # index in the assembly of each body of the tree
    rows: list  # index in the assembly's constraints of each row
    assembly: object

    def random_state(self, rng):
        """Any q and v."""
        return random_state(rng, self.model.n_v)

    def from_tree(self, q, v, a=None):
        """q, v and, after an evaluation, accelerations of the assembly for those of the tree."""
        first = self.assembly.first
        Q, V, A = (np.zeros(self.assembly.size) for _ in range(3))
        frames = self.model.frames(q, v)
        for k, (i, frame) in enumerate(zip(self.bodies, frames, strict=True)):
            n = self.assembly.model.bodies[i].n_modes
            _, p_q, _, p_v = self.model.first[k]
            here = slice(first[i], first[i] + 3 + n)
            Q[here] = [*frame.r[:2], frame.angle, *q[p_q : p_q + n]]
            V[here] = [*frame.v[:2], frame.omega[2], *v[p_v : p_v + n]]
            if a is not None:
                A[here] = [*frame.a[:2], frame.alpha[2], *a[p_v : p_v + n]]
        return Q, V, A


def side(marker, markers, angle=0.0):
    """(body, marker number), body None for the ground."""
    if marker.body is None:
        return None, markers[None]("", marker.position, angle)
    return marker.body, markers[marker.body](marker.point, angle=angle)


def groups(assembly):
    """Constraints of joints by owner, in the order of the scene, and the trajectories."""
    by_owner = {}
    for i, constraint in enumerate(assembly.constraints):
        by_owner.setdefault((constraint.is_trajectory, constraint.owner), []).append(i)
    return by_owner


def joint_of(assembly, indices):
    """Kind, axis angle and angle offset of a joint by its constraint rows."""
    measures = {assembly.constraints[i].measure.kind: assembly.constraints[i].measure for i in indices}
    offset = measures[Kind.angle].offset if Kind.angle in measures else 0.0
    if Kind.slide in measures:
        x, y = measures[Kind.slide].direction  # across the axis
        return r.JointKind.prismatic, float(np.arctan2(-x, y)), offset
    return (r.JointKind.weld if Kind.angle in measures else r.JointKind.revolute), 0.0, offset


def row_of(measure, markers, number):
    """A `ConstraintModel` of a measure."""
    row = r.ConstraintModel()
    row.name = measure.label
    (body_a, a), (body_b, b) = side(measure.a, markers), side(measure.b, markers)
    row.a, row.b = r.MarkerAt(number[body_a], a), r.MarkerAt(number[body_b], b)
    row.kind, row.f = {
        Kind.x: lambda: (r.ConstraintKind.point, np.array([1.0, 0, 0])),
        Kind.y: lambda: (r.ConstraintKind.point, np.array([0, 1.0, 0])),
        Kind.angle: lambda: (r.ConstraintKind.rotation, np.array([0, 0, 1.0])),
        Kind.slide: lambda: (r.ConstraintKind.slide, np.array([*measure.direction, 0.0])),
    }[measure.kind]()
    return row


def is_within_reach(assembly, indices, placed):
    measure = assembly.constraints[indices[0]].measure
    return measure.a.body in placed or measure.b.body in placed


def tree_of(assembly, free=False, wrenches=(), driven=False):
    """The mechanism of an assembly; `free`: every body on a free joint, all joints rows.

    wrenches: markers of measures.
    """
    model = assembly.model
    markers = {None: Markers(), **{body.name: Markers(body) for body in model.bodies}}
    placed, order, cuts = {None}, [], []
    joints = {owner: indices for (is_path, owner), indices in groups(assembly).items() if not is_path}
    names = [] if free else [joint.name for joint in model.scene.joint]
    free_bodies = [body.name for body in model.bodies]
    while set(free_bodies) - placed:
        while name := next(
            (name for name in names if name in joints and is_within_reach(assembly, joints[name], placed)), None
        ):
            indices = joints.pop(name)
            measure = assembly.constraints[indices[0]].measure
            if {measure.a.body, measure.b.body} <= placed:
                cuts += indices
                continue
            kind, axis, offset = joint_of(assembly, indices)
            a_there = measure.a.body in placed
            inner, outer = (measure.a, measure.b) if a_there else (measure.b, measure.a)
            angles = (axis, axis - offset) if a_there else (axis - offset, axis)
            order.append((outer.body, kind, side(inner, markers, angles[0]), side(outer, markers, angles[1])[1]))
            placed.add(outer.body)
        if loose := [name for name in free_bodies if name not in placed]:
            order.append((loose[0], r.JointKind.free, (None, 0), 0))
            placed.add(loose[0])
    if free:
        cuts = [i for indices in joints.values() for i in indices]
    number = {None: -1, **{name: k for k, (name, *_) in enumerate(order)}}
    paths = [i for (is_path, _), indices in groups(assembly).items() if is_path for i in indices]
    kept = sorted(cuts + paths)
    rows = [row_of(assembly.constraints[i].measure, markers, number) for i in kept]
    loaded = [r.MarkerAt(number[body], at) for body, at in (side(marker, markers) for marker in wrenches)]
    bodies = []
    for name, kind, (parent, parent_marker), inboard in order:
        body = r.PlanarBody()
        body.name, body.joint, body.parent = name, kind, number[parent]
        body.parent_marker, body.inboard_marker, body.driven = parent_marker, inboard, driven
        data = planar_data(next(b for b in model.bodies if b.name == name))
        data.markers = markers[name].list
        body.data = data
        bodies.append(body)
    built = r.PlanarModel(bodies, markers[None].list, rows, loaded, np.array(model.scene.gravity[:2]))
    return Tree(built, [assembly.index[name] for name, *_ in order], kept, assembly)
