"""What a chain of stiffened pieces misses: by how much rods with the strains of its pieces end elsewhere.

The equations know where the ends of a piece are to second order in its modal coordinates p (`model.spatial_bending`);
its energy is that of the curvatures (Φ_r p)' and of the stretch and shear of Φp. A rod of the same strains, and so of
the same energy, ends where its sections, each turned from the last, take it (Simo, Comput. Methods Appl. Mech. Eng. 49,
1985). The difference of the ends, carried to the end of the chain, is the estimate: it is of third order, and needs no
measured factor. What bending in one plane, at whatever angle, leaves is far less than what bending in two or twist do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.rotations import exponential, left_jacobian, logarithm
from ...fe_models.modal_body import ModalBody
from ..model.bending import bent_section
from ..model.body import Body
from ..model.tree import Motion

INTERVALS = 16  # of a piece, over each of which curvature is constant but for its share in the direction
X = np.array([1.0, 0.0, 0.0])


class PieceInMotion(NamedTuple):
    """A piece: its modal body, its equations, its p (T, n) in these, and its sections at root and tip over time."""

    modal: ModalBody
    body: Body
    p: Array
    root: Motion
    tip: Motion


class Ends(NamedTuple):
    """The section at the tip of a piece seen from that at its root: axes A (T, 3, 3), place r (T, 3) m."""

    A: Array
    r: Array


def missed_by_pieces(pieces: Sequence[PieceInMotion]) -> Array:
    """By how much the tip of the last piece is off (T, 3), m, global axes; pieces from the root on."""
    end, missed = pieces[-1].tip.r, np.zeros_like(pieces[-1].tip.r)
    for piece in pieces:
        rod = rod_ends(piece.modal, piece.p @ piece.body.modal_transform.T)
        known = ends_in_equations(piece.body, piece.p)
        turn = logarithm(rod.A @ np.swapaxes(known.A, -1, -2))
        moved, turned = (np.einsum("tij,tj->ti", piece.root.F, off) for off in (rod.r - known.r, turn))
        missed += moved + np.cross(turned, end - piece.tip.r)
    return missed


def ends_in_equations(body: Body, p: Array) -> Ends:
    """As the equations of a piece have them at p (T, n)."""
    root, tip = (bent_section(body, end, p) for end in ("root", "tip"))
    back = np.swapaxes(exponential(root.phi), -1, -2)
    return Ends(as_floats(back @ exponential(tip.phi)), as_floats(np.einsum("tij,tj->ti", back, tip.u - root.u)))


def rod_ends(modal: ModalBody, p: Array) -> Ends:
    """Of the rod with the strains of p (T, n of the file)."""
    x = np.linspace(0.0, modal.length, 2 * INTERVALS + 1)  # with the middles of intervals
    places, h = [modal.interpolate(at) for at in x], x[2]
    phi, u = (
        np.array([p @ of.T for of in kind])
        for kind in zip(*((at.rotation, at.translation) for at in places), strict=True)
    )
    A, r = np.tile(np.eye(3), (len(p), 1, 1)), np.zeros((len(p), 3))
    for k in range(0, 2 * INTERVALS, 2):
        turn, mean = phi[k + 2] - phi[k], (phi[k] + 4 * phi[k + 1] + phi[k + 2]) / 6
        strain = u[k + 2] - u[k] - np.cross(mean, h * X)
        uneven = np.cross(mean - phi[k] - turn / 2, h * X)  # of curvature
        step = np.einsum("tij,tj->ti", left_jacobian(turn), h * X + strain) + uneven
        r, A = r + np.einsum("tij,tj->ti", A, step), A @ exponential(turn)
    return Ends(as_floats(A), as_floats(r))
