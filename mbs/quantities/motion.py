"""Motion of bodies, sections and joints in a run, and how well it meets the constraint equations. SI units.

All arrays are over the output times (T, …), global axes unless a name says otherwise.

Links in pieces move as the whole link: docs/theory.md, Subdivided links.
"""

from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, in_parts
from ...common.rotations import exponential, left_jacobian, logarithm, of_quaternion, quaternions
from ...common.structs import kept
from ...fe_models.link_records.families import HOLDING_ROOT
from ...fe_models.modal_body import ModalBody
from ..model.body import BodyPoint, bent_section
from ..model.divided_link import LinkInPieces
from ..model.drives import Drives, PointDrive
from ..model.kinematics import Motion, Places
from ..model.known_motion import MotionForces, motion_forces, row_accelerations
from ..model.masses import turns_as_a_body
from ..model.nodes import Node, Section
from ..model.system import MultibodySystem
from ..model.tree import CutCoordinate, CutMotion
from ..run.record import Run

AT_END = 1e-9  # of the length
AT_ONCE = 1024  # instants whose sections are in memory together
X = np.array([1.0, 0.0, 0.0])


class BodyMotion(NamedTuple):
    """Motion of a body's frame and modes, one row per output, in global axes."""

    position: Array  # (T, 3) R of the frame's origin, m
    orientation: Array  # (T, 4) quaternions, the scalar first, of continuous sign
    velocity: Array  # (T, 3) m/s
    angular_velocity: Array  # (T, 3) rad/s
    # (T, n), √kg·m and √kg·m/s, in the modes of the modal body file
    modal: Array
    modal_velocity: Array


def continuous(e: Array) -> Array:
    """Quaternions e (T, 4), no unit, with signs that do not jump, the first e0 ≥ 0."""
    flips = np.sum(e[1:] * e[:-1], axis=1) < 0
    return e * np.where(np.cumsum(np.append(False, flips)) % 2, -1.0, 1.0)[:, None]


def _motion_of_link(run: Run, link: LinkInPieces) -> BodyMotion:
    x = link.modal.stations.position[:, 0]
    sections = _sections(run, link, x)
    root, tip = sections[int(np.argmin(x))], sections[int(np.argmax(x))]
    holds_root = link.modal.reference_condition in HOLDING_ROOT
    A, omega = (root.F, root.omega) if holds_root else _along_chord(root, tip)
    u, u_dot = list[Array](), list[Array]()
    for k, at in enumerate(sections):
        arm, rate = at.r - root.r, at.velocity - root.velocity
        phi = logarithm(np.swapaxes(A, -1, -2) @ at.F)
        spin = _seen_from(A, at.omega - omega)
        phi_dot = np.linalg.solve(left_jacobian(phi), spin[:, :, None])
        u += [*(_seen_from(A, arm) - x[k] * X).T, link.modal.length * phi[:, 0]]
        u_dot += [*_seen_from(A, rate - np.cross(omega, arm)).T, link.modal.length * phi_dot[:, 0, 0]]
    p, p_dot = (_nearest_shape(link.modal, np.array(each)) for each in (u, u_dot))
    return BodyMotion(root.r, quaternions(A), root.velocity, omega, p, p_dot)


def _sections(run: Run, link: LinkInPieces, stations: Array) -> list[Motion]:
    """Of the sections at `stations` (m from the root); to second order at the ends of pieces, where K is."""
    starts, names, tree, slack = link.starts, link.names, run.model.tree, AT_END * link.modal.length
    bodies, points = {node.body.name: node.body for node in tree.nodes}, list[str]()
    for x in stations.tolist():
        k = int(np.clip(np.searchsorted(starts, x, side="right") - 1, 0, len(names) - 1))
        piece, body = link.pieces[k], bodies[names[k]]
        at = piece.interpolate(min(x - starts[k], piece.length))
        near = (end for end, of in piece.interfaces.items() if abs(of.position[0] - at.position[0]) < slack)
        point, T = next(near, f"station {x}"), body.modal_transform
        if point not in body.points:
            place = BodyPoint(at.position, at.translation @ T, at.rotation @ T)
            bodies[names[k]] = replace(body, points=MappingProxyType({**body.points, point: place}))
        points.append(f"{names[k]}.{point}")
    moving = tree.with_bodies(tuple(bodies.values()))
    places = moving.places(run.q, run.v)
    return [places.at(moving.section(point)) for point in points]


def _along_chord(root: Motion, tip: Motion) -> tuple[Array, Array]:
    """Axes (T, 3, 3) with x along the chord, in which the section at the root is not twisted, and their spin (T, 3).

    With the section at exp(φ~) from these axes, φ₁ = 0 at all times: with the spin c × ċ + α c, α follows from φ̇₁ = 0.
    """
    d, d_dot = tip.r - root.r, tip.velocity - root.velocity
    size = np.linalg.norm(d, axis=1)[:, None]
    c = d / size
    c_dot = (d_dot - c * np.sum(c * d_dot, axis=1)[:, None]) / size
    across = np.cross(root.F[:, :, 0], c)
    sine, cosine = np.linalg.norm(across, axis=1), np.sum(root.F[:, :, 0] * c, axis=1)
    turn = across * np.divide(np.arctan2(sine, cosine), sine, out=np.ones_like(sine), where=sine > 0.0)[:, None]
    A = exponential(turn) @ root.F
    J = left_jacobian(-_seen_from(A, turn))
    swing = np.cross(c, c_dot)
    left, of_x = (np.linalg.solve(J, b[:, :, None])[:, 0, 0] for b in (_seen_from(A, root.omega - swing), 0 * c + X))
    return A, swing + (left / of_x)[:, None] * c


def _seen_from(A: Array, vectors: Array) -> Array:
    return np.einsum("tji,tj->ti", A, vectors)


def _nearest_shape(modal: ModalBody, u: Array) -> Array:
    """P (T, n) for which Φp comes nearest to displacements and twists at the length u (4 stations, T), m."""
    stations = modal.stations
    rows = np.concatenate([stations.translation, modal.length * stations.rotation[:, :1]], axis=1)
    return np.linalg.lstsq(rows.reshape(-1, modal.mode_count), u, rcond=None)[0].T


@kept
def places(run: Run) -> Places:
    """Positions, orientations and velocities of frames and sections over a run."""
    return run.model.tree.places(run.q, run.v)


@kept
def system_of(run: Run) -> MultibodySystem:
    """The equations of motion of a run; drives without force at payloads make the motion of these points known."""
    scene = run.model.scene
    payloads = (PointDrive(load.point, {}) for load in scene.payload if not turns_as_a_body(scene, load))
    return MultibodySystem(run.model, Drives(at_points=(*run.applied, *payloads)))


@kept
def acting_forces(run: Run) -> MotionForces:
    """The forces between bodies and in joints of a run."""
    return motion_forces(system_of(run), run, run.time, run.multipliers)


@kept
def constraint_rows(run: Run) -> tuple[Array, Array]:
    """C (T, m), m or rad, of m constraint equations, and Jacobians C_v (T, m, n_v), SI."""
    return run.model.constraints.values(run.q, run.time)


@kept
def cut_motions(run: Run) -> list[tuple[CutCoordinate, CutMotion]]:
    """Coordinates of joints at which loops are cut, each with its motion."""
    motions = run.model.along_cut.motions(run.q, run.v, run.time)
    return list(zip(run.model.cut, motions, strict=True))


def constraint_violation(run: Run) -> Array:
    """Ratios (T, 3) max|C|/(1 + max|q|), max|Ċ|/(1 + max|v|), max|C̈|/(1 + max|a|); at rest, of C alone."""
    levels = [(constraint_rows(run)[0], run.q)]
    if not run.is_at_rest:
        C_dot = run.model.constraints.rates(run.q, run.v, run.time)
        levels += [(C_dot, run.v), (row_accelerations(system_of(run), run, run.time), run.a)]
    off = np.zeros((len(run.time), 3))
    for k, (values, size) in enumerate(levels):
        off[:, k] = np.abs(values).max(axis=1, initial=0.0) / (1 + np.abs(size).max(axis=1, initial=0.0))
    return off


def reported_points(run: Run) -> dict[str, tuple[str, ...]]:
    """Names of the points of each body whose motion results contain, in the scene's order, by body or whole link."""
    whole = {piece: name for name, link in run.links.items() for piece in link.names}
    names = dict.fromkeys(whole.get(body.name, body.name) for body in run.model.scene.body)
    return {
        name: tuple(run.links[name].places if name in run.links else node_of(run, name).body.points) for name in names
    }


def point_names(run: Run) -> list[str]:
    """Names "BODY.POINT" of the points whose motion results contain."""
    return [f"{body}.{label}" for body, labels in reported_points(run).items() for label in labels]


def node_of(run: Run, body: str) -> Node:
    """The node of the tree with a body."""
    return run.model.tree.nodes[run.model.tree.index[body]]


@kept
def _links(run: Run) -> dict[str, BodyMotion]:
    parts = [run.at(some) for some in in_parts(len(run.time) or 1, AT_ONCE)]
    links = {}
    for name, link in run.links.items():
        of = BodyMotion(*map(np.concatenate, zip(*(_motion_of_link(part, link) for part in parts), strict=True)))
        links[name] = of._replace(orientation=continuous(of.orientation))
    return links


def body_motion(run: Run, name: str) -> BodyMotion:
    """Motion of the frame and modes of a body, or of a link in pieces as a whole."""
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
    """Return p (T, n), √kg·m, of a body or link, in the modes of its modal body file."""
    if body in run.links:
        return _links(run)[body].modal
    node = node_of(run, body)
    return run.q[:, node.p_q] @ node.body.modal_transform.T


def modal_rates(run: Run, body: str) -> Array:
    """Rates (T, n), √kg·m/s, of the modes that a body, or the whole link, has in the equations."""
    if body in run.links:
        return _links(run)[body].modal_velocity @ run.links[body].to_own
    return run.v[:, node_of(run, body).p_v]


def plane_angle(run: Run, body: str) -> Array:
    """θ (T,), rad, of the frame of a body in 2D, without jumps at ±π: full turns of its joints count."""
    e = body_motion(run, body).orientation
    angle = 2 * np.arctan2(e[:, 3], e[:, 0])
    counted = _turned(run, run.links[body].names[0] if body in run.links else body)
    return angle + 2 * np.pi * np.round((counted - angle) / (2 * np.pi))


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
    return section.turned(phi[..., None])[:, 2, 0]


def section_motion(run: Run, point: str) -> Motion:
    """The motion of the section "BODY.POINT"; of a link in pieces, that of the piece with this point."""
    name, _, label = point.partition(".")
    place = run.links[name].places[label] if name in run.links else point
    return places(run).at(run.model.tree.section(place))


def deflection(run: Run, point: str) -> Array:
    """Displacement (T, 3), m, of the section "BODY.POINT" by deformation, in the axes of its body or whole link."""
    name, _, label = point.partition(".")
    if name in run.links:
        frame, r = _links(run)[name], section_motion(run, point).r
        return _seen_from(of_quaternion(frame.orientation), r - frame.position) - run.links[name].points[label].position
    node = node_of(run, name)
    return bent_section(node.body, label, run.q[:, node.p_q]).u - node.body.points[label].position


def joint_motion(run: Run, name: str) -> tuple[Array, Array] | None:
    """Coordinates (T, k), rad or m, without jumps, of a joint, and rates, rad/s or m/s; None if it has none."""
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
