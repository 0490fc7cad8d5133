"""What modes do between the stations of a link's axis."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Integers
from .parts import Interface, Stations


def interpolate(stations: Stations, x: float) -> Interface:
    """What the modes do at `x` (m from the root, within the stations) on the axis: see `ModalBody.interpolate`."""
    element = stations.element
    if element is None:
        return _hermite(stations, x)
    beginnings = stations.position[element[:, 0], 0]
    index = np.clip(np.searchsorted(beginnings, x, side="right") - 1, 0, len(element) - 1)
    return _through(stations, element[index], x)


def _through(stations: Stations, members: Integers, x: float) -> Interface:
    """The polynomial through the stations `members`, at x (Lagrange)."""
    nodes = stations.position[members, 0]
    others = ~np.eye(len(nodes), dtype=bool)
    weights = np.prod((x - nodes) / (nodes[:, None] - nodes + ~others), axis=1, where=others)
    return Interface(
        weights @ stations.position[members],
        np.einsum("i,ikn->kn", weights, stations.translation[members]),
        np.einsum("i,ikn->kn", weights, stations.rotation[members]),
    )


def _hermite(stations: Stations, x: float) -> Interface:
    """Cubic Hermite on v with v' = rotation_z and on w with w' = −rotation_y; the rest through four stations."""
    positions = stations.position[:, 0]
    k = positions.size
    i = int(np.clip(np.searchsorted(positions, x, side="right") - 1, 0, k - 2))
    first = min(max(i - 1, 0), max(k - 4, 0))
    near = _through(stations, np.arange(first, min(first + 4, k)), x)
    h = positions[i + 1] - positions[i]
    s = (x - positions[i]) / h
    translation, rotation = near.translation.copy(), near.rotation.copy()
    for axis, turn, sign in ((1, 2, 1.0), (2, 1, -1.0)):
        values = stations.translation[i : i + 2, axis]
        slopes = sign * h * stations.rotation[i : i + 2, turn]
        rise = values[1] - values[0]
        translation[axis] = values[0] + rise * s**2 * (3 - 2 * s) + s * (1 - s) * ((1 - s) * slopes[0] - s * slopes[1])
        derivative = 6 * s * (1 - s) * rise + (1 - s) * (1 - 3 * s) * slopes[0] + s * (3 * s - 2) * slopes[1]
        rotation[turn] = sign * derivative / h
    return Interface(near.position, translation, rotation)
