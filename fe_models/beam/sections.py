"""Properties of the sections of a beam, by element, and those that each family of motion takes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.arrays import Array
from ..link_records import BeamLink, Family
from ..link_records.section import Section

Property = Callable[[Section], float]


def link_modulus(link: BeamLink) -> float:
    """E in Pa."""
    return link.material.youngs_modulus


def shear_modulus(link: BeamLink) -> float:
    """G = E / (2 (1 + ν)) in Pa; the link file has been checked for ν where G is needed."""
    assert link.material.poissons_ratio is not None
    return link.material.youngs_modulus / (2 * (1 + link.material.poissons_ratio))


def rod_properties(link: BeamLink, family: Family) -> tuple[Property, Property]:
    """Stiffness, EA in N or GJ in N·m², and mass or moment of inertia per length, of axial or torsional motion."""
    E, rho = link_modulus(link), link.material.density
    if family == "axial":
        return lambda s: E * s.area, lambda s: rho * s.area
    G = shear_modulus(link)
    return lambda s: G * s.torsion, lambda s: rho * s.I_p


def second_moment(family: Family) -> Property:
    """Of area in m⁴, for bending."""
    return (lambda s: s.I_yy) if family == "in-plane-bending" else (lambda s: s.I_zz)


def cellwise(link: BeamLink, nodes: Array, quantity: Property) -> Array:
    """(e,) of the section of each element between `nodes` (e + 1,)."""
    segment = np.searchsorted(link.geometry.breakpoints[1:-1], 0.5 * (nodes[1:] + nodes[:-1]))
    return np.array([quantity(section) for section in link.sections])[segment]
