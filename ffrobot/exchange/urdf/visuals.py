"""Simple shapes for viewers: the sections of beams, and bars from a link's frame to its other points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...common.arrays import Array
from ...common.rotations import rpy_of, smallest_turn
from ...fe_models.modal_body import ModalBody
from .robot import Numbers3, Origin, Primitive

SLENDER = 40.0  # bars: length of the longest by their radius
ALIKE = 1e-9  # sections whose sizes differ by less, relative, are one shape


def beam_visuals(body: ModalBody, anchor: Array) -> Iterator[Primitive]:
    """The undeformed beam by the outer sizes of its sections, a shape for each length over which they are the same.

    `anchor` (3,) is where the link's frame is, in axes of the body. Round where the outline has more than four corners.
    """
    stations = body.stations
    height = stations.height
    width = height if stations.width is None else stations.width
    is_round = stations.outline is not None and stations.outline.shape[1] > 4
    last = len(height) - 1  # sizes hold from a station to the next
    sizes = np.stack([height, width], axis=1)[:last]
    changes = np.any(np.abs(np.diff(sizes, axis=0)) > ALIKE * sizes.max(), axis=1)
    first = 0
    for end in [*(np.flatnonzero(changes) + 1), last]:
        a, b = stations.position[first], stations.position[end]
        length, center = float(np.linalg.norm(b - a)), (a + b) / 2 - anchor
        if is_round:
            yield Primitive(
                "cylinder", (float(sizes[first].max()) / 2, length), Origin(_three(center), (0.0, np.pi / 2, 0.0))
            )
        else:
            yield Primitive("box", (length, float(height[first]), float(width[first])), Origin(_three(center)))
        first = end


def bars(points: Sequence[Array], radius: float) -> Iterator[Primitive]:
    """From the frame to each of `points` (3,), axes of the link; a sphere where there is none away from it."""
    away = [point for point in points if np.any(point)]
    for point in away:
        rpy = rpy_of(smallest_turn(point))
        yield Primitive("cylinder", (radius, float(np.linalg.norm(point))), Origin(_three(point / 2), _three(rpy)))
    if not away:
        yield Primitive("sphere", (2 * radius,), Origin())


def _three(values: Sequence[float] | Array) -> Numbers3:
    x, y, z = (float(value) for value in values)
    return x, y, z
