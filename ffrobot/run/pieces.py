"""Links in pieces as the one link: what was computed of the pieces, in frame and modes of the link.

The frame is where the link's reference condition has it: at its root, as the section there (cantilever), or along the
chord to its tip, turned from the section at the root by no more than that takes (simply supported: no twist there). The
modal coordinates are those whose shape is nearest to the link's; its points are where the pieces have them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.errors import InputError
from ..common.rotations import exponential, left_jacobian, logarithm, of_quaternion, quaternions
from ..common.structs import struct
from ..fe_models.link_records.families import HOLDING_ROOT
from ..fe_models.modal_body import ModalBody
from ..mbs.model.body import BodyPoint
from ..mbs.model.divided_link import spread_of
from ..mbs.model.kinematics import Motion
from ..mbs.model.motors import MotorForces
from ..mbs.quantities.attachment_error import PieceInMotion, missed_by_pieces
from ..mbs.quantities.motion import BodyMotion, PointMotion, RobotMotion, continuous
from ..mbs.quantities.second_order import IN_MOTION, Missing, largest_displacement
from ..mbs.quantities.validity import ENOUGH, Bending, enough_pieces, link_bending, shape_from_chord
from ..scene.pieces import BodyInPieces, bodies_in_pieces
from ..scene.scene import Scene
from .solution import Solution

MOST = 64
AT_END = 1e-9  # of the length
X = np.array([1.0, 0.0, 0.0])


@struct
class Divided:
    """A link in pieces: its modal body, how it is cut, and the modal bodies of its pieces from the root to the tip.

    `to_own` (n_file, n): modal coordinates of the whole link in the equations, by those of its file. `points` are those
    of the whole link.
    """

    modal: ModalBody
    body: BodyInPieces
    pieces: tuple[ModalBody, ...]
    to_own: Array
    points: Mapping[str, BodyPoint]


@struct
class MotionOfLinks(RobotMotion):
    """A motion of pieces, in which links in pieces are the one link each."""

    divided: Mapping[str, Divided] = field(default_factory=dict)

    @property
    def points(self) -> dict[str, tuple[str, ...]]:
        """By body that is reported: names of its sections; links stand where their first pieces do."""
        own, found = super().points, {}
        first = {link.body.names[0]: name for name, link in self.divided.items()}
        others = {name for link in self.divided.values() for name in link.body.names[1:]}
        for name, points in own.items():
            if name in first:
                found[first[name]] = tuple(self.divided[first[name]].body.cut.places)
            elif name not in others:
                found[name] = points
        return found

    def body(self, name: str) -> BodyMotion:
        """Of a body's frame and modes, or of a link's."""
        return self._links[name] if name in self.divided else super().body(name)

    def modal(self, body: str) -> Array:
        """P (T, n) of a body, or of a link, in the modes of its file."""
        return self._links[body].modal if body in self.divided else super().modal(body)

    def modal_velocity(self, body: str) -> Array:
        """Rates (T, n) of the modes that a body, or the whole link, has in the equations."""
        if body not in self.divided:
            return super().modal_velocity(body)
        return as_floats(self._links[body].modal_velocity @ self.divided[body].to_own)

    def point(self, point: str) -> PointMotion:
        """Of the section "BODY.POINT": where the piece has it, and how far that is from its place in the link."""
        name, _, label = point.partition(".")
        if name not in self.divided:
            return super().point(point)
        link, frame = self.divided[name], self._links[name]
        found = super().point(link.body.point(label))
        position = link.points[label].position
        in_frame = np.einsum("tji,tj->ti", of_quaternion(frame.orientation), found.position - frame.position)
        return replace(found, deflection=in_frame - position)

    def place_and_rate(self, point: str) -> tuple[Array, Array]:
        """Of the section "BODY.POINT", where the piece has it."""
        name, _, label = point.partition(".")
        return super().place_and_rate(self.divided[name].body.point(label) if name in self.divided else point)

    def deflection(self, point: str) -> Array:
        """Of the section "BODY.POINT", in the axes of its body or link."""
        is_divided = point.partition(".")[0] in self.divided
        return self.point(point).deflection if is_divided else super().deflection(point)

    def _turned(self, body: str) -> Array:
        """Of a link that of its first piece."""
        return super()._turned(self.divided[body].body.names[0] if body in self.divided else body)

    @cached_property
    def _links(self) -> dict[str, BodyMotion]:
        return {name: _motion_of_link(self, link) for name, link in self.divided.items()}

    def _found_motor_forces(self) -> MotorForces | None:
        """Modal forces of links by virtual work, from those on their pieces."""
        found = super()._found_motor_forces()
        if found is None:
            return None
        modal = dict(found.modal)
        for name, link in self.divided.items():
            spread = spread_of(link.modal, list(zip(link.body.cut.starts, link.pieces, strict=True)))
            modal[name] = np.hstack([modal.pop(piece) for piece in link.body.names]) @ spread
        return replace(found, modal=modal)


def divided_links(solution: Solution) -> dict[str, Divided]:
    """The links in pieces of a solution, by name."""
    found = {}
    for name, body in solution.divided.items():
        modal = solution.bodies[name].modal
        pieces = [solution.parts[piece].modal for piece in body.names]
        whole = solution.bodies[name].spatial
        to_own = np.linalg.pinv(whole.modal_transform).T
        assert modal is not None
        found[name] = Divided(
            modal, body, tuple(piece for piece in pieces if piece is not None), as_floats(to_own), whole.points
        )
    return found


def wanted_pieces(solution: Solution) -> dict[str, int]:
    """How many pieces bodies with `pieces = "auto"` want after a solve; empty where they have them.

    What a piece loses of its length goes down with the square of their number. A run that failed has bent links
    farther than they are.
    """
    wanted, now = {}, {}
    for body in solution.scene.body:
        if body.pieces == "auto":
            names = solution.divided[body.name].names if body.name in solution.divided else (body.name,)
            worst = max((_shortening(solution, name) for name in names), default=0.0)
            count = enough_pieces(worst, len(names)) if worst > ENOUGH else 1
            wanted[body.name], now[body.name] = max(min(MOST, count), len(names)), len(names)
    return {} if wanted == now else wanted


def bending_of_links(solution: Solution, motion: RobotMotion) -> dict[str, Bending]:
    """How far flexible bodies bend, links in pieces as their worst piece, and whether they can be divided further."""
    bodies = solution.parts or solution.bodies
    links = {name: body.modal for name, body in bodies.items() if body.modal is not None}
    worst = worst_of_pieces(link_bending(motion, links), solution.divided)
    for name in solution.divided:
        if worst[name].is_stiffened:
            worst[name] = replace(worst[name], missing=_missing(solution, motion, name))
    if not motion.is_at_rest:
        worst = shared_in_motion(worst)
    return {
        name: replace(found, is_divisible=is_divisible(solution.scene, name)) if found.is_beyond else found
        for name, found in worst.items()
    }


def _missing(solution: Solution, motion: RobotMotion, name: str) -> Missing:
    """What the pieces of a link miss, which have geometric stiffening; in motion it makes the link vibrate besides."""
    link, pieces = solution.bodies[name].modal, []
    assert link is not None
    for piece in solution.divided[name].names:
        modal, node = solution.parts[piece].modal, motion.node(piece)
        assert modal is not None
        ends = (motion.section(f"{piece}.{end}") for end in ("root", "tip"))
        pieces.append(PieceInMotion(modal, node.body, motion.q[:, node.p_q], *ends))
    of_length = float(np.linalg.norm(missed_by_pieces(pieces), axis=1).max(initial=0.0)) / link.length
    of_length *= 1.0 if motion.is_at_rest else IN_MOTION
    whole = largest_displacement(link, motion.modal(name))
    return Missing(of_length, min(1.0, of_length / whole) if whole else 0.0)


def _shortening(solution: Solution, name: str) -> float:
    """The largest of a body of the equations over all analyses, of its length."""
    modal = (solution.parts or solution.bodies)[name].modal
    assert modal is not None
    found = [
        shape_from_chord(modal, RobotMotion.modal(result.motion, name))[2].max(initial=0.0)
        for result in solution.analyses.values()
    ]
    return float(max(found, default=0.0)) / modal.length


def _motion_of_link(motion: RobotMotion, link: Divided) -> BodyMotion:
    """Of the frame of the one link, and of the modes of its file."""
    x = link.modal.stations.position[:, 0]
    sections = _sections(motion, link, x)
    root, tip = sections[int(np.argmin(x))], sections[int(np.argmax(x))]
    holds_root = link.modal.reference_condition in HOLDING_ROOT
    A, omega = (root.F, root.omega) if holds_root else _along_chord(root, tip)
    u, u_dot = (np.zeros((len(x), 4, len(root.r))) for _ in range(2))
    for k, at in enumerate(sections):
        arm, rate = at.r - root.r, at.velocity - root.velocity
        phi = logarithm(np.swapaxes(A, -1, -2) @ at.F)
        spin = _seen_from(A, at.omega - omega)
        u[k, :3] = (_seen_from(A, arm) - x[k] * X).T
        u_dot[k, :3] = _seen_from(A, rate - np.cross(omega, arm)).T
        u[k, 3] = link.modal.length * phi[:, 0]
        u_dot[k, 3] = link.modal.length * np.linalg.solve(left_jacobian(phi), spin[:, :, None])[:, 0, 0]
    p, p_dot = (_nearest_shape(link.modal, each) for each in (u, u_dot))
    return BodyMotion(root.r, continuous(quaternions(A)), root.velocity, omega, p, p_dot)


def _sections(motion: RobotMotion, link: Divided, stations: Array) -> list[Motion]:
    """Of the sections at `stations` (m from the root); to second order at the ends of pieces, where K is."""
    starts, names, tree = link.body.cut.starts, link.body.names, motion.model.tree
    bodies, found = {node.body.name: node.body for node in tree.nodes}, list[str]()
    for x in stations.tolist():
        k = int(np.clip(np.searchsorted(starts, x, side="right") - 1, 0, len(names) - 1))
        at, body = link.pieces[k].interpolate(min(x - starts[k], link.pieces[k].length)), bodies[names[k]]
        ends = link.pieces[k].interfaces.items()
        near = (end for end, of in ends if abs(of.position[0] - at.position[0]) < AT_END * link.modal.length)
        point, T = next(near, f"station {x}"), body.modal_transform
        if point not in body.points:
            place = BodyPoint(at.position, at.translation @ T, at.rotation @ T)
            bodies[names[k]] = replace(body, points=MappingProxyType({**body.points, point: place}))
        found.append(f"{names[k]}.{point}")
    moving = tree.with_bodies(tuple(bodies.values()))
    places = moving.places(motion.q, motion.v)
    return [places.at(moving.section(point)) for point in found]


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
    A = as_floats(exponential(turn) @ root.F)
    J = left_jacobian(-_seen_from(A, turn))
    swing = np.cross(c, c_dot)
    left, of_x = (np.linalg.solve(J, b[:, :, None])[:, 0, 0] for b in (_seen_from(A, root.omega - swing), 0 * c + X))
    return A, as_floats(swing + (left / of_x)[:, None] * c)


def _seen_from(A: Array, vectors: Array) -> Array:
    """Aᵀ times vectors (T, 3)."""
    return as_floats(np.einsum("tji,tj->ti", A, vectors))


def _nearest_shape(modal: ModalBody, u: Array) -> Array:
    """P (T, n) for which Φp comes nearest to displacements and twists at the length u (stations, 4, T), m."""
    stations = modal.stations
    rows = np.concatenate([stations.translation, modal.length * stations.rotation[:, :1]], axis=1)
    return as_floats(np.linalg.lstsq(rows.reshape(-1, modal.mode_count), u.reshape(-1, u.shape[2]), rcond=None)[0].T)


def worst_of_pieces(bending: Mapping[str, Bending], divided: Mapping[str, BodyInPieces]) -> dict[str, Bending]:
    """How far links bend, each divided one as its piece whose results are worst."""
    link_of = {piece: name for name, body in divided.items() for piece in body.names}
    worst: dict[str, Bending] = {}
    for piece, found in bending.items():
        name = link_of.get(piece, piece)
        if name not in worst or found.missing.of_length > worst[name].missing.of_length:
            worst[name] = found
    return {
        name: replace(found, pieces=len(divided[name].names)) if name in divided else found
        for name, found in worst.items()
    }


def shared_in_motion(bending: Mapping[str, Bending]) -> dict[str, Bending]:
    """How far links bend, none with smaller errors than the worst: what one does wrong moves and loads all others."""
    missing = [of.missing for of in bending.values()] or [Missing(0.0, 0.0)]
    worst = Missing(*(max(errors) for errors in zip(*missing, strict=True)))
    return {name: replace(of, missing=of.missing.grown_to(worst)) for name, of in bending.items()}


def is_divisible(scene: Scene, name: str) -> bool:
    """Whether the scene lets a body be divided into pieces."""
    try:
        return bool(bodies_in_pieces(scene, {name: 2}))
    except InputError:
        return False
