"""What the core wants of bodies and sections: mbs/core/recursion/mechanism/model.h."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .. import _core
from .body import Body
from .gears import rotor
from .tree import Node, Section

Placed = tuple[int, int]  # body, −1 the ground, and number of its marker


class CutPlace(NamedTuple):
    """Where a coordinate of a joint at which a loop is cut is measured, and what acts along it acts."""

    # a, b: its sections, by numbers of wrenches
    a: int
    b: int
    turns: bool  # whether it is an angle
    axis: Array  # (3,) of it, in axes of a


class ModelParts(NamedTuple):
    """A mechanism in space as the core takes it.

    `wrenches` are the markers on which forces act, `cut` joints at which loops are cut and along which something acts.
    """

    bodies: list[_core.SpatialBody]
    ground: list[_core.SpatialMarker]
    rows: list[_core.ConstraintModel]
    wrenches: list[_core.MarkerAt]
    gravity: Array
    cut: tuple[CutPlace, ...]

    def model(self) -> _core.SpatialModel:
        """Of the core."""
        return _core.SpatialModel(self.bodies, self.ground, self.rows, self.wrenches, self.gravity)


def carried_body(node: Node, inner: Placed, outer: Placed, markers: list[Section], driven: bool) -> _core.SpatialBody:
    """A body with its `markers` on its joint, between the places `inner` and `outer`; `driven`: forces act along it."""
    body = _core.SpatialBody()
    body.name, (body.parent, body.parent_marker), body.inboard_marker = node.body.name, inner, outer[1]
    body.joint = getattr(_core.JointKind, node.joint.type)
    body.lead = float(getattr(node.joint, "rise", 0.0))
    body.driven = driven
    # Else the core may take the frame's coordinates where modes turn the section: same motion, other numbers.
    body.of_section = moves(node)
    body.rotor_inertia, body.gear_ratio = _rotor(node)
    body.data = _data(node.body, markers)
    return body


def standing_marker(section: Section, turns: bool) -> _core.SpatialMarker:
    """A marker of the ground; `turns`: its orientation follows a law."""
    marker = _marker(section, np.zeros((6, 0)), section.position, [])
    marker.turns = turns
    return marker


def moves(node: Node) -> bool:
    """Whether modes move the section of the body at its joint."""
    Phi, _, K = rows_of(node.body, node.outer)
    return bool(np.any(Phi)) or any(bool(np.any(of_row)) for of_row in K)


def rows_of(body: Body, section: Section) -> tuple[Array, Array, list[Array]]:
    """Φ over Φ_r (6, n) and the position (3,) of a section; six K (n, n) where it moves to second order."""
    if not section.point:
        return np.zeros((6, body.n_modes)), np.zeros(3), []
    at = body.points[section.point]
    K = [] if body.stiffening is None else list(body.stiffening.K_points.get(section.point, []))
    if K and section.still:
        n = body.n_modes
        K[3:] = section.turned(np.reshape(K[3:], (3, n * n))).reshape(3, n, n)
    return np.vstack([at.translation, section.turned(at.rotation)]), at.position, K


def _rotor(node: Node) -> tuple[float, float]:
    """Inertia of the rotor in a joint and its ratio on the inner section.

    It sits on the first side and spins with N Ω_second − (N − 1) Ω_first; where that side is the outer one, with
    N' Ω_outer − (N' − 1) Ω_inner and N' = 1 − N. In prismatic joints it spins with the coordinate alone.
    """
    inertia, ratio = rotor(node)
    return inertia, 1.0 - ratio if node.backwards and node.joint.type == "revolute" else ratio


def _data(body: Body, markers: list[Section]) -> _core.SpatialData:
    """The constants of a body; those of modes are left empty of a rigid one."""
    data = _core.SpatialData()
    data.mass, data.first_moment, data.J2 = body.mass, np.array(body.first_moment), np.array(body.second_moment)
    if body.n_modes:
        diagonal = np.array_equal(body.damping, np.diag(np.diag(body.damping)))
        data.stiffness = np.array(body.stiffness)
        data.damping = np.array(np.diag(body.damping)[:, None] if diagonal else body.damping)
        data.S_bar, data.I_bar = np.array(body.S_bar), np.array(body.I_bar.reshape(9, -1))
        booked = body.S_bar_kl.copy()
        booked[2, 2] += body.S_spin
        if body.stiffening is not None:
            booked += body.stiffening.S_turned
        data.S_bar_kl = [np.array(booked[k, l]) for k in range(3) for l in range(3)]  # noqa: E741
        data.h_spin, data.S_spin = np.array(body.h_spin), np.array(body.S_spin)
    if body.stiffening is not None:
        data.K_s = list(body.stiffening.K_s)
        data.K_x = list(body.stiffening.K_x.reshape(9, body.n_modes, body.n_modes))
    data.J_spin = body.J_spin
    data.markers = [_marker(section, *rows_of(body, section)) for section in markers]
    return data


def _marker(section: Section, Phi: Array, position: Array, K: list[Array]) -> _core.SpatialMarker:
    marker = _core.SpatialMarker()
    marker.position, marker.triad, marker.Phi, marker.K = np.array(position), np.array(section.triad), Phi, K
    return marker
