"""Scalar measures between two markers in the plane, and those of the joints, motors, paths and loads of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from ffrobot.mbs.fields.field_types import split_point

FRAME = ""  # instead of a point's name: the frame of the body itself
Kind = Enum("Kind", ["x", "y", "angle", "slide", "gear"])


@dataclass(frozen=True)
class Marker:
    """A point of a body (or its frame, point = FRAME), or a `position` (m) on the ground (body None)."""

    body: str | None
    point: str = FRAME
    position: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Measure:
    """value = motion of `b` relative to `a`, in m or rad, less `offset`; `label` names it.

    By `kind`: the difference of x or y in global axes, of the angles, the way of b along `direction`, which is fixed to
    the section at a ("slide"), or n_b α_b − n_a α_a with the angles α and the gear ratios (n_b, n_a) ("gear").
    """

    label: str
    kind: Kind
    a: Marker
    b: Marker
    direction: tuple[float, float] = (0.0, 0.0)
    gear_ratios: tuple[float, float] = (0.0, 0.0)
    offset: float = 0.0


@dataclass(frozen=True)
class Friction:
    """−(c γ̇ + τ_c tanh(γ̇/γ̇_s)): `viscous` c, `coulomb` τ_c, `speed` γ̇_s."""

    viscous: float
    coulomb: float
    speed: float


def marker_at(side: str, at=(0.0, 0.0)) -> Marker:
    """The marker of "BODY.POINT", or the one on the ground `at` (m)."""
    return Marker(None, FRAME, tuple(at[:2])) if side == "ground" else Marker(*split_point(side))


def sides(joint) -> tuple[Marker, Marker]:
    return tuple(marker_at(side, joint.at) for side in joint.between)


def axis_of(joint) -> np.ndarray:
    """Unit direction (2,) of a slide, axes of its first side."""
    x_y = np.array(joint.axis[:2])
    return x_y / np.linalg.norm(x_y)


def joint_constraints(joint) -> list[Measure]:
    """What a revolute, prismatic or weld joint holds."""
    a, b = sides(joint)
    if joint.type == "prismatic":
        x, y = axis_of(joint)
        held = [Measure(f"{joint.name}, across the axis", Kind.slide, a, b, direction=(-y, x))]
    else:
        held = [Measure(f"{joint.name}, {kind.name}", kind, a, b) for kind in (Kind.x, Kind.y)]
    if joint.type != "revolute":
        held.append(Measure(f"{joint.name}, angle", Kind.angle, a, b, offset=joint.rpy[2]))
    return held


def coordinate(joint, motors: str) -> Measure:
    """γ of a revolute or prismatic joint: the angle of sections, or of frames, or the way along the axis."""
    a, b = sides(joint)
    if joint.type == "prismatic":
        return Measure(f"{joint.name}, along the axis", Kind.slide, a, b, direction=tuple(axis_of(joint)))
    if motors == "frame":
        a, b = (Marker(marker.body, FRAME, marker.position) for marker in (a, b))
    return Measure(joint.name, Kind.angle, a, b)


def rotor(joint, motors: str) -> tuple[Measure, float]:
    """What turns a rotor on the first body behind a gear of ratio N, N α_b − (N − 1) α_a, and its inertia."""
    own, N, J = coordinate(joint, motors), joint.gear_ratio, joint.rotor_inertia
    if joint.type == "prismatic":
        return own, J * N**2
    return Measure(f"rotor of {joint.name}", Kind.gear, own.a, own.b, gear_ratios=(N, N - 1)), J


def friction(joint) -> Friction | None:
    if joint.type == "weld" or not (joint.viscous_friction or joint.coulomb_friction):
        return None
    return Friction(joint.viscous_friction, joint.coulomb_friction, joint.friction_speed)


def path_measures(path, motors: str, joints) -> dict[str, Measure]:
    """By component what a trajectory prescribes."""
    if path.coordinate_of is not None:
        return {"value": coordinate(joints[path.coordinate_of], motors)}
    if path.angle is not None:
        at = marker_at(path.angle) if "." in path.angle else Marker(path.angle)
        return {"value": Measure(path.name, Kind.angle, Marker(None), at)}
    at = marker_at(path.point)
    return {axis: Measure(f"{path.name}, {axis}", Kind[axis], Marker(None), at) for axis in path.components}
