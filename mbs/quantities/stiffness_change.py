"""What loads do to the stiffness of a link: eigenvalues of the change of all modes together.

Loads couple modes, bending with twist most of all, so that the change of each mode alone says nothing of buckling.
With S = Σ f_j K_j of loads of sizes f_j, the eigenvalues μ of K_ff^-½ S K_ff^-½ are the extreme relative changes of the
stiffness of any shape; at −1 a shape has none left (Bathe, Finite Element Procedures, §6.8.2, linearised buckling).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_floats

AT_ONCE = 64  # outputs whose eigenvalues are found together


class StiffnessChange(NamedTuple):
    """Over a run: the largest |μ|, and how many times the loads under which the link buckles are reached.

    `buckling` is −μ of the lowest, exact from 1 on; 0 where no loads soften the link.
    """

    largest: float = 0.0
    buckling: float = 0.0


class LoadedPoint(NamedTuple):
    """An interface at `position` (3,): what modes do there (6, n), and K (6, n, n) of forces and moments there."""

    position: Array
    by_modes: Array
    K: Array


class ModalLoads(NamedTuple):
    """Loads of sizes f (T, J) with geometric stiffness K (J, n, n), on modes of stiffness K_ff (n,).

    `held`: where the inner joint carries the link; rotations that the joint leaves free are 0 there.
    """

    f: Array
    K: Array
    stiffness: Array
    points: tuple[LoadedPoint, ...] = ()
    held: LoadedPoint | None = None

    @property
    def relative(self) -> Array:
        """(J, n, n) K_ff^-½ K K_ff^-½."""
        root = 1 / np.sqrt(self.stiffness)
        return as_floats(self.K * root * root[:, None])

    @property
    def squares(self) -> Array:
        """(T,) squares of the Frobenius norms of K_ff^-½ S K_ff^-½."""
        flat = self.relative.reshape(len(self.K), -1)
        return as_floats(np.maximum(np.einsum("tj,jk,tk->t", self.f, flat @ flat.T, self.f, optimize=True), 0.0))


def stiffness_change(loads: ModalLoads) -> StiffnessChange:
    """By the loads of a run."""
    largest, lowest = 0.0, 0.0
    for bound, mu in _eigenvalues(loads):
        largest, lowest = max(largest, float(np.abs(mu).max())), min(lowest, float(mu.min()))
        if bound <= largest and bound <= max(1.0, -lowest):
            break
    return StiffnessChange(largest, -lowest)


def _eigenvalues(loads: ModalLoads) -> Iterator[tuple[float, Array]]:
    """μ (…, n) of some outputs, and a bound of |μ| at all others: largest Frobenius norms of S first."""
    if not loads.f.size or not len(loads.stiffness):
        return
    f, K, squares = loads.f, loads.relative, loads.squares
    known = np.flatnonzero(np.isfinite(squares))
    order = known[np.argsort(-squares[known])]
    norms = np.append(np.sqrt(squares[order]), 0.0)
    for start in range(0, len(order), AT_ONCE):
        some = order[start : start + AT_ONCE]
        S = np.tensordot(f[some], K, axes=1)
        yield float(norms[start + len(some)]), as_floats(np.linalg.eigvalsh(S))
