"""Links in pieces as the one link: what was computed of the pieces, told in frame and modes of the link.

The frame is where the link's reference condition has it: at its root, along the section there (cantilever) or along the
chord to its tip (simply supported). The modal coordinates are those whose shape is nearest to the link's; its points
are where the pieces have them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..actuation.control.linear_models import LinearModels
from ..common.arrays import Array, as_floats
from ..common.plane import perpendicular, rotated
from ..fe_models.link_records import HOLDING_ROOT
from ..fe_models.modal_body import ModalBody
from ..mbs.analysis.outcome import Details, Forces, Motion
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.model.model import Constraint, Model
from ..mbs.model.planar_body import PlanarBody
from ..mbs.model.system import MechanismSystem
from ..mbs.quantities.stiffening import shortenings
from ..mbs.quantities.validity import ENOUGH, enough_pieces
from ..scene.pieces import BodyInPieces, places_on_pieces
from .bodies import LoadedBody
from .divided import as_divided
from .solution import Solution

MOST = 64


def wanted_pieces(solution: Solution) -> dict[str, int]:
    """How many pieces bodies with `pieces = "auto"` want after a solve, where that is more than they have.

    b of a piece goes down with the square of their number. A run that failed has bent links farther than they are.
    """
    bodies = solution.parts or solution.bodies
    stiffening = {name: body.planar.stiffening for name, body in bodies.items()}
    largest: dict[str, float] = {}
    for outcome in solution.outcomes.values():
        for name, b in shortenings(outcome, stiffening).items():
            largest[name] = max(largest.get(name, 0.0), float(b.max(initial=0.0)))
    wanted = {}
    for body in solution.scene.body:
        if body.pieces == "auto":
            divided = solution.divided.get(body.name)
            names = divided.names if divided else (body.name,)
            worst = max(largest.get(name, 0.0) for name in names)
            count = enough_pieces(worst, len(names)) if worst > ENOUGH else 1
            wanted[body.name] = max(min(MOST, count), len(names))
    now = {name: len(solution.divided[name].names) if name in solution.divided else 1 for name in wanted}
    return {} if wanted == now else wanted


def as_one_link(
    outcome: PlanarOutcome,
    whole: Model,
    links: Mapping[str, LoadedBody],
    divided: Mapping[str, BodyInPieces],
    pieces: Mapping[str, LoadedBody],
) -> PlanarOutcome:
    """The outcome of the scene of pieces, in the coordinates of the model without.

    Args:
        outcome: of the pieces.
        whole: the model without pieces.
        links: its bodies.
        divided: how some of them are cut.
        pieces: the bodies that were computed with.
    """
    q, v, a = _motions(outcome, whole, links, divided, pieces)
    held = any(outcome.assembly.is_trajectory)
    assembly = MechanismSystem(whole, (*whole.joints, *(whole.trajectories if held else ())))
    places = {_key(c): i for i, c in enumerate(outcome.assembly.constraints)}
    columns = [places[_key(c)] for c in assembly.constraints]
    motion = Motion(outcome.time, q, v, a, outcome.lambda_[:, columns], outcome.residual)
    forces = Forces(outcome.tau, _modal_forces(outcome, whole, links, divided, pieces))
    return replace(
        outcome, assembly=assembly, motion=motion, forces=forces, in_pieces=outcome,
        point_names=places_on_pieces(divided), details=_details(outcome, whole, links, divided, pieces),
    )  # fmt: skip


def _modal_forces(
    outcome: PlanarOutcome,
    whole: Model,
    links: Mapping[str, LoadedBody],
    divided: Mapping[str, BodyInPieces],
    pieces: Mapping[str, LoadedBody],
) -> Array | None:
    """F_p on the modes of the links: by virtual work, from those on their pieces."""
    F_p = outcome.F_p
    if F_p is None:
        return None
    forces = []
    for body in whole.bodies:
        if body.name in divided:
            link = as_divided(links[body.name], divided[body.name], pieces)
            forces.append(F_p[:, outcome.modal_columns(*link.bodies)] @ link.spread)
        else:
            forces.append(F_p[:, outcome.modal_columns(body.name)])
    return as_floats(np.concatenate(forces, axis=1))


def _details(
    outcome: PlanarOutcome,
    whole: Model,
    links: Mapping[str, LoadedBody],
    divided: Mapping[str, BodyInPieces],
    pieces: Mapping[str, LoadedBody],
) -> Details:
    """Linear models tell how the links move; their coordinates stay those of the pieces."""
    details = outcome.details
    if not isinstance(details, LinearModels):
        return details

    def turned(k: int, delta_q: Array) -> Array:
        """δq (f, coordinates) of the pieces, about output k, as δq of the links: rates are linear in rates."""
        rows = [k] * len(delta_q)
        about = Motion(
            outcome.time[rows], outcome.q[rows], delta_q, np.zeros_like(delta_q), outcome.lambda_[rows],
            outcome.residual[rows],
        )  # fmt: skip
        return as_floats(_motions(replace(outcome, motion=about), whole, links, divided, pieces)[1])

    models = tuple(
        replace(model, transformation=turned(k, model.transformation.T).T) for k, model in enumerate(details.models)
    )
    modes = tuple(
        replace(of, motion=turned(k, of.motion.real) + 1j * turned(k, of.motion.imag))
        for k, of in enumerate(details.modes)
    )
    return replace(details, models=models, modes=modes)


def _motions(
    outcome: PlanarOutcome,
    whole: Model,
    links: Mapping[str, LoadedBody],
    divided: Mapping[str, BodyInPieces],
    pieces: Mapping[str, LoadedBody],
) -> Array:
    """(q, v, a) (3, T, coordinates) of the model without pieces."""
    states = [
        _motion_of_link(outcome, links[body.name], divided[body.name], pieces)
        if body.name in divided
        else np.array([x[:, outcome.coordinates(body.name)] for x in (outcome.q, outcome.v, outcome.a)])
        for body in whole.bodies
    ]
    return as_floats(np.concatenate(states, axis=2))


def _key(constraint: Constraint) -> tuple[bool, str, str]:
    return constraint.is_trajectory, constraint.owner, constraint.component


def _motion_of_link(
    outcome: PlanarOutcome, link: LoadedBody, body: BodyInPieces, pieces: Mapping[str, LoadedBody]
) -> Array:
    """(R, θ, p) of the one link, with rates and accelerations: (3, T, 3 + n)."""
    modal = link.modal
    assert modal is not None
    x = modal.stations.position[:, 0]
    r = np.array([_point_on_axis(outcome, body, pieces, at) for at in x])  # (stations, 3, T, 2)
    root, tip = r[np.argmin(x)], r[np.argmax(x)]
    theta = (
        _section_angle(outcome, body, pieces)
        if modal.reference_condition in HOLDING_ROOT
        else _chord(outcome, body, root, tip)
    )
    y = _in_frame(r - root, theta)
    y[:, 0] -= np.column_stack([x, np.zeros_like(x)])[:, None]
    p = _nearest_shape(modal, link.planar, y)
    return np.concatenate([root, theta[:, :, None], p], axis=2)


def _point_on_axis(outcome: PlanarOutcome, body: BodyInPieces, pieces: Mapping[str, LoadedBody], x: float) -> Array:
    """Position, velocity and acceleration (3, T, 2) of the point of the axis at x (m from the root), global axes."""
    k = int(np.clip(np.searchsorted(body.cut.starts, x, side="right") - 1, 0, len(body.names) - 1))
    piece = pieces[body.names[k]]
    assert piece.modal is not None
    at = piece.modal.interpolate(min(x - body.cut.starts[k], piece.modal.length))
    return point_track(outcome, piece.planar, at.position[:2], at.translation[:2] @ piece.planar.modal_transform)


def point_track(outcome: PlanarOutcome, body: PlanarBody, position: Array, Phi: Array) -> Array:
    """R = R + A(x + Φp), with rate and acceleration: (3, T, 2)."""
    columns = outcome.coordinates(body.name)
    q, v, a = (each[:, columns] for each in (outcome.q, outcome.v, outcome.a))
    (theta, theta_dot, theta_ddot) = (each[:, 2] for each in (q, v, a))
    u, u_dot, u_ddot = position + q[:, 3:] @ Phi.T, v[:, 3:] @ Phi.T, a[:, 3:] @ Phi.T
    turned = theta_dot[:, None] * perpendicular(u)
    second = (
        u_ddot
        + theta_ddot[:, None] * perpendicular(u)
        + 2 * theta_dot[:, None] * perpendicular(u_dot)
        - (theta_dot**2)[:, None] * u
    )
    return np.array(
        [q[:, :2] + rotated(theta, u), v[:, :2] + rotated(theta, u_dot + turned), a[:, :2] + rotated(theta, second)]
    )


def _section_angle(outcome: PlanarOutcome, body: BodyInPieces, pieces: Mapping[str, LoadedBody]) -> Array:
    """Angle of the section at the root, rate and acceleration (3, T)."""
    planar = pieces[body.names[0]].planar
    columns, phi = outcome.coordinates(planar.name), planar.points["root"].rotation
    return np.array(
        [each[:, columns][:, 2] + each[:, columns][:, 3:] @ phi for each in (outcome.q, outcome.v, outcome.a)]
    )


def _chord(outcome: PlanarOutcome, body: BodyInPieces, root: Array, tip: Array) -> Array:
    """Angle of the line from root to tip, rate and acceleration (3, T)."""
    d, d_dot, d_ddot = tip - root
    near = outcome.q[:, outcome.coordinates(body.names[0])][:, 2]  # keeps count of turns
    along = rotated(-near, d)
    square = np.sum(d * d, axis=1)
    rate = np.sum(perpendicular(d) * d_dot, axis=1) / square
    second = (np.sum(perpendicular(d) * d_ddot, axis=1) - 2 * rate * np.sum(d * d_dot, axis=1)) / square
    return np.array([near + np.arctan2(along[:, 1], along[:, 0]), rate, second])


def _in_frame(r: Array, theta: Array) -> Array:
    """Y = Aᵀr of vectors r (…, 3, T, 2) with their rates and accelerations, in a frame at θ (3, T)."""
    angle, rate, second = theta
    y, back_1, back_2 = (rotated(-angle, each) for each in np.moveaxis(r, -3, 0))
    y_dot = back_1 - rate[:, None] * perpendicular(y)
    y_ddot = (
        back_2 - second[:, None] * perpendicular(y) + (rate**2)[:, None] * y - 2 * rate[:, None] * perpendicular(y_dot)
    )
    return np.stack([y, y_dot, y_ddot], axis=-3)


def _nearest_shape(modal: ModalBody, body: PlanarBody, u: Array) -> Array:
    """P (3, T, n) for which Φp comes nearest to displacements u (stations, 3, T, 2), with rates and accelerations."""
    Phi = (modal.stations.translation[:, :2] @ body.modal_transform).reshape(-1, body.n_modes)  # (stations · 2, n)
    flat = np.moveaxis(u, 3, 1).reshape(len(Phi), -1)
    p = as_floats(np.linalg.lstsq(Phi, flat, rcond=None)[0])
    return np.moveaxis(p.reshape(body.n_modes, *u.shape[1:3]), 0, 2)
