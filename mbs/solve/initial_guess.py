"""The first guess of positions: frames placed from joint to joint, outwards from the ground."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ...common.plane import perpendicular, rotated
from ..fields.field_types import GROUND, split_point
from ..model.system import MechanismSystem
from .state import State


def initial_guess(assembly: MechanismSystem) -> State:
    """Frames with the guessed angles and rates, each where the joint that carries it puts it; loops stay open."""
    model = assembly.model
    q, v = np.zeros(assembly.system.coordinates), np.zeros(assembly.system.coordinates)
    for name, i in assembly.index.items():
        q[assembly.first[i] + 2] = model.scene.initial.angles.get(name, 0.0)
        v[assembly.first[i] + 2] = model.scene.initial.rates.get(name, 0.0)
    for name, carrier in model.scene.topology.grounded.items():
        at, rate = _motion(assembly, q, v, carrier.other, model.scene.joint[carrier.joint].at)
        arm = _arm(assembly, q, carrier.own)
        i = assembly.first[assembly.index[name]]
        q[i : i + 2] = at - arm
        v[i : i + 2] = rate - v[i + 2] * perpendicular(arm)
    return State(q, v)


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
