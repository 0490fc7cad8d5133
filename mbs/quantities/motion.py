"""Motion of bodies, sections and joints in a run, and how well it meets the constraint equations.

All arrays are over the output times (T, …), SI units, global axes unless a name says otherwise.
"""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.rotations import of_quaternion, quaternions
from ...common.structs import kept
from ..model.body import bent_section
from ..model.drives import Drives, PointDrive
from ..model.kinematics import Motion, Places
from ..model.known_motion import MotionForces, motion_forces, row_accelerations
from ..model.masses import turns_as_a_body
from ..model.nodes import Node, Section
from ..model.system import MultibodySystem
from ..model.tree import CutCoordinate, CutMotion
from ..run.record import Run
from .bodies import BodyMotion, PointMotion, continuous, motion_of_link


@kept
def places(run: Run) -> Places:
    """Places of frames and sections, and their velocities."""
    return run.model.tree.places(run.q, run.v)


@kept
def system_of(run: Run) -> MultibodySystem:
    """The equations of motion, with drives on all points where payloads sit."""
    scene = run.model.scene
    payloads = (PointDrive(load.point, {}) for load in scene.payload if not turns_as_a_body(scene, load))
    return MultibodySystem(run.model, Drives(at_points=(*run.applied, *payloads)))


@kept
def acting_forces(run: Run) -> MotionForces:
    """Return the forces between bodies and in joints of a run."""
    return motion_forces(system_of(run), run, run.time, run.multipliers)


@kept
def constraint_rows(run: Run) -> tuple[Array, Array]:
    """C (T, rows) and C_v (T, rows, n_v)."""
    return run.model.constraints.values(run.q, run.time)


@kept
def cut_motions(run: Run) -> list[tuple[CutCoordinate, CutMotion]]:
    """Coordinates of joints at which loops are cut."""
    motions = run.model.along_cut.motions(run.q, run.v, run.time)
    return list(zip(run.model.cut, motions, strict=True))


def constraint_violation(run: Run) -> Array:
    """Return (T, 3) of C, Ċ, C̈: largest row over 1 + that of q, v, a; of an equilibrium, C alone."""
    levels = [(constraint_rows(run)[0], run.q)]
    if not run.is_at_rest:
        C_dot = run.model.constraints.rates(run.q, run.v, run.time)
        levels += [(C_dot, run.v), (row_accelerations(system_of(run), run, run.time), run.a)]
    off = np.zeros((len(run.time), 3))
    for k, (values, size) in enumerate(levels):
        off[:, k] = np.abs(values).max(axis=1, initial=0.0) / (1 + np.abs(size).max(axis=1, initial=0.0))
    return off


def reported_points(run: Run) -> dict[str, tuple[str, ...]]:
    """Names of the reported sections of each body, in the scene's order; divided links at their first piece."""
    first = {link.names[0]: name for name, link in run.links.items()}
    others = {name for link in run.links.values() for name in link.names[1:]}
    points = {}
    for body in run.model.scene.body:
        if body.name in first:
            points[first[body.name]] = tuple(run.links[first[body.name]].places)
        elif body.name not in others:
            points[body.name] = tuple(node_of(run, body.name).body.points)
    return points


def point_names(run: Run) -> list[str]:
    """The reported sections, as "BODY.POINT"."""
    return [f"{body}.{label}" for body, labels in reported_points(run).items() for label in labels]


def node_of(run: Run, body: str) -> Node:
    """The node of a body."""
    return run.model.tree.nodes[run.model.tree.index[body]]


@kept
def _links(run: Run) -> dict[str, BodyMotion]:
    return {name: motion_of_link(run, link) for name, link in run.links.items()}


def body_motion(run: Run, name: str) -> BodyMotion:
    """Motion of a body's frame and modes, or of a link's."""
    if name in run.links:
        return _links(run)[name]
    node, frame = node_of(run, name), places(run).frame(run.model.tree.index[name])
    return BodyMotion(
        position=frame.r,
        orientation=continuous(quaternions(frame.F)),
        velocity=frame.velocity,
        angular_velocity=frame.omega,
        modal=modal_coordinates(run, name),
        modal_velocity=run.v[:, node.p_v] @ node.body.modal_transform.T,
    )


def modal_coordinates(run: Run, body: str) -> Array:
    """P (T, n) of a body, or of a link, in the modes of its modal body file."""
    if body in run.links:
        return _links(run)[body].modal
    node = node_of(run, body)
    return as_floats(run.q[:, node.p_q] @ node.body.modal_transform.T)


def modal_rates(run: Run, body: str) -> Array:
    """Rates (T, n) of the modes that a body, or the whole link, has in the equations."""
    if body in run.links:
        return as_floats(_links(run)[body].modal_velocity @ run.links[body].to_own)
    return run.v[:, node_of(run, body).p_v]


def plane_angle(run: Run, body: str) -> Array:
    """Return θ (T,), rad, of the frame of a body in 2D, without jumps at ±π: full turns of its joints count."""
    e = body_motion(run, body).orientation
    angle = 2 * np.arctan2(e[:, 3], e[:, 0])
    counted = _turned(run, run.links[body].names[0] if body in run.links else body)
    return as_floats(angle + 2 * np.pi * np.round((counted - angle) / (2 * np.pi)))


def _turned(run: Run, body: str) -> Array:
    """θ (T,) of the frame of a body of the tree that moves in the plane, rad: turns of joints and bent links."""
    node = node_of(run, body)
    coordinate = joint_motion(run, node.joint.name)
    if node.joint.freedoms and coordinate is None:
        A = places(run).frame(run.model.tree.index[body]).F
        return np.unwrap(np.arctan2(A[:, 1, 0], A[:, 0, 0]))
    turn = node.joint.rpy[2] + np.zeros(len(run.time))
    if coordinate is not None and node.joint.units == ("rad",):
        turn += coordinate[0][:, 0]
    turn = (-turn if node.backwards else turn) + _bent(run, node.inner) - _bent(run, node.outer)
    inner = node.inner.body
    return turn + (_turned(run, run.model.tree.nodes[inner].body.name) if inner >= 0 else 0.0)


def _bent(run: Run, section: Section) -> Array | float:
    """By how much (T,) a section turns about z on its body, rad."""
    if section.body < 0 or not section.point:
        return 0.0
    node = run.model.tree.nodes[section.body]
    phi = bent_section(node.body, section.point, run.q[:, node.p_q]).phi
    return as_floats(section.turned(phi[..., None])[:, 2, 0])


def section_motion(run: Run, point: str) -> Motion:
    """Motion of the section "BODY.POINT", of a point of a link where the piece has it."""
    name, _, label = point.partition(".")
    place = run.links[name].places[label] if name in run.links else point
    return places(run).at(run.model.tree.section(place))


def point_motion(run: Run, point: str) -> PointMotion:
    """Motion of the section "BODY.POINT"; its deflection from its place in the body, or in the whole link."""
    at = section_motion(run, point)
    turned = None if run.space.is_plane else continuous(quaternions(at.F))
    return PointMotion(at.r, deflection(run, point), turned)


def deflection(run: Run, point: str) -> Array:
    """Φ p (T, 3), m, of the section "BODY.POINT" in the axes of its body or link."""
    name, _, label = point.partition(".")
    if name in run.links:
        frame, r = _links(run)[name], section_motion(run, point).r
        in_frame = np.einsum("tji,tj->ti", of_quaternion(frame.orientation), r - frame.position)
        return as_floats(in_frame - run.links[name].points[label].position)
    node = node_of(run, name)
    moved: Array = bent_section(node.body, label, run.q[:, node.p_q]).u
    return moved - node.body.points[label].position


def joint_motion(run: Run, name: str) -> tuple[Array, Array] | None:
    """Coordinates, unwrapped, and rates (T, k) of a joint; None where it has none."""
    if of_cut := [motion for one, motion in cut_motions(run) if one.joint.name == name]:
        return np.array([one.coordinate for one in of_cut]).T, np.array([one.rate for one in of_cut]).T
    number = run.model.tree.carried.get(name)
    if number is None or not run.model.tree.nodes[number].joint.units:
        return None
    node = run.model.tree.nodes[number]
    rate = node.joint.coordinates(run.v[:, node.v])
    if node.backwards:
        rate = node.joint.rate_turned_around(node.joint.coordinates(run.q[:, node.q]), rate)
    return node.coordinates(run.q), rate
