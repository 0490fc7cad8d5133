"""The voltage equations of the patches, Φ_V V = F_p (Shaban 2022, Eqs. 22–23)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .patches import PatchArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Voltages:
    """Voltages of the patches of one body over time.

    Attributes:
        required: (T, k) V, with no limit; of least size or least residual where patches and modes differ in number.
        within_limit: (T, k) V, `required` cut to the limit of the patches.
        residual: (T,) norm of the modal force that `within_limit` leaves unmet.
    """

    required: Array
    within_limit: Array
    residual: Array

    @property
    def largest(self) -> float:
        """Largest required voltage, V."""
        return float(np.abs(self.required).max(initial=0.0))


def solve_voltages(patches: PatchArray, F_p: Array) -> Voltages:
    """Voltages that produce the modal forces F_p (T, n)."""
    n, k = patches.Phi_V.shape
    required = np.linalg.solve(patches.Phi_V, F_p.T).T if n == k else F_p @ np.linalg.pinv(patches.Phi_V).T
    limit = np.inf if patches.limit is None else patches.limit
    within_limit = np.clip(required, -limit, limit)
    residual = np.linalg.norm(F_p - within_limit @ patches.Phi_V.T, axis=1)
    return Voltages(required, within_limit, residual)
