"""Where the nodes along the axis of a link lie. NumPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..common.arrays import Array

# Points closer than this, relative to the length, are one point.
COINCIDENT = 1e-9


def graded_nodes(breakpoints: Sequence[float], elements: int) -> Array:
    """Nodes of `elements` elements between the first and the last of `breakpoints`, with a node at each of them.

    Within a segment the elements are equal; they are shared out so that the longest is as short as possible. A uniform
    mesh that meets all breakpoints is therefore kept.

    Args:
        breakpoints: (s + 1,) ascending ends of the s segments, in m.
        elements: at least s.

    Returns:
        (elements + 1,) ascending coordinates in m, breakpoints included exactly.

    Raises:
        ValueError: fewer elements than segments.
    """
    lengths = np.diff(np.asarray(breakpoints, dtype=np.float64))
    if elements < lengths.size:
        raise ValueError(f"{lengths.size} segments need at least {lengths.size} elements, found {elements}")
    shares = np.ones(lengths.size, dtype=np.int64)
    for _ in range(elements - lengths.size):
        shares[np.argmax(lengths / shares)] += 1
    pieces = [
        np.linspace(start, end, share + 1)
        for start, end, share in zip(breakpoints[:-1], breakpoints[1:], shares, strict=True)
    ]
    return np.concatenate([pieces[0][:1], *(piece[1:] for piece in pieces)])


def with_points(nodes: Array, points: Sequence[float]) -> Array:
    """`nodes` (m,) and `points` in one ascending list (≥ m,); a point that coincides with a node adds nothing."""
    length = nodes[-1] - nodes[0]
    merged = list(nodes)
    for point in points:
        if np.min(np.abs(np.asarray(merged) - point)) > COINCIDENT * length:
            merged.append(point)
    return np.sort(np.asarray(merged, dtype=np.float64))
