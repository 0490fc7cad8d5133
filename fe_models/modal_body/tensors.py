"""The permutation symbol, for cross products of arrays."""

import numpy as np

# ε_abc, (3, 3, 3): (u × v)_a = ε_abc u_b v_c.
LEVI_CIVITA = np.array([[[(a - b) * (b - c) * (c - a) / 2 for c in range(3)] for b in range(3)] for a in range(3)])
