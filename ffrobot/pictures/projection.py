"""Directions of view on links, planar scenes and 3D ones; marks and colors."""

from typing import NamedTuple

import numpy as np

from ..common.arrays import Array

AXIS_LENGTH, TOOL_LENGTH = 0.07, 0.09  # of the robot's size: how far from a joint its axes reach, axes of tools
TOOL_COLORS = ("#D55E00", "#009E73", "#0072B2")  # of x, y, z


class View(NamedTuple):
    """Direction of view: unit vectors (3,) to the right and up in the picture, and towards the viewer."""

    right: Array
    up: Array
    viewer: Array


def _view(azimuth: float, elevation: float) -> View:
    """Z goes up, the viewer stands at an azimuth about it from x on, degrees."""
    a, e = np.radians([azimuth, elevation])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    viewer = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return View(right, np.cross(viewer, right), viewer)


# The link's x goes right, its y up, as in planar scenes; the viewer stands before z, towards the root and above.
LINK = View(*(axis[[1, 2, 0]] for axis in _view(-28.0, 24.0)))
PLANE = View(*np.eye(3))  # of planar scenes: the viewer looks against z
SPACE = _view(-55.0, 25.0)  # of 3D scenes: the viewer stands in front of −y, towards +x and above
_X, _Y, _Z = np.eye(3)
FRONT, SIDE = View(_X, _Z, -_Y), View(_Y, _Z, _X)  # z goes up, as well; from above it is PLANE

# Okabe and Ito, "Color universal design" (2008), without the yellow that paper swallows, and a gray that
# is seen on light and dark pages for black.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#7A7A7A")
LIMIT = COLORS[6]  # of what motors and patches can do
