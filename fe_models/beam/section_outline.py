"""Outlines of beam cross sections, for pictures: a beam is drawn as its section swept along the axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array
from ...mesh.records import RectangleSection, SectionRecord

ROUND_CORNERS = 16  # of the polygon that stands for a circle; divisible by 4


def section_outlines(sections: Sequence[SectionRecord]) -> Array:
    """(s, q, 2) corners (y, z) in m of each section's outer outline, the same number of all, counter-clockwise about x.

    Four where all are rectangles; otherwise rectangles have further ones along their sides.
    """
    q = 4 if all(isinstance(section, RectangleSection) for section in sections) else ROUND_CORNERS
    return np.array([_outline(section, q) for section in sections])


def _outline(section: SectionRecord, q: int) -> Array:
    if isinstance(section, RectangleSection):
        half = 0.5 * np.array([section.height, section.width])
        corners = np.array([[1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
        s = np.arange(0.0, 1.0, 4 / q)[:, None]
        sides = [a + s * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
        return np.asarray(np.concatenate(sides) * half)
    diameter = section.diameter if section.shape == "circle" else section.outer
    # Corner k at the angle of the rectangle's corner k, so that neighbours of other shape join without a twist.
    angle = 2 * np.pi * np.arange(q) / q - np.pi / 4
    return np.asarray(0.5 * diameter * np.stack([np.cos(angle), np.sin(angle)], axis=1))
