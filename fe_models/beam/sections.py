"""Properties of the sections of a beam, by element and by family of motion, and outlines for pictures."""

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array, Integers
from ...mesh.records import RectangleSection, SectionRecord
from ..link_records.families import Family
from ..link_records.link import BeamLink


def shear_modulus(link: BeamLink) -> float:
    """G = E / (2 (1 + ν)) in Pa; the link file has been checked for ν where G is needed."""
    assert link.material.poissons_ratio is not None
    return link.material.youngs_modulus / (2 * (1 + link.material.poissons_ratio))


def rod_properties(link: BeamLink, family: Family, nodes: Array) -> tuple[Array, Array]:
    """EA, N, and ρA, kg/m, of axial, GJ, N·m², and ρI_p, kg·m, of torsional motion, (e,) between `nodes`, m."""
    stiffness, inertia = ("area", "area") if family == "axial" else ("torsion", "I_p")
    modulus = link.material.youngs_modulus if family == "axial" else shear_modulus(link)
    return modulus * cellwise(link, nodes, stiffness), link.material.density * cellwise(link, nodes, inertia)


def cellwise(link: BeamLink, nodes: Array, name: str) -> Array:
    """A property (e,) of `Section`, in its own unit, of each element between `nodes` (e + 1,), m."""
    return section_property(link, 0.5 * (nodes[1:] + nodes[:-1]), name)


def section_property(link: BeamLink, x: Array, name: str) -> Array:
    """A property (k,) of `Section`, in its own unit, at x (k,), m; at a step of the section, beyond it."""
    return np.array([getattr(section, name) for section in link.sections])[segments(link, x)]


def segments(link: BeamLink, x: Array) -> Integers:
    """Numbers (…), from 0, of segments at x (…), m; at a step of the section, of the one beyond it."""
    return np.searchsorted(link.geometry.breakpoints[1:-1], x, side="right")


ROUND_CORNERS = 16  # of the polygon that stands for a circle; divisible by 4


def section_outlines(sections: Sequence[SectionRecord]) -> Array:
    """Corners (s, q, 2), (y, z) in m, of each section's outer outline, counter-clockwise about x.

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
        return np.concatenate(sides) * half
    # Corner k at the angle of the rectangle's corner k, so that neighbors of other shape join without a twist.
    angle = 2 * np.pi * np.arange(q) / q - np.pi / 4
    return 0.5 * section.outer * np.stack([np.cos(angle), np.sin(angle)], axis=1)
