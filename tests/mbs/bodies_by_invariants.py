"""Bodies that move in the plane by their invariants, as docs/theory.md writes the (R, θ, p) equations."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ffrobot.common.arrays import Array
from ffrobot.mbs.fields.spelling import place
from ffrobot.mbs.model import body as bodies
from ffrobot.mbs.model.body import Body


@dataclass(frozen=True)
class PlanarPoint:
    """A point of a body: position (2,) m, Φx and Φy as `translation` (2, n), section rotation (n,), in body axes.

    K (3, n, n): geometric stiffness of forces along x and y and of a moment there.
    """

    position: Array
    translation: Array
    rotation: Array
    K: Array


@dataclass(frozen=True)
class PlanarBody:
    """Constants of one body in the equations of motion (docs/theory.md; Shabana, Dynamics of Multibody Systems, ch. 5).

    `m_ff` is the identity. Symbols: S_bar = S̄ (2, n); h = Ī_12 − Ī_21 (n,); j = Ī_11 + Ī_22 (n,);
    S_tilde = S̄_12 − S̄_21 (n, n); m_xy = S̄_11 + S̄_22 (n, n); first_moment s0 (2,) kg·m; inertia about the origin of
    the frame, kg·m²; stiffness K_ff (n,) rad²/s²; damping D_ff (n, n) 1/s. K_s (2, n, n), K_stretch and K_turn (n, n):
    integrals of what bending does to second order times 1, (x, y) and (−y, x); they vanish without stiffening.
    """

    name: str
    mass: float
    inertia: float
    first_moment: Array
    stiffness: Array
    damping: Array
    S_bar: Array
    h: Array
    j: Array
    S_tilde: Array
    m_xy: Array
    points: Mapping[str, PlanarPoint]
    length: float | None
    K_s: Array
    K_stretch: Array
    K_turn: Array

    @property
    def n_modes(self) -> int:
        """Number n of modal coordinates in the equations."""
        return len(self.stiffness)


def in_plane(body: Body) -> PlanarBody:
    """The invariants that count in z = 0. Payloads turn with their points, also where they have no extent."""
    S, n, stiffening = body.S_bar_kl, body.n_modes, body.stiffening
    K_s, K_x, turned = np.zeros((3, n, n)), np.zeros((3, 3, n, n)), np.zeros((3, 3, n, n))
    if stiffening is not None:
        K_s, K_x, turned = stiffening.K_s, stiffening.K_x, stiffening.S_turned
    points = {
        label: PlanarPoint(
            at.position[:2], at.translation[:2], at.rotation[2],
            np.zeros((3, n, n)) if stiffening is None else stiffening.at(label)[[0, 1, 5]],
        )
        for label, at in body.points.items()
    }  # fmt: skip
    return PlanarBody(
        name=body.name, mass=body.mass, inertia=body.inertia[2, 2], first_moment=body.first_moment[:2],
        stiffness=body.stiffness, damping=body.damping, S_bar=body.S_bar[:2], h=body.spin[2],
        j=body.I_bar[0, 0] + body.I_bar[1, 1], S_tilde=body.spin_slope[2], m_xy=S[0, 0] + S[1, 1] + turned[0, 0]
        + turned[1, 1], points=points, length=body.length, K_s=K_s[:2], K_stretch=K_x[0, 0] + K_x[1, 1],
        K_turn=K_x[0, 1] - K_x[1, 0],
    )  # fmt: skip


def rigid_body(name, mass, inertia, center, points) -> Body:
    """A body without modes, `inertia` about its center."""
    places = {label: place(position) for label, position in points.items()}
    return bodies.rigid_body(name, mass, place(center), inertia * np.eye(3), places)
