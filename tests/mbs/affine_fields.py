"""The first moment of a bent body in 3D, and what geometric stiffening changes of its inertia: an oracle of the core.

The second-order field −½ pᵀG p counts by its mass-weighted projection on affine fields, products of 1, x, y, z with the
axes: the kinetic energy is then a sum of squares (docs/theory.md, Geometric stiffness). SI units, axes of the body.
"""

from typing import NamedTuple

import numpy as np

from ffrobot.common.arrays import Array, as_floats

NEGLIGIBLE = 1e-12  # of the largest mass moment: a line of mass has none across


def first_moment(body, p: Array) -> tuple[Array, Array]:
    """S (T, 3) kg·m of a body bent by p (T, n), and its derivatives by p (T, 3, n)."""
    s, s_p = body.first_moment + p @ body.S_bar.T, np.broadcast_to(body.S_bar, (len(p), *body.S_bar.shape))
    if body.stiffening is None:
        return s, s_p
    K_p = np.einsum("kmn,tn->tkm", body.stiffening.K_s, p)
    return s - 0.5 * np.einsum("tkm,tm->tk", K_p, p), s_p - K_p


class Fields(NamedTuple):
    """Products of fields φ_f with the position of the undeformed body g (3, r), with modes F (3, r, n) and G, by axis.

    They are orthonormal under the mass, φ_0 = 1/`root_mass`; a line of mass has two of them. K (3, r, n, n) is of G.
    """

    root_mass: float
    g: Array
    F: Array
    K: Array


def fields(body, stiffening) -> Fields:
    """Combinations of 1, x, y, z, by Gram and Schmidt in this order, without those that depend on others before."""
    N = np.block([[np.array([[body.mass]]), body.first_moment[None]], [body.first_moment[:, None], body.second_moment]])
    L, pivots = np.zeros((4, 4)), list[int]()
    for k in range(4):
        left = N[:, k] - L @ L[k]
        if left[k] > NEGLIGIBLE * N.diagonal()[1:].max() * (k > 0):
            L[:, len(pivots)] = left / np.sqrt(left[k])
            pivots.append(k)
    r = len(pivots)
    to_fields = np.linalg.inv(L[pivots, :r])
    F = np.concatenate([body.S_bar[None], body.I_bar])[pivots]  # (r, 3, n) with 1, x, y, z
    K = np.concatenate([stiffening.K_s[None], stiffening.K_x])[pivots]
    return Fields(
        float(np.sqrt(body.mass)), L[1:, :r], np.einsum("fe,ekn->kfn", to_fields, F),
        np.einsum("fe,ekmn->kfmn", to_fields, K),
    )  # fmt: skip


class AffineMotion(NamedTuple):
    """What the fields have of a body's position, g (T, 3, r), of its modes, F(p) (T, 3, r, n), and of −½ pᵀG p: K."""

    root_mass: float
    g: Array
    F: Array
    K: Array

    def accelerations(self, a: Array, w_dot: Array, w: Array, p_dot: Array, p_2dot: Array) -> Array:
        """(T, 3, r) with a (T, 3) of the frame less gravity, ω̇, ω (T, 3), ṗ, p̈ (T, n), in axes of the body."""
        g, g_dot = self.g, np.einsum("tkfn,tn->tkf", self.F, p_dot)
        found = np.einsum("tkfn,tn->tkf", self.F, p_2dot) - np.einsum("tm,kfmn,tn->tkf", p_dot, self.K, p_dot)
        found[..., 0] += self.root_mass * a
        accelerations: Array = found + _cross(w_dot, g) + _cross(w, _cross(w, g) + 2 * g_dot)
        return accelerations

    def velocities(self, u: Array, w: Array, p_dot: Array) -> Array:
        """(T, 3, r) with u (T, 3) of the frame."""
        found: Array = np.einsum("tkfn,tn->tkf", self.F, p_dot) + _cross(w, self.g)
        found[..., 0] += self.root_mass * u
        return found

    def forces(self, y: Array) -> tuple[Array, Array, Array]:
        """Along the frame (T, 3), about its origin (T, 3), on modes (T, n), of what y (T, 3, r) is to each field."""
        moment = np.cross(self.g, y, axis=1).sum(axis=-1)
        return self.root_mass * y[..., 0], moment, np.einsum("tkfn,tkf->tn", self.F, y)


def affine_motions(body, p: Array) -> tuple[AffineMotion, AffineMotion]:
    """Of a stiffened body bent by p (T, n): with terms of second order, and of the linear body."""
    assert body.stiffening is not None
    constants = fields(body, body.stiffening)
    g = constants.g + np.einsum("kfn,tn->tkf", constants.F, p)
    F = np.broadcast_to(constants.F, (len(p), *constants.F.shape))
    linear = AffineMotion(constants.root_mass, g, F, np.zeros_like(constants.K))
    K_p = np.einsum("kfmn,tn->tkfm", constants.K, p)
    second = 0.5 * np.einsum("tkfm,tm->tkf", K_p, p)
    return AffineMotion(constants.root_mass, g - second, F - K_p, constants.K), linear


def _cross(w: Array, x: Array) -> Array:
    """ω × x of w (T, 3) and x (T, 3, r)."""
    return as_floats(np.cross(w[:, :, None], x, axis=1))
