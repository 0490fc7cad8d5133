"""The inertia shape integrals of a link as one value, and the permutation symbol. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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


# ε_abc, (3, 3, 3): (u × v)_a = ε_abc u_b v_c.
LEVI_CIVITA = np.array([[[(a - b) * (b - c) * (c - a) / 2 for c in range(3)] for b in range(3)] for a in range(3)])
