"""State of a mechanism."""

from __future__ import annotations

from dataclasses import dataclass

from ...common.arrays import Array


@dataclass(frozen=True)
class State:
    """Coordinates q = (R, θ, p of each body), (coordinates,), and their rates v: m, rad, √kg·m and these per s."""

    q: Array
    v: Array
