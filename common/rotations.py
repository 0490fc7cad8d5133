"""Rotations in space: rotation vectors φ, matrices (…, 3, 3), quaternions (…, 4; scalar first); φ~ is `skew`(φ).

A section turns by exp φ~ (docs/theory.md), with Ω = J_l φ̇.
"""

from math import factorial

import numpy as np

from .arrays import Array

NEAR = 1.0  # rad²: up to here the series below are exact to round-off, from here on closed forms lose no digits
TERMS = 10  # of the series
# Σ (−x)ᵏ/(2k + m)! by m, the highest power of x = φ² first: sin φ/φ, (1 − cos φ)/φ², (φ − sin φ)/φ³.
_SERIES = {m: np.array([(-1) ** k / factorial(2 * k + m) for k in reversed(range(TERMS))]) for m in (1, 2, 3)}


def skew(vectors: Array) -> Array:
    """The matrices φ~ (…, 3, 3) of the cross product with `vectors` φ (…, 3), in their unit."""
    vectors = np.asarray(vectors, dtype=float)
    S = np.zeros((*vectors.shape, 3))
    S[..., (2, 0, 1), (1, 2, 0)] = vectors
    S[..., (1, 2, 0), (2, 0, 1)] = -vectors
    return S


def exponential(vectors: Array) -> Array:
    """Rotation matrices exp φ~ (…, 3, 3) of rotation vectors φ (…, 3), rad."""
    return np.eye(3) + _of_skew(vectors, 1, 2)


def left_jacobian(vectors: Array) -> Array:
    """J_l (…, 3, 3), no unit, of rotation vectors φ (…, 3), rad: exp(φ + δφ) = exp(J_l δφ) exp(φ) to first order."""
    return np.eye(3) + _of_skew(vectors, 2, 3)


def left_jacobian_slope(vector: Array, of: Array) -> Array:
    """∂(J_l(φ) x)/∂φ (3, 3) of φ `vector` (3,) and x `of` (3,): −a x~ + (a' φ×x + b' φ×(φ×x)) 2φᵀ − b (φ×x)~ − b φ~x~.

    J_l = I + a φ~ + b φ~²; a', b' are the derivatives of a, b by φ². φ in rad, x and the result in any one unit.
    """
    across = np.cross(vector, of)
    (a, a_slope), (b, b_slope) = series(2, vector @ vector), series(3, vector @ vector)
    by_size = a_slope * across + b_slope * np.cross(vector, across)
    turning = a * skew(of) + b * (skew(across) + skew(vector) @ skew(of))
    return np.outer(by_size, 2 * vector) - turning


def series(m: int, x: Array) -> tuple[Array, Array]:
    """c_m = Σ (−x)ᵏ/(2k + m)! of any x = φ² ≥ 0, rad², and its derivative by x, both in the shape of x.

    c_1 = sin φ/φ, c_2 = (1 − cos φ)/φ², c_3 = (φ − sin φ)/φ³; c_m' = (c_{m−1} − m c_m)/(2x), with c_0 = cos φ.
    """
    near, far = np.minimum(x, NEAR), np.maximum(x, NEAR)
    slope = (_closed(m - 1, far) - m * _closed(m, far)) / (2 * far)
    near_slope = np.polyval(_SERIES[m][:-1] * np.arange(TERMS - 1, 0, -1), near)
    return _value(m, x), np.where(np.asarray(x) <= NEAR, near_slope, slope)


def _value(m: int, x: Array) -> Array:
    """c_m of any x = φ² ≥ 0."""
    near = np.polyval(_SERIES[m], np.minimum(x, NEAR))
    if np.max(x, initial=0.0) <= NEAR:
        return near
    return np.where(np.asarray(x) <= NEAR, near, _closed(m, np.maximum(x, NEAR)))


def _closed(m: int, x: Array) -> Array:
    """c_m of x = φ² away from 0."""
    phi = np.sqrt(x)
    if m < 2:
        return np.sin(phi) / phi if m else np.cos(phi)
    return (1 - np.cos(phi)) / x if m == 2 else (phi - np.sin(phi)) / (x * phi)


def _of_skew(vectors: Array, first: int, second: int) -> Array:
    S, x = skew(vectors), np.sum(np.square(vectors), axis=-1)[..., None, None]
    return _value(first, x) * S + _value(second, x) * (S @ S)


def of_quaternion(e: Array) -> Array:
    """The rotation matrices (…, 3, 3) of unit quaternions e (…, 4), no unit."""
    e0, v = e[..., 0, None, None], e[..., 1:]
    outer = v[..., :, None] * v[..., None, :]
    return (e0**2 - np.sum(v * v, axis=-1)[..., None, None]) * np.eye(3) + 2 * outer + 2 * e0 * skew(v)


def quaternions(C: Array) -> Array:
    """Unit quaternions (…, 4), e0 ≥ 0, of matrices (…, 3, 3), no unit, by the largest component (Shepperd 1978)."""
    trace = np.trace(C, axis1=-2, axis2=-1)
    diagonal = np.diagonal(C, axis1=-2, axis2=-1)
    squares = np.concatenate([1 + trace[..., None], 1 - trace[..., None] + 2 * diagonal], axis=-1)
    axial = C[..., (2, 0, 1), (1, 2, 0)] - C[..., (1, 2, 0), (2, 0, 1)]
    products = np.empty((*C.shape[:-2], 4, 4))  # 4 e eᵀ
    products[..., 0, 0] = squares[..., 0]
    products[..., 0, 1:] = products[..., 1:, 0] = axial
    products[..., 1:, 1:] = C + np.swapaxes(C, -1, -2)
    products[..., (1, 2, 3), (1, 2, 3)] = squares[..., 1:]
    largest = squares.argmax(axis=-1)[..., None, None]
    row = np.take_along_axis(products, np.broadcast_to(largest, (*C.shape[:-2], 1, 4)), axis=-2)[..., 0, :]
    row = row / np.linalg.norm(row, axis=-1)[..., None]
    return np.where(row[..., :1] < 0, -row, row)


def logarithm(C: Array) -> Array:
    """The rotation vectors (…, 3), rad, of matrices (…, 3, 3), of length π at most."""
    e = quaternions(C)
    size = np.linalg.norm(e[..., 1:], axis=-1)
    angle = 2 * np.arctan2(size, e[..., 0])
    factor = np.divide(angle, size, out=np.full_like(size, 2.0), where=size > 0)
    return e[..., 1:] * factor[..., None]


def about(axis: int, angles: Array | float) -> Array:
    """Rotation matrices (…, 3, 3) about coordinate axis 0, 1 or 2 by `angles` (…), rad."""
    cosine, sine = np.cos(angles), np.sin(angles)
    R = np.zeros((*np.shape(angles), 3, 3))
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R[..., axis, axis] = 1.0
    R[..., j, j] = R[..., k, k] = cosine
    R[..., j, k], R[..., k, j] = -sine, sine
    return R


def of_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """R_z(yaw) R_y(pitch) R_x(roll) (3, 3) of angles, rad, about fixed axes x, y, z in this order, as in URDF."""
    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def rpy_of(C: Array) -> list[float]:
    """Roll, pitch, yaw, rad, about fixed axes of a rotation matrix (3, 3), `of_rpy` back: pitch within ±π/2."""
    across = float(np.hypot(C[0, 0], C[1, 0]))
    yaw = float(np.arctan2(C[1, 0], C[0, 0])) if across > 1e-9 else 0.0  # else about the same axis as roll
    B = about(2, yaw).T @ C
    angles = np.arctan2(-B[1, 2], B[1, 1]), np.arctan2(-B[2, 0], B[0, 0]), yaw
    return [float(angle) + 0.0 for angle in angles]  # no −0.0


def unit(vector: Array) -> Array:
    """`vector` (3,), of any unit and length but 0, divided by its length, even where its square over- or underflows."""
    scaled = vector / np.abs(vector).max()
    return scaled / np.linalg.norm(scaled)


def smallest_turn(axis: Array) -> Array:
    """Matrix (3, 3) of the smallest rotation that brings z onto `axis` (3,), any unit; for −z a half turn about x."""
    z = unit(np.asarray(axis, dtype=float))
    S, cosine, square = skew(np.cross([0.0, 0.0, 1.0], z)), z[2], z[0] ** 2 + z[1] ** 2  # Rodrigues: S = sin φ n~
    if cosine > 0.0:
        return np.eye(3) + S + S @ S / (1.0 + cosine)
    if square == 0.0:
        return np.diag([1.0, -1.0, -1.0])
    return np.eye(3) + S + S @ S * ((1.0 - cosine) / square)


def in_3d(vectors: Array) -> Array:
    """Extend `vectors` (…, 2), any unit, of the plane z = 0 to (…, 3); spatial ones stay as they are."""
    return vectors if vectors.shape[-1] > 2 else np.concatenate([vectors, np.zeros_like(vectors[..., :1])], axis=-1)


def point_inertia(mass: float, place: Array) -> Array:
    """Inertia (3, 3) about the origin, kg·m², of a point mass (kg) at `place` (3,), m."""
    return mass * (place @ place * np.eye(3) - np.outer(place, place))
