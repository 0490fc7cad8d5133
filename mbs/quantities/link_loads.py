"""All loads on a link over a motion, as multiples of unit loads: forces at interfaces, and those of its inertia.

What joints transmit follows from the motion: with f = M a − Q of all bodies (Newton and Euler), less what is known
(given loads, friction, gears, rotors), the forces in joints and of motors solve C_qᵀ λ = −f in the rows of the frames.
So forces that an inverse analysis has along its trajectories count as the moments of motors that stand for them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Array
from ...common.plane import perpendicular, rotated
from ..analysis.planar_outcome import PlanarOutcome
from ..fields.field_types import split_point
from ..joints.measure import FRAME
from ..model.model import ZERO, Constraint, Model
from ..model.planar_body import PlanarBody
from ..model.system import MechanismSystem

FORCES_AT_POINTS = "points"  # value of `apply` whose forces act elsewhere than in joints


@dataclass(frozen=True)
class LinkLoads:
    """What acts on a link over a motion.

    Attributes:
        sizes: (T,) of unit loads by their names (`fe_models.modal_body.unit_loads`).
        modal_force: (T, n) N/√kg, what else acts on its modes, in the coordinates of the equations: patches.
    """

    sizes: Mapping[str, Array]
    modal_force: Array


def link_loads(outcome: PlanarOutcome, bodies: Iterable[str]) -> dict[str, LinkLoads]:
    """Of each of `bodies`. Nothing where it is not known what acts: forces at actuation points, links in pieces."""
    if outcome.in_pieces is not None or getattr(outcome.analysis, "apply", None) == FORCES_AT_POINTS:
        return {}
    model = outcome.assembly.model
    wrenches, left = _wrenches(outcome)
    found = {}
    for name in bodies:
        motion = _Motion(outcome, model.body(name))
        at_points = {point: motion.in_body_axes(w) for point, w in wrenches[name].items() if point != FRAME}
        for payload in model.scene.payload:
            body, point = split_point(payload.point)
            if body == name:
                inertia = motion.of_mass(point, payload.mass, payload.inertia)
                at_points[point] = at_points.get(point, 0.0) + inertia
        named = {load: column for point, wrench in at_points.items() for load, column in _named(point, wrench)}
        found[name] = LinkLoads(motion.of_frame() | named, left[:, outcome.coordinates(name)][:, 3:])
    return found


class _Motion:
    """Of one body, in its own axes; gravity counts as an acceleration of the frame the other way."""

    def __init__(self, outcome: PlanarOutcome, body: PlanarBody) -> None:
        columns = outcome.coordinates(body.name)
        q, v, a = outcome.q[:, columns], outcome.v[:, columns], outcome.a[:, columns]
        self.body = body
        self.angle = q[:, 2]
        self.p, self.p_dot, self.p_ddot = q[:, 3:], v[:, 3:], a[:, 3:]
        self.omega, self.alpha = v[:, 2], a[:, 2]
        self.acceleration = rotated(-self.angle, a[:, :2] - np.array(outcome.assembly.model.scene.gravity))

    def in_body_axes(self, wrench: Array) -> Array:
        """Force and moment (T, 3) from global axes."""
        return np.column_stack([rotated(-self.angle, wrench[:, :2]), wrench[:, 2]])

    def of_frame(self) -> dict[str, Array]:
        """Sizes of the d'Alembert forces of the frame's motion."""
        a_x, a_y = self.acceleration.T
        return {"t_x": a_x, "t_y": a_y, "r_z": self.alpha, "omega_zz": self.omega**2}

    def of_mass(self, point: str, mass: float, inertia: float) -> Array:
        """Force and moment (T, 3) of the inertia of a payload: −m a of its point, −I times its angular acceleration."""
        at = self.body.points[point]
        x = at.position + self.p @ at.translation.T
        alpha, omega = self.alpha[:, None], self.omega[:, None]
        a = self.acceleration + alpha * perpendicular(x) - omega**2 * x
        a += 2.0 * omega * perpendicular(self.p_dot @ at.translation.T) + self.p_ddot @ at.translation.T
        return np.column_stack([-mass * a, -inertia * (self.alpha + self.p_ddot @ at.rotation)])


def _named(point: str, wrench: Array) -> Iterable[tuple[str, Array]]:
    names = (f"force/{point}/x", f"force/{point}/y", f"moment/{point}/z")
    return zip(names, wrench.T, strict=True)


def _wrenches(outcome: PlanarOutcome) -> tuple[Mapping[str, Mapping[str, Array]], Array]:
    """On points of bodies (T, 3), global axes; and the generalized forces (T, coordinates) that these leave."""
    model = replace(outcome.assembly.model, modal_loads=())  # of patches: they are told with what is left
    loads = model.loads if outcome.details.loads is None else outcome.details.loads
    acting = MechanismSystem(model, [*model.joints, *_actuated(outcome)], loads)
    time, (q, v, a) = outcome.time, (np.ascontiguousarray(x) for x in (outcome.q, outcome.v, outcome.a))
    frames = acting.frame_coordinates
    f, C_q = acting.system.required_forces(time, q, v, a), acting.system.constraint_jacobians(q)
    lambda_ = _solved(C_q[:, :, frames], -f[:, frames])
    left: Array = f + np.einsum("tri,tr->ti", C_q, lambda_)
    return acting.marker_wrenches(time, q, v, a, lambda_), left


def _actuated(outcome: PlanarOutcome) -> list[Constraint]:
    """Rows along which motors act, or forces on the trajectories where these stand for themselves."""
    model = outcome.assembly.model
    if getattr(outcome.analysis, "apply", None) == "trajectory":
        return list(model.trajectories)
    held = [row for row in outcome.assembly.constraints if row.is_trajectory]
    if held and len(model.motors) != model.degrees_of_freedom:
        return held
    return [_along(name, model) for name in model.motors]


def _along(motor: str, model: Model) -> Constraint:
    return Constraint(model.motors[motor], ZERO, motor, "motor", is_trajectory=False)


def _solved(C_q: Array, right: Array) -> Array:
    """λ (T, rows) of C_qᵀ λ = right for C_q (T, rows, frames): there is one, of as many rows or fewer."""
    transposed = C_q.transpose(0, 2, 1)
    if C_q.shape[1] == C_q.shape[2]:
        try:
            return np.asarray(np.linalg.solve(transposed, right[..., None])[..., 0])
        except np.linalg.LinAlgError:  # a singular posture: the smallest forces
            pass
    return np.asarray((np.linalg.pinv(transposed) @ right[..., None])[..., 0])
