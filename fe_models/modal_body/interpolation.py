"""What modes do between the stations of a link's axis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Integers
from .parts import Stations


class AlongAxis(NamedTuple):
    """Modes at m points of the axis: `position` (m, 3), m; `translation` and `rotation` (m, 3, n)."""

    position: Array
    translation: Array
    rotation: Array


def interpolate(stations: Stations, x: Array) -> AlongAxis:
    """Return the modes at `x` (m,), m from the root, within the stations; see `ModalBody.interpolate`."""
    element = stations.element
    if element is None:
        return _hermite(stations, x)
    beginnings = stations.position[element[:, 0], 0]
    index = np.clip(np.searchsorted(beginnings, x, side="right") - 1, 0, len(element) - 1)
    return through(stations, element[index], x)


def through(stations: Stations, members: Integers, x: Array) -> AlongAxis:
    """The polynomials through the stations `members` (m, i), at x (Lagrange)."""
    nodes = stations.position[members, 0]
    others = ~np.eye(nodes.shape[1], dtype=bool)
    ratios = (x[:, None, None] - nodes[:, None, :]) / (nodes[:, :, None] - nodes[:, None, :] + ~others)
    weights = np.prod(ratios, axis=2, where=others)
    return AlongAxis(
        np.einsum("mi,mik->mk", weights, stations.position[members]),
        np.einsum("mi,mikn->mkn", weights, stations.translation[members]),
        np.einsum("mi,mikn->mkn", weights, stations.rotation[members]),
    )


def _hermite(stations: Stations, x: Array) -> AlongAxis:
    """Cubic Hermite on v with v' = rotation_z and on w with w' = −rotation_y; the rest through four stations."""
    positions = stations.position[:, 0]
    k = positions.size
    i = np.clip(np.searchsorted(positions, x, side="right") - 1, 0, k - 2)
    first = np.minimum(np.maximum(i - 1, 0), max(k - 4, 0))
    near = through(stations, first[:, None] + np.arange(min(4, k)), x)
    h = (positions[i + 1] - positions[i])[:, None]
    s = (x[:, None] - positions[i][:, None]) / h
    for axis, turn, sign in ((1, 2, 1.0), (2, 1, -1.0)):
        before, after = stations.translation[i, axis], stations.translation[i + 1, axis]
        slopes = [sign * h * stations.rotation[at, turn] for at in (i, i + 1)]
        rise = after - before
        near.translation[:, axis] = (
            before + rise * s**2 * (3 - 2 * s) + s * (1 - s) * ((1 - s) * slopes[0] - s * slopes[1])
        )
        derivative = 6 * s * (1 - s) * rise + (1 - s) * (1 - 3 * s) * slopes[0] + s * (3 * s - 2) * slopes[1]
        near.rotation[:, turn] = sign * derivative / h
    return near
