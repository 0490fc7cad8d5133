"""The first guess of positions: frames placed from joint to joint, outwards from the ground."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Array
from ...common.plane import perpendicular, rotated
from ..fields.field_types import GROUND, split_point
from ..joints.joints import Joint
from ..model.system import MechanismSystem
from .position import rank_ratio, solve_positions
from .state import State

TRIES = 60
REGULAR = 1e-3  # ratio of singular values of the constraints: less is next to a singular configuration


def initial_guess(assembly: MechanismSystem) -> State:
    """Frames with the guessed angles and rates, each where the joint that carries it puts it; loops stay open."""
    scene = assembly.model.scene
    return _placed(assembly, scene.guessed_angles, scene.guessed_rates)


def working_guess(assembly: MechanismSystem) -> dict[str, float] | None:
    """Angles by body, whole degrees, from which the constraints can be met at t = 0; None where none are found.

    Of random ones those nearest to the guess of the scene.
    """
    model, random = assembly.model, np.random.default_rng(0)
    names = [body.name for body in model.links]
    guessed = model.scene.guessed_angles
    given = np.array([guessed.get(name, 0.0) for name in names])
    found = []
    for _ in range(TRIES):
        met = _met(assembly, dict(zip(names, random.uniform(-np.pi, np.pi, len(names)), strict=True)))
        if met is None:
            continue
        theta = met[[assembly.first[assembly.index[name]] + 2 for name in names]]
        degrees = np.round(np.degrees(np.angle(np.exp(1j * theta))))
        if _met(assembly, dict(zip(names, np.radians(degrees), strict=True))) is not None:
            found.append(degrees)
    if not found:
        return None
    nearest = min(found, key=lambda degrees: float(np.abs(np.radians(degrees) - given).sum()))
    return dict(zip(names, nearest.tolist(), strict=True))


def _met(assembly: MechanismSystem, angles: Mapping[str, float]) -> Array | None:
    """Coordinates that meet the constraints at t = 0, in a regular configuration, from these angles (rad)."""
    q = solve_positions(assembly, 0.0, _placed(assembly, angles, {}).q)
    return q if q is not None and rank_ratio(assembly, 0.0, q) > REGULAR else None


def _placed(assembly: MechanismSystem, angles: Mapping[str, float], rates: Mapping[str, float]) -> State:
    """Frames with these angles (rad) and rates (rad/s) by body, 0 where there is none."""
    model = assembly.model
    q, v = np.zeros(assembly.system.coordinates), np.zeros(assembly.system.coordinates)
    for name, i in assembly.index.items():
        q[assembly.first[i] + 2] = angles.get(name, 0.0)
        v[assembly.first[i] + 2] = rates.get(name, 0.0)
    for name, carrier in model.scene.topology.grounded.items():
        joint = model.scene.joint[carrier.joint]
        at, rate = _motion(assembly, q, v, carrier.other, joint.at)
        arm = _arm(assembly, q, carrier.own)
        i = assembly.first[assembly.index[name]]
        slid, sliding = _slid(assembly, q, v, joint)
        outwards = 1.0 if joint.between[1] == carrier.own else -1.0
        q[i : i + 2] = at + outwards * slid - arm
        v[i : i + 2] = rate + outwards * sliding - v[i + 2] * perpendicular(arm)
    return State(q, v)


def _slid(assembly: MechanismSystem, q: Array, v: Array, joint: Joint) -> tuple[Array, Array]:
    """How far (2,) the second side of a joint has slid from the first, global axes, m; and its rate, m/s."""
    if joint.type != "prismatic":
        return np.zeros(2), np.zeros(2)
    initial, first = assembly.model.scene.initial, joint.bodies[0]
    theta, theta_dot = 0.0, 0.0
    if first != GROUND:
        i = assembly.first[assembly.index[first]] + 2
        theta, theta_dot = q[i], v[i]
    axis = rotated(theta, np.array(joint.unit_axis))
    way, rate = initial.joints.get(joint.name, 0.0), initial.joint_rates.get(joint.name, 0.0)
    return way * axis, rate * axis + way * theta_dot * perpendicular(axis)


def _arm(assembly: MechanismSystem, q: Array, side: str) -> Array:
    """A x (2,) of a point of an undeformed body: from its frame to the point in global axes, m."""
    name, point = split_point(side)
    body = assembly.index[name]
    theta = q[assembly.first[body] + 2]
    return rotated(theta, assembly.model.bodies[body].points[point].position)


def _motion(assembly: MechanismSystem, q: Array, v: Array, side: str, at: tuple[float, float]) -> tuple[Array, Array]:
    """Position (2,) and velocity (2,) of a placed point, or of a place on the ground."""
    if side == GROUND:
        return np.array(at), np.zeros(2)
    arm = _arm(assembly, q, side)
    i = assembly.first[assembly.index[split_point(side)[0]]]
    return q[i : i + 2] + arm, v[i : i + 2] + v[i + 2] * perpendicular(arm)
