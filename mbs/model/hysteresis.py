"""Hysteresis of patches by play operators, and its inverse.

Of a voltage V over time the play operator of threshold r has z = max(V − r, min(V + r, z)), and a patch acts as under
the voltage Σ w z (Prandtl and Ishlinskii). The inverse has the same form (Kuhnen, Eur. J. Control 9, 2003, eq. 20):
with W_i = w_0 + … + w_i its weights are 1/W_i − 1/W_(i−1), its thresholds Σ_(j≤i) w_j (r_i − r_j).
"""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.structs import struct

MOST_PLAYS = 32
CHUNK = 1024  # voltages, all on one way up or down, whose play operators are found together


@struct
class Hysteresis:
    """Play operators of k patches; thresholds ascend from 0, spare ones have no weight."""

    weights: Array  # (MOST_PLAYS, k)
    thresholds: Array  # (MOST_PLAYS, k) V

    @property
    def acts(self) -> bool:
        """Whether the force of any patch is not proportional to its voltage."""
        return bool(self.weights[1:].any() or (self.weights[:1] != 1.0).any())

    @property
    def inverse(self) -> Hysteresis:
        """Voltages that patches take to act as wanted, from rest on."""
        W = np.cumsum(self.weights, axis=0)
        weights = np.diff(1.0 / W, axis=0, prepend=0.0)
        return Hysteresis(weights, W * self.thresholds - np.cumsum(self.weights * self.thresholds, axis=0))

    def plays(self, z: Array, V: Array) -> Array:
        """Return z (…, MOST_PLAYS, k) at voltages V (…, k), all on one way up or down, after z (MOST_PLAYS, k), V."""
        V = V[..., None, :]
        return np.clip(z, V - self.thresholds, V + self.thresholds)

    def acting(self, plays: Array) -> Array:
        """Return the voltages (…, k) that patches act under, Σ w z, of `plays` (…, MOST_PLAYS, k), V."""
        return as_floats((self.weights * plays).sum(axis=-2))

    def output(self, V: Array) -> Array:
        """Return the voltages (T, k) that patches act under of V (T, k), straight between these, from rest."""
        acting, z = np.empty_like(V), np.zeros_like(self.weights)
        turns = np.flatnonzero(np.diff(np.sign(np.diff(V, axis=0)), axis=0).any(axis=1)) + 2
        begins = np.union1d(turns, np.arange(0, len(V), CHUNK))
        for one, way in zip(np.split(acting, begins[1:]), np.split(V, begins[1:]), strict=True):
            plays = self.plays(z, way)
            one[:], z = self.acting(plays), plays[-1]
        return acting


class Played:
    """State of play operators that are asked step by step, from rest on."""

    def __init__(self, of: Hysteresis) -> None:
        self._of, self._z = of, np.zeros_like(of.weights)

    def at(self, V: Array, last: Array | None = None) -> Array:
        """Return the voltages (k,) that patches act under at V (k,), on their way to the `last` (k,)."""
        output = self._of.acting(self._of.plays(self._z, V))
        self._z = self._of.plays(self._z, V if last is None else last)
        return output
