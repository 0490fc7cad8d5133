"""The inertia shape integrals of a link as one value. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

from ...common.arrays import Array


@dataclass(frozen=True)
class Invariants:
    """Shapes, units and meaning as in `ModalBody`."""

    mass: float
    first_moment: Array
    second_moment: Array
    S_bar: Array
    I_bar: Array
    S_bar_kl: Array
    J_spin: float
    h_spin: Array
    S_spin: Array
