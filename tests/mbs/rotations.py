"""Rotations in 3D: quaternions (scalar first), rotation vectors, and their rates. SciPy's, but for Jacobians."""

from math import factorial

import numpy as np
from scipy.spatial.transform import Rotation

TERMS = 20  # rounding is reached for |φ| up to 2π
# (−1)ᵏ/(2k + m)! by m, the highest k first.
COEFFICIENTS = {m: np.array([(-1) ** k / factorial(2 * k + m) for k in reversed(range(TERMS))]) for m in (2, 3)}


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def rotation(e):
    """A(e)."""
    return Rotation.from_quat(np.roll(e, -1)).as_matrix()


def exponential(phi):
    """Exp φ~."""
    return Rotation.from_rotvec(phi).as_matrix()


def logarithm(C):
    """The rotation vector of C."""
    return Rotation.from_matrix(C).as_rotvec()


def quaternion(C):
    """The unit quaternion of C, e0 ≥ 0."""
    e = np.roll(Rotation.from_matrix(C).as_quat(), 1)
    return e * (np.sign(e[0]) or 1.0)


def series(x, m):
    """Σ (−x)ᵏ/(2k + m)! and its derivative: (1 − cos φ)/φ² for m = 2, (φ − sin φ)/φ³ for m = 3, with x = φ²."""
    coefficients = COEFFICIENTS[m]
    return np.polyval(coefficients, x), np.polyval(coefficients[:-1] * np.arange(TERMS - 1, 0, -1), x)


def left_jacobian(phi):
    """J_l: exp(φ + δφ) = exp(J_l δφ) exp(φ) to first order."""
    x, S = phi @ phi, skew(phi)
    return np.eye(3) + series(x, 2)[0] * S + series(x, 3)[0] * S @ S


def left_jacobian_rate(phi, phi_dot):
    """(dJ_l/dt) φ̇."""
    x, across = phi @ phi, np.cross(phi, phi_dot)
    (_, a_slope), (b, b_slope) = series(x, 2), series(x, 3)
    x_dot = 2 * phi @ phi_dot
    twice = np.cross(phi, across)
    return a_slope * x_dot * across + b_slope * x_dot * twice + b * np.cross(phi_dot, across)


def rotation_about(axis, angle):
    """A rotation by `angle` about coordinate axis 0, 1 or 2."""
    return exponential(angle * np.eye(3)[axis])


def random_rotation(rng):
    return rotation(rng.standard_normal(4))
