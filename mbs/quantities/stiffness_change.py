"""What loads do to the stiffness of a link: eigenvalues of the change of all modes together.

Loads couple modes, bending with twist most of all, so that the change of each mode alone says nothing of buckling.
With S = Σ f_j K_j of loads of sizes f_j, the eigenvalues μ of K_ff^-½ S K_ff^-½ are the extreme relative changes of the
stiffness of any shape; at −1 a shape has none left (Bathe, Finite Element Procedures, §6.8.2, linearised buckling).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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


NO_CHANGE = StiffnessChange()


def stiffness_change(sizes: Sequence[Array], matrices: Sequence[Array], stiffness: Array) -> StiffnessChange:
    """Of loads of `sizes` (T,) with geometric stiffness `matrices` (n, n), on modes of `stiffness` K_ff (n,)."""
    largest, lowest = 0.0, 0.0
    for bound, mu in _eigenvalues(sizes, matrices, stiffness):
        largest, lowest = max(largest, float(np.abs(mu).max())), min(lowest, float(mu.min()))
        if bound <= largest and bound <= max(1.0, -lowest):
            break
    return StiffnessChange(largest, -lowest)


def _eigenvalues(sizes: Sequence[Array], matrices: Sequence[Array], stiffness: Array) -> Iterator[tuple[float, Array]]:
    """μ (…, n) of some outputs, and a bound of |μ| at all others: largest Frobenius norms of S first."""
    if not len(sizes) or not len(stiffness):
        return
    f, root, n = np.stack(sizes, axis=1), 1 / np.sqrt(stiffness), len(stiffness)
    K = (np.stack(matrices) * root * root[:, None]).reshape(len(f[0]), -1)
    squares = np.einsum("tj,jk,tk->t", f, K @ K.T, f, optimize=True)
    known = np.flatnonzero(np.isfinite(squares))
    order = known[np.argsort(-squares[known])]
    norms = np.append(np.sqrt(np.maximum(squares[order], 0.0)), 0.0)
    for start in range(0, len(order), AT_ONCE):
        some = order[start : start + AT_ONCE]
        yield float(norms[start + len(some)]), as_floats(np.linalg.eigvalsh((f[some] @ K).reshape(-1, n, n)))
