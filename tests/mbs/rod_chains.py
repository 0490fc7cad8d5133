"""Large bending without any beam theory: links as chains of rigid rods with torsion springs between them.

A double pendulum that falls from the horizontal; absolute angles of the rods are its coordinates. Shares nothing with
the program. Errors are of order 1/n², which `extrapolated` makes use of.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import solve


def fall(n, EI, length=1.0, mass=0.54, gravity=9.81, end=1.0, outputs=101):
    """Position of the tip (outputs, 2) of two links of n rods each, hinged to the ground and to each other."""
    m, h, count = mass / n, length / n, 2 * n
    beyond = count - 1 - np.arange(count)
    W = m * h**2 * (np.minimum.outer(beyond, beyond) + 0.5)
    np.fill_diagonal(W, m * h**2 * (beyond + 1 / 3))
    weight = m * gravity * h * (beyond + 0.5)
    K = np.zeros((count, count))
    for i in (*range(n - 1), *range(n, count - 1)):
        K[i : i + 2, i : i + 2] += EI / h * np.array([[1, -1], [-1, 1]])

    def slope(_, state):
        angle, rate = np.split(state, 2)
        between = angle[:, None] - angle
        Q = -(W * np.sin(between)) @ rate**2 - weight * np.cos(angle) - K @ angle
        return np.concatenate([rate, solve(W * np.cos(between), Q, assume_a="pos")])

    times = np.linspace(0, end, outputs)
    run = solve_ivp(slope, (0, end), np.zeros(2 * count), method="DOP853", t_eval=times, rtol=1e-8, atol=1e-8)
    angle = run.y[:count].T
    return h * np.column_stack([np.cos(angle).sum(axis=1), np.sin(angle).sum(axis=1)])


def extrapolated(n, EI, **keys):
    """From chains of n and 2n rods (Richardson)."""
    return (4 * fall(2 * n, EI, **keys) - fall(n, EI, **keys)) / 3
