"""Orientations that are specified over time: by rotation vectors, by roll, pitch and yaw, or by one direction."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ...common.arrays import Array, as_list
from ...common.errors import InputError
from ...common.rotations import (
    about,
    exponential,
    left_jacobian,
    left_jacobian_rate,
    logarithm,
    of_quaternion,
    quaternions,
)
from ...common.structs import struct
from .._core import TimeFunction
from .waypoints import Waypoints

QUATERNION = ("qw", "qx", "qy", "qz")
UNIT = 1e-3  # how far from 1 the length of a quaternion in a table may be
Reference = tuple[float, float, float]
"""A rotation vector, rad."""
WIDEST = 2.8  # rad from the middle of all orientations of a table: a rotation vector is smooth well below π


@struct
class OrientationLaw:
    """A triad A(t), or its third axis alone ("direction")."""

    # what `functions` are: a rotation vector ψ, A = exp(ψ~) exp(reference~); roll, pitch and yaw about fixed axes; or
    # components of a direction of any length
    kind: Literal["rotation_vector", "rpy", "direction"]
    functions: tuple[TimeFunction, ...]  # three functions of time, rad
    reference: Reference = (0.0, 0.0, 0.0)  # rotation vector (3,), rad

    def sample(self, times: Array) -> Array:
        """A (T, 3, 3), columns its axes; of a direction z is along it, by the smallest turn."""
        x = np.array([function.sample(times)[0] for function in self.functions]).T
        if self.kind == "rotation_vector":
            return exponential(x) @ exponential(np.array(self.reference))
        if self.kind == "rpy":
            return about(2, x[:, 2]) @ about(1, x[:, 1]) @ about(0, x[:, 0])
        return turned_to(x)

    def rates(self, times: Array) -> tuple[Array, Array]:
        """ω and α (T, 3) in global axes; of a direction, without spin about it."""
        x, x_dot, x_2dot = np.moveaxis(np.array([function.sample(times) for function in self.functions]), 0, -1)
        if self.kind == "rotation_vector":
            return _rates_of_vector(x, x_dot, x_2dot)
        if self.kind == "rpy":
            return _rates_of_rpy(x, x_dot, x_2dot)
        size = np.linalg.norm(x, axis=-1, keepdims=True)
        z = x / size
        slope = np.sum(x_dot * x, axis=-1, keepdims=True) / size**2
        z_dot = x_dot / size - slope * z
        return np.cross(z, z_dot), np.cross(z, x_2dot / size - 2 * slope * z_dot)


def turned_to(directions: Array) -> Array:
    """Triads (T, 3, 3) with z along `directions` (T, 3), each by the smallest turn from the z axis."""
    z = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    across = np.cross([0.0, 0.0, 1.0], z)
    size = np.linalg.norm(across, axis=-1, keepdims=True)
    angle = np.arctan2(size, z[:, 2:])
    half_turn = np.array([np.pi, 0.0, 0.0])
    vectors = np.divide(across * angle, size, out=np.where(z[:, 2:] < 0, half_turn, 0.0), where=size > 0)
    return exponential(vectors)


def _rates_of_vector(psi: Array, psi_dot: Array, psi_2dot: Array) -> tuple[Array, Array]:
    """ω = J_l ψ̇, α = J_l ψ̈ + (dJ_l/dt) ψ̇, the last by the exact derivative of exp along ψ̇."""
    J_l = left_jacobian(psi)
    omega = np.einsum("tij,tj->ti", J_l, psi_dot)
    return omega, np.einsum("tij,tj->ti", J_l, psi_2dot) + left_jacobian_rate(psi, psi_dot)


def _rates_of_rpy(x: Array, x_dot: Array, x_2dot: Array) -> tuple[Array, Array]:
    """ω = ẏ e_z + ṗ R_z e_y + ṙ R_z R_y e_x, and its rate."""
    R_z = about(2, x[:, 2])
    yaw, pitch, roll = np.broadcast_to(np.eye(3)[2], x.shape), R_z[:, :, 1], (R_z @ about(1, x[:, 1]))[:, :, 0]
    by_yaw, by_pitch = x_dot[:, 2:] * yaw, x_dot[:, 1:2] * pitch
    omega = by_yaw + by_pitch + x_dot[:, :1] * roll
    alpha = x_2dot[:, 2:] * yaw + x_2dot[:, 1:2] * pitch + x_2dot[:, :1] * roll
    turning = x_dot[:, 1:2] * np.cross(by_yaw, pitch) + x_dot[:, :1] * np.cross(by_yaw + by_pitch, roll)
    return omega, alpha + turning


def orientation_of(table: Waypoints) -> tuple[Waypoints, Reference]:
    """The columns qw, qx, qy, qz of a table as those of a rotation vector, and the reference that it turns.

    It is log(A A_refᵀ) about the middle of all orientations: splines of it have all the derivatives that they have of
    numbers, where those of quaternions by pieces jump in angular velocity. Raises `InputError` for a row that is no
    unit quaternion, and for orientations too far apart for one rotation vector.
    """
    columns = [table.columns.index(name) for name in QUATERNION]
    e = table.values[:, columns]
    length = np.linalg.norm(e, axis=1)
    if (bad := np.flatnonzero(np.abs(length - 1) > UNIT)).size:
        raise InputError(f"row {bad[0] + 1}: expected qw, qx, qy, qz of length 1, found {length[bad[0]]:.6g}")
    psi, reference = about_their_middle(of_quaternion(e / length[:, None]), "row")
    return Waypoints(("rx", "ry", "rz"), table.times, psi), reference


def about_their_middle(A: Array, each: str) -> tuple[Array, Reference]:
    """Rotation vectors (T, 3) of triads A (T, 3, 3) against their middle, and its own: see `orientation_of`.

    A straight line between two of them is a turn about a fixed axis where these are all there are.
    Raises `InputError` where orientations are too far apart, which calls them `each` and a number.
    """
    middle = _middle(A)
    psi = logarithm(A @ middle.T)
    if (far := np.linalg.norm(psi, axis=1)).max() > WIDEST:
        raise InputError(
            f"{each} {far.argmax() + 1}: expected orientations within {np.degrees(WIDEST):.0f} degrees of their middle,"
            f" found {np.degrees(far.max()):.0f}: divide the motion, or give rotation_vector or rpy as expressions"
        )
    x, y, z = as_list(logarithm(middle))
    return psi, (x, y, z)


def _middle(A: Array) -> Array:
    """The rotation nearest to all of A (T, 3, 3): the polar factor of their mean."""
    U, _, V = np.linalg.svd(A.mean(axis=0))
    middle: Array = U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V
    return of_quaternion(quaternions(middle))
