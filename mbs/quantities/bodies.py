"""Motion of bodies, and of links in pieces as of the one link: in its frame and its modes.

The frame is where the link's reference condition has it: at its root, as the section there (cantilever), or along the
chord to its tip, turned from the section at the root by no more than that takes (simply supported: no twist there). The
modal coordinates are those whose shape is nearest to the link's; its points are where the pieces have them.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.rotations import exponential, left_jacobian, logarithm, quaternions
from ...common.structs import struct
from ...fe_models.link_records.families import HOLDING_ROOT
from ...fe_models.modal_body import ModalBody
from ..model.body import BodyPoint
from ..model.divided_link import LinkInPieces
from ..model.kinematics import Motion
from ..run.record import Run
from ..scene.space import Space

AT_END = 1e-9  # of the length
X = np.array([1.0, 0.0, 0.0])


@struct
class BodyMotion:
    """Motion of a body's frame and modes, one row per output, in global axes."""

    position: Array  # (T, d) R, m
    orientation: Array  # in the plane (T,) θ, rad; in 3D (T, 4) quaternions of continuous sign
    velocity: Array  # (T, d) m/s
    angular_velocity: Array  # in the plane (T,), in 3D (T, 3), rad/s
    # modal, modal_velocity: (T, n), in the modes of the modal body file; of planar bodies with fewer modes in the
    # coordinates of the equations
    modal: Array
    modal_velocity: Array

    @property
    def datasets(self) -> dict[str, Array]:
        """Arrays by their names in results files."""
        return _named(vars(self))

    def within(self, space: Space, angle: Array) -> BodyMotion:
        """Return the components of a 3D motion that `space` has; planar ones have `angle` (T,), rad, no quaternions."""
        return replace(
            self,
            position=space.along(self.position),
            orientation=angle if space.is_plane else self.orientation,
            velocity=space.along(self.velocity),
            angular_velocity=space.about(self.angular_velocity),
        )


@struct
class PointMotion:
    """Motion of a point of a body: position (T, d) m, deflection Φ p (T, d) m in body axes.

    `orientation` (T, 4) of the section there in 3D, quaternions of continuous sign; None in the plane.
    """

    position: Array
    deflection: Array
    orientation: Array | None = None

    @property
    def datasets(self) -> dict[str, Array]:
        """Arrays by their names in results files."""
        return _named({key: values for key, values in vars(self).items() if values is not None})

    def within(self, space: Space) -> PointMotion:
        """Return the components of a 3D motion that `space` has."""
        turned = None if space.is_plane else self.orientation
        return PointMotion(space.along(self.position), space.along(self.deflection), turned)


def _named(datasets: dict[str, Array]) -> dict[str, Array]:
    """With an orientation as angle or quaternion."""
    kinds = {1: "angle", 2: "quaternion"}
    return {kinds[values.ndim] if key == "orientation" else key: values for key, values in datasets.items()}


def continuous(e: Array) -> Array:
    """Quaternions (T, 4) with signs that do not jump, the first e0 ≥ 0."""
    flips = np.sum(e[1:] * e[:-1], axis=1) < 0
    signs: Array = np.where(np.cumsum(np.append(False, flips)) % 2, -1.0, 1.0)
    return e * signs[:, None]


def motion_of_link(run: Run, link: LinkInPieces) -> BodyMotion:
    """Return the motion of the frame of the whole link, and of the modes of its file."""
    x = link.modal.stations.position[:, 0]
    sections = _sections(run, link, x)
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


def _sections(run: Run, link: LinkInPieces, stations: Array) -> list[Motion]:
    """Of the sections at `stations` (m from the root); to second order at the ends of pieces, where K is."""
    starts, names, tree = link.starts, link.names, run.model.tree
    bodies, points = {node.body.name: node.body for node in tree.nodes}, list[str]()
    for x in stations.tolist():
        k = int(np.clip(np.searchsorted(starts, x, side="right") - 1, 0, len(names) - 1))
        at, body = link.pieces[k].interpolate(min(x - starts[k], link.pieces[k].length)), bodies[names[k]]
        ends = link.pieces[k].interfaces.items()
        near = (end for end, of in ends if abs(of.position[0] - at.position[0]) < AT_END * link.modal.length)
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
    A = as_floats(exponential(turn) @ root.F)
    J = left_jacobian(-_seen_from(A, turn))
    swing = np.cross(c, c_dot)
    left, of_x = (np.linalg.solve(J, b[:, :, None])[:, 0, 0] for b in (_seen_from(A, root.omega - swing), 0 * c + X))
    return A, as_floats(swing + (left / of_x)[:, None] * c)


def _seen_from(A: Array, vectors: Array) -> Array:
    return as_floats(np.einsum("tji,tj->ti", A, vectors))


def _nearest_shape(modal: ModalBody, u: Array) -> Array:
    """P (T, n) for which Φp comes nearest to displacements and twists at the length u (stations, 4, T), m."""
    stations = modal.stations
    rows = np.concatenate([stations.translation, modal.length * stations.rotation[:, :1]], axis=1)
    return as_floats(np.linalg.lstsq(rows.reshape(-1, modal.mode_count), u.reshape(-1, u.shape[2]), rcond=None)[0].T)
