"""Families of the modes of a solid: found by the kinetic energy in the mean motion of its cross sections.

Of a mode with unit modal mass, the sections' mean translation (u, v, w) and rotation (φ_x, φ_y, φ_z) carry the shares

    axial ∫ρA u² dx,  torsion ∫ρ(I_y + I_z) φ_x² dx,  in-plane bending ∫ρA v² + ρI_z φ_z² dx,  out-of-plane likewise.

The largest names the family; where together they carry less than half, the mode is `local`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array, Integers
from ...common.structs import struct
from ..link_records.families import FAMILIES, LOCAL
from .functionals import Averages

# Relative distance up to which neighboring ω² are one repeated value.
REPEATED = 1e-9
# Where one family is wanted, modes this near are taken apart into it and the others.
NEARLY = 1e-3
# Simpson's 3/8 rule on the four stations of an element, exact for cubics.
SIMPSON = np.array([1.0, 3.0, 3.0, 1.0]) / 8


@struct
class SectionShapes:
    """Mean motion of the cross sections at the k stations, weighted such that sums of squares are energies."""

    families: tuple[Array, ...]  # by the order of `FAMILIES`, (rows, n) each

    def energy(self) -> Array:
        """Share (4, n) of each family in the modal mass."""
        return np.array([np.sum(rows**2, axis=0) for rows in self.families])

    def turned(self, Q: Array) -> SectionShapes:
        """Return the shapes of the modes Φ Q."""
        return SectionShapes(tuple(rows @ Q for rows in self.families))


def section_motion(
    averages: Averages,
    x: Array,
    element: Integers,
    translation: Array,
    rotation: Array,
    attached: Sequence[tuple[Array, Array]] = (),
) -> SectionShapes:
    """Motion of the sections at x (k,), stations of `element` (e, 4); translation and rotation (k, 3, n).

    `attached`: of each mass on an interface, the motion there (6, n) and its weights (6,).
    """
    line = np.zeros(x.size)
    np.add.at(line, element, (x[element[:, 3]] - x[element[:, 0]])[:, None] * SIMPSON)
    mass = np.sqrt(line * averages.density * averages.area)[:, None]
    turn = np.sqrt(line * averages.density)[:, None] * np.sqrt(np.einsum("kii->ki", averages.inertia))
    moved = [mass * translation[:, axis] for axis in range(3)]
    turned = [turn[:, axis, None] * rotation[:, axis] for axis in range(3)]
    for motion, weights in attached:
        rows = np.sqrt(weights)[:, None] * motion
        for axis in range(3):
            moved[axis] = np.concatenate([moved[axis], rows[[axis]]])
            turned[axis] = np.concatenate([turned[axis], rows[[3 + axis]]])
    bending = np.concatenate([moved[1], turned[2]]), np.concatenate([moved[2], turned[1]])
    return SectionShapes((*bending, moved[0], turned[0]))


def names(motion: SectionShapes) -> list[str]:
    """Family of each mode."""
    share = motion.energy()
    total, first = share.sum(axis=0), share.argmax(axis=0)
    return [FAMILIES[i] if whole >= 0.5 else LOCAL for whole, i in zip(total, first, strict=True)]


def aligned(omega2: Array, motion: SectionShapes, wanted: Sequence[str] | str) -> Array:
    """Return Q (n, n), orthogonal, that rotates modes of equal frequency to the families: a reproducible basis.

    `omega2` (n,) is ascending, `motion` that of the modes. For `wanted` families (not "all") modes of nearly equal
    frequency are turned too: into Ritz vectors, of which one has all that the cluster has of a family.
    """
    Q = np.eye(omega2.size)
    gap = REPEATED if wanted == "all" else NEARLY
    first = 0
    for last in range(1, omega2.size + 1):
        if last < omega2.size and omega2[last] - omega2[last - 1] <= gap * omega2[last]:
            continue
        if last - first > 1:
            Q[first:last, first:last] = _turn([rows[:, first:last] for rows in motion.families], wanted)
        first = last
    return Q


def _turn(families: Sequence[Array], wanted: Sequence[str] | str) -> Array:
    """(m, m): principal axes of the families' energies, each weighted by its number so that none are equal."""
    weights = [4.0, 3.0, 2.0, 1.0]
    if wanted != "all":
        weights = [w * (name in wanted) for w, name in zip(weights, FAMILIES, strict=True)]
    weights = [w / max(weights) if len(wanted) == 1 else w for w in weights]
    energy = sum(weight * rows.T @ rows for weight, rows in zip(weights, families, strict=True))
    return np.asarray(np.linalg.eigh(energy)[1][:, ::-1])
