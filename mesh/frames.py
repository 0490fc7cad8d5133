"""Local axes, lengths in the file's unit, in which files of meshes have nodes: rectangular, cylindrical, spherical."""

from typing import Literal

import numpy as np

from ..common.arrays import Array
from ..common.structs import struct

Kind = Literal["rectangular", "cylindrical", "spherical"]


@struct
class Frame:
    """Coordinate system of a `kind`, with axes `C` (3, 3; columns) at `origin` (3,), file's unit, in global axes.

    Cylindrical coordinates are r, θ, z; spherical ones r, θ from the z axis, φ about it from the x axis (Nastran);
    angles in degrees.
    """

    origin: Array
    C: Array
    kind: Kind = "rectangular"

    @classmethod
    def through(cls, points: Array, axes: str, kind: Kind = "rectangular") -> "Frame":
        """Make a frame from `points` (3, 3), file's unit: its origin, one on its axis `axes[0]`, one towards `axes[1]`.

        `axes` are in cyclic order: "xy", "yz" or "zx". Raises `ValueError` for three points on one line.
        """
        origin = points[0]
        a, b = points[1:] - origin
        c = np.cross(a, b)
        if not np.linalg.norm(c) > 1e-9 * np.linalg.norm(a) * np.linalg.norm(b):
            raise ValueError("three points on one line")
        a, c = a / np.linalg.norm(a), c / np.linalg.norm(c)
        unit = {axes[0]: a, axes[1]: np.cross(c, a)}
        return cls(origin, np.stack([unit.get(axis, c) for axis in "xyz"], axis=1), kind)

    def points(self, coordinates: Array) -> Array:
        """Global coordinates (p, 3) of points with `coordinates` (p, 3) in this frame, in the file's unit."""
        a, b, c = np.asarray(coordinates, dtype=np.float64).T
        if self.kind == "rectangular":
            local = np.stack([a, b, c], axis=1)
        elif self.kind == "cylindrical":
            local = np.stack([a * np.cos(np.radians(b)), a * np.sin(np.radians(b)), c], axis=1)
        else:
            across = a * np.sin(np.radians(b))
            around = np.radians(c)
            local = np.stack([across * np.cos(around), across * np.sin(around), a * np.cos(np.radians(b))], axis=1)
        return self.origin + local @ self.C.T


GLOBAL = Frame(np.zeros(3), np.eye(3))
