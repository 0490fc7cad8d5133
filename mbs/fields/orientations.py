"""Orientations that are specified over time: by rotation vectors, by roll, pitch and yaw, or by one direction."""

from functools import cached_property
from typing import Literal

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import exponential, logarithm, of_quaternion, quaternions
from ...common.structs import struct
from .. import _core
from .._core import TimeFunction
from .waypoints import QUATERNION as QUATERNION
from .waypoints import Waypoints

UNIT = 1e-3  # how far from 1 the length of a quaternion in a table may be
Reference = tuple[float, float, float]
"""A rotation vector, rad."""
WIDEST = 2.8  # rad from the middle of all orientations of a table: a rotation vector is smooth well below π


@struct
class OrientationLaw:
    """Prescribed triad A(t) in global axes, or its third axis alone ("direction")."""

    # what `functions` are: a rotation vector ψ, A = exp(ψ~) exp(reference~); roll, pitch and yaw about fixed axes; or
    # components of a direction of any length
    kind: Literal["rotation_vector", "rpy", "direction"]
    functions: tuple[TimeFunction, ...]  # three functions of time, rad (direction: no unit)
    reference: Reference = (0.0, 0.0, 0.0)  # rotation vector (3,), rad

    @cached_property
    def in_core(self) -> _core.TurningLaw:
        """The law as a record of the core, which evaluates it at any time, with ω (rad/s) and α (rad/s²)."""
        kind, reference = getattr(_core.OrientationKind, self.kind), exponential(np.array(self.reference))
        return _core.TurningLaw(kind, list(self.functions), reference)

    def sample(self, times: Array) -> Array:
        """Triads A (T, 3, 3), unit columns, at `times` (T,), s; for a direction the smallest turn of z to it."""
        return self.in_core.sample(times)[0].reshape(-1, 3, 3)


def orientation_of(table: Waypoints) -> tuple[Array, Reference]:
    """Rotation vectors (T, 3), rad, of columns qw, qx, qy, qz from their mean orientation, and that of the mean.

    Splines of these vectors are smooth; interpolated quaternions would jump in angular velocity. Raises `InputError`
    for a row that is no unit quaternion, and for orientations too far apart for one rotation vector.
    """
    columns = [table.columns.index(name) for name in QUATERNION]
    e = table.values[:, columns]
    length = np.linalg.norm(e, axis=1)
    if (bad := np.flatnonzero(np.abs(length - 1) > UNIT)).size:
        raise InputError(f"row {bad[0] + 1}: expected qw, qx, qy, qz of length 1", f"{length[bad[0]]:.6g}")
    return about_their_middle(of_quaternion(e / length[:, None]), "row")


def about_their_middle(A: Array, each: str) -> tuple[Array, Reference]:
    """Rotation vectors (T, 3), rad, of triads A (T, 3, 3) from their mean orientation, and that of the mean.

    With two triads the straight line between their vectors is a rotation about a fixed axis. Raises `InputError`, which
    calls a triad `each` and a number, where orientations are too far apart.
    """
    U, _, V = np.linalg.svd(A.mean(axis=0))  # the rotation nearest to all is the polar factor of their mean
    middle = of_quaternion(quaternions(U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V))
    psi = logarithm(A @ middle.T)
    if (far := np.linalg.norm(psi, axis=1)).max() > WIDEST:
        raise InputError(
            f"{each} {far.argmax() + 1}: expected orientations within {np.degrees(WIDEST):.0f} degrees of their middle",
            f"{np.degrees(far.max()):.0f}: divide the motion, or give rotation_vector or rpy as expressions",
        )
    x, y, z = logarithm(middle).tolist()
    return psi, (x, y, z)
