"""Properties of the sections of a beam, by element and by family of motion, and outlines for pictures."""

from collections.abc import Callable, Sequence

import numpy as np

from ...common.arrays import Array
from ...mesh.records import RectangleSection, SectionRecord
from ..link_records.families import Family
from ..link_records.link import BeamLink
from ..link_records.section import Section

Property = Callable[[Section], float]


def shear_modulus(link: BeamLink) -> float:
    """G = E / (2 (1 + ν)) in Pa; the link file has been checked for ν where G is needed."""
    assert link.material.poissons_ratio is not None
    return link.material.youngs_modulus / (2 * (1 + link.material.poissons_ratio))


def rod_properties(link: BeamLink, family: Family) -> tuple[Property, Property]:
    """Stiffness, EA in N or GJ in N·m², and mass or moment of inertia per length, of axial or torsional motion."""
    E, rho = link.material.youngs_modulus, link.material.density
    if family == "axial":
        return lambda s: E * s.area, lambda s: rho * s.area
    G = shear_modulus(link)
    return lambda s: G * s.torsion, lambda s: rho * s.I_p


def second_moment(family: Family) -> Property:
    """Return the second moment of area for bending of that family, m⁴."""
    return (lambda s: s.I_yy) if family == "in-plane-bending" else (lambda s: s.I_zz)


def cellwise(link: BeamLink, nodes: Array, quantity: Property) -> Array:
    """Return a section property (e,), in its own unit, of each element between `nodes` (e + 1,), m."""
    segment = np.searchsorted(link.geometry.breakpoints[1:-1], 0.5 * (nodes[1:] + nodes[:-1]))
    return np.array([quantity(section) for section in link.sections])[segment]


ROUND_CORNERS = 16  # of the polygon that stands for a circle; divisible by 4


def section_outlines(sections: Sequence[SectionRecord]) -> Array:
    """Return corners (s, q, 2), (y, z) in m, of each section's outer outline, counter-clockwise about x.

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
