"""What is reported of a run: motion of points, forces of trajectories, reactions and moments of joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.plane import rotated
from ..analysis.planar_outcome import PlanarOutcome
from ..fields.field_types import split_point
from ..model.geometric_stiffening import second_order_displacement
from ..model.planar_body import PlanarBody
from ..model.planar_tree import PlanarTree
from .body_motion import BodyMotion, PointMotion


@dataclass(frozen=True)
class JointForces:
    """Constraint force on the second body of a joint in global axes, and constraint moment (weld, prismatic)."""

    reaction: Array  # (T, 2) N
    reaction_moment: Array | None  # (T,) N·m
    motor: Array | None  # (T,) N·m, or N for a prismatic joint


def body_motion(outcome: PlanarOutcome, body: PlanarBody) -> BodyMotion:
    """Motion of `body` in an analysis."""
    columns = outcome.coordinates(body.name)
    q, v = outcome.q[:, columns], outcome.v[:, columns]
    T = body.modal_transform if stored_coordinates(body) is None else np.eye(body.n_modes)
    return BodyMotion(q[:, :2], q[:, 2], v[:, :2], v[:, 2], q[:, 3:] @ T.T, v[:, 3:] @ T.T)


def stored_coordinates(body: PlanarBody) -> Array | None:
    """What makes p of the modal body file (n_file, n) of the coordinates that results give; None where they give p.

    They give the coordinates of the equations where these are fewer than the modes of the file.
    """
    n_file, n = body.modal_transform.shape
    return body.modal_transform if n < n_file else None


def modal_force(outcome: PlanarOutcome, body: PlanarBody) -> Array | None:
    """F_p (T, n), what patches would have to supply, in the coordinates of `BodyMotion.modal`; None where not known."""
    if outcome.F_p is None:
        return None
    F_p = outcome.F_p[:, outcome.modal_columns(body.name)]
    T = body.modal_transform if stored_coordinates(body) is None else np.eye(body.n_modes)
    return np.asarray(F_p @ np.linalg.pinv(T))  # the same work on δp


def modes_of_file(outcome: PlanarOutcome, body: PlanarBody) -> Array:
    """P (T, n_file) in the modes of the modal body file."""
    return np.asarray(outcome.q[:, outcome.coordinates(body.name)][:, 3:] @ body.modal_transform.T)


def point_motion(outcome: PlanarOutcome, reference: str) -> PointMotion:
    """Motion of "BODY.POINT": r = R + A (x + Φ p), and what geometric stiffening takes off Φp where it is on.

    Of a link in pieces the position is that of its pieces, and the deflection how far it is from x in the link's frame.
    """
    name, label = split_point(reference)
    body = outcome.assembly.model.body(name)
    point = body.points[label]
    q = outcome.q[:, outcome.coordinates(name)]
    if reference in outcome.point_names:
        assert outcome.in_pieces is not None
        position = point_motion(outcome.in_pieces, outcome.point_names[reference]).position
        return PointMotion(position, rotated(-q[:, 2], position - q[:, :2]) - point.position)
    deflection = q[:, 3:] @ point.translation.T + second_order_displacement(body.stiffening, label, q[:, 3:])
    return PointMotion(q[:, :2] + rotated(q[:, 2], point.position + deflection), deflection)


def trajectory_force(outcome: PlanarOutcome, trajectory: str) -> Array:
    """−λ_s (T, m): the force on the point in global axes, or the moment on the joint; a column per component."""
    columns = [i for i, c in enumerate(outcome.assembly.constraints) if c.is_trajectory and c.owner == trajectory]
    order = [c.component for c in outcome.assembly.model.trajectories if c.owner == trajectory]
    columns.sort(key=lambda i: order.index(outcome.assembly.constraints[i].component))
    return -outcome.lambda_[:, columns]


def trajectory_target(outcome: PlanarOutcome, trajectory: str) -> Array:
    """Specified values (T, m) in the order of `trajectory_force`; held before 0 and after the end of the analysis."""
    targets = [c.target for c in outcome.assembly.model.trajectories if c.owner == trajectory]
    return np.column_stack(
        [target.sample(np.clip(outcome.time, 0.0, outcome.analysis.last_time))[0] for target in targets]
    )


def joint_forces(outcome: PlanarOutcome, joint: str) -> JointForces:
    """Reaction of a joint on its second body, and what its motor does."""
    outcome = outcome.computed
    assembly, reaction, moment = outcome.assembly, np.zeros((len(outcome.time), 2)), None
    for i, constraint in enumerate(assembly.constraints):
        if constraint.is_trajectory or constraint.owner != joint:
            continue
        force = -outcome.lambda_[:, i]
        if constraint.measure.carries_moment:
            moment = force
        else:
            reaction += force[:, None] * assembly.force_direction(constraint.measure, outcome.q)
    motors = list(assembly.model.motors)
    moments = outcome.motor_moments
    motor = moments[:, motors.index(joint)] if moments is not None and joint in motors else None
    return JointForces(reaction, moment, motor)


def energies(outcome: PlanarOutcome) -> dict[str, Array]:
    """Kinetic, strain and gravitational energy (J) and dissipated power (W), each (T,)."""
    outcome = outcome.computed
    tree = PlanarTree(outcome.assembly)
    q, v, _ = tree.motion(outcome.q, outcome.v, np.zeros_like(outcome.v))
    values = tree.both.energies(q, v)
    return dict(zip(("kinetic", "strain", "gravitational", "dissipated_power"), values.T, strict=True))
