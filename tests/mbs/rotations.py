"""Rotations in 3D: quaternions (scalar first), and rotation vectors. SciPy's, but for Jacobians."""

from math import factorial

import numpy as np
from scipy.spatial.transform import Rotation

TERMS = 20  # rounding is reached for |φ| up to 2π


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
    """Σ (−x)ᵏ/(2k + m)!: (1 − cos φ)/φ² for m = 2, (φ − sin φ)/φ³ for m = 3, with x = φ²."""
    return np.polyval([(-1) ** k / factorial(2 * k + m) for k in reversed(range(TERMS))], x)


def left_jacobian(phi):
    """J_l: exp(φ + δφ) = exp(J_l δφ) exp(φ) to first order."""
    x, S = phi @ phi, skew(phi)
    return np.eye(3) + series(x, 2) * S + series(x, 3) * S @ S


def rotation_about(axis, angle):
    """A rotation by `angle` about coordinate axis 0, 1 or 2."""
    return exponential(angle * np.eye(3)[axis])


def random_rotation(rng):
    return rotation(rng.standard_normal(4))
