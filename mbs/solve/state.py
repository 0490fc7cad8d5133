"""State of a mechanism."""

from __future__ import annotations

from dataclasses import dataclass

from ...common.arrays import Array


@dataclass(frozen=True)
class State:
    """Positions q (n_q,) and velocities v (n_v,) of the tree: m, rad, √kg·m and these per s."""

    q: Array
    v: Array
