"""Voltage equations of the patches, Φ_V V = F_p (Shabana 2022, Eqs. 22–23), as patches with limits can meet them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, as_floats
from ...mbs import _core
from .reach import Reach


@dataclass(frozen=True)
class Voltages:
    """Voltages of patches over time.

    Attributes:
        required: (T, k) V, with no limit; of least size or least residual where patches and modes differ in number.
        within_limit: (T, k) V, the best within the limits of the patches.
        unmet: (T, n) modal forces that `within_limit` leaves.
        served: number of modes, the first ones, that the patches are to serve.
    """

    required: Array
    within_limit: Array
    unmet: Array
    served: int

    @property
    def residual(self) -> Array:
        """(T,) norm of the modal force on modes to be served that `within_limit` leaves unmet."""
        norms: Array = np.linalg.norm(self.unmet[:, : self.served], axis=1)
        return norms

    @property
    def largest(self) -> float:
        """Largest required voltage, V."""
        return float(np.abs(self.required).max(initial=0.0))


def voltage_scale(patches: Reach) -> Array:
    """Ordinary voltages (k,) of the patches: their limits, the largest of these where a patch has none, else 1 V."""
    known = np.isfinite(patches.limit)
    return np.where(known, patches.limit, patches.limit[known].max() if known.any() else 1.0)


def voltage_gain(patches: Reach) -> Array:
    """Voltages (k, n) per modal force without limits: Φ_V⁻¹, or those of least weighted residual.

    Of many that do, the smallest relative to `voltage_scale`.
    """
    (n, k), served = patches.Phi_V.shape, patches.served
    if k == served and patches.serves_all:
        return as_floats(np.linalg.inv(patches.Phi_V[:served]) @ np.eye(served, n))
    W_sqrt = patches.in_order if patches.serves_all else patches.W_sqrt
    scale = voltage_scale(patches)
    gain: Array = scale[:, None] * np.linalg.pinv(W_sqrt @ patches.Phi_V * scale) @ W_sqrt
    return gain


def allocation(patches: Reach, *, limited: bool) -> _core.Allocation:
    """What turns modal forces into voltages, with the limits of the patches or without."""
    limit = patches.limit if limited else np.full_like(patches.limit, np.inf)
    return _core.Allocation(patches.Phi_V, patches.W_sqrt, voltage_gain(patches), limit, voltage_scale(patches))


def solve_voltages(patches: Reach, F_p: Array) -> Voltages:
    """Voltages that produce the modal forces F_p (T, n), or as much of them as they can."""
    F_p = np.ascontiguousarray(F_p)
    required = F_p @ voltage_gain(patches).T
    within_limit = allocation(patches, limited=True).solve(F_p)
    return Voltages(required, within_limit, F_p - within_limit @ patches.Phi_V.T, patches.served)
