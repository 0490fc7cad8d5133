"""Rotations in 3D: quaternions (scalar first), rotation vectors, and their rates."""

from math import factorial

import numpy as np

TERMS = 20  # rounding is reached for |φ| up to 2π
# (−1)ᵏ/(2k + m)! by m, the highest k first.
COEFFICIENTS = {m: np.array([(-1) ** k / factorial(2 * k + m) for k in reversed(range(TERMS))]) for m in (1, 2, 3)}


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def rotation(e):
    """A(e)."""
    e0, v = e[0], e[1:]
    return (e0**2 - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * e0 * skew(v)


def turned(e, turn):
    """E ∘ exp(½ turn): the quaternion after a further rotation vector `turn` (3,) in body axes, of length one."""
    angle = np.linalg.norm(turn)
    c, s = np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * turn
    product = np.array([e[0] * c - e[1:] @ s, *(e[0] * s + c * e[1:] + np.cross(e[1:], s))])
    return product / np.linalg.norm(product)


def series(x, m):
    """Σ (−x)ᵏ/(2k + m)! and its derivative: (1 − cos φ)/φ² for m = 2, (φ − sin φ)/φ³ for m = 3, with x = φ²."""
    coefficients = COEFFICIENTS[m]
    return np.polyval(coefficients, x), np.polyval(coefficients[:-1] * np.arange(TERMS - 1, 0, -1), x)


def exponential(phi):
    """Exp φ~."""
    x, S = phi @ phi, skew(phi)
    return np.eye(3) + series(x, 1)[0] * S + series(x, 2)[0] * S @ S


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


def logarithm(C):
    """The rotation vector of C, by the quaternion of its largest component."""
    K = np.array([C[2, 1] - C[1, 2], C[0, 2] - C[2, 0], C[1, 0] - C[0, 1]])
    squares = np.array([1 + np.trace(C), *(1 - np.trace(C) + 2 * np.diag(C))]) / 4
    k = int(np.argmax(squares))
    e = np.empty(4)
    e[k] = np.sqrt(squares[k])
    if k == 0:
        e[1:] = K / (4 * e[0])
    else:
        e[0] = K[k - 1] / (4 * e[k])
        for j in range(1, 4):
            if j != k:
                e[j] = (C[j - 1, k - 1] + C[k - 1, j - 1]) / (4 * e[k])
    e *= np.sign(e[0]) or 1.0
    size = np.linalg.norm(e[1:])
    return np.zeros(3) if size == 0 else 2 * np.arctan2(size, e[0]) * e[1:] / size


def quaternion(C):
    """The unit quaternion of C, e0 ≥ 0."""
    phi = logarithm(C)
    return turned(np.array([1.0, 0, 0, 0]), phi)


def rotation_about(axis, angle):
    """A rotation by `angle` about coordinate axis 0, 1 or 2."""
    return exponential(angle * np.eye(3)[axis])


def random_rotation(rng):
    e = rng.standard_normal(4)
    return rotation(e / np.linalg.norm(e))
