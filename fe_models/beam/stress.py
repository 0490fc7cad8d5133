"""Modal stresses of a beam at given points. NumPy only.

The part of the beam beyond a section is in equilibrium under its inertia, the lumps and the support on it, and what the
section carries. In mode k the inertia is ω_k² ρA u per unit of length, so the section forces follow by integration of
the mode itself and are as accurate as displacements; derivatives of the finite element functions lose two orders.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import roots_legendre

from ...common.arrays import Array, Booleans, Integers
from ..link_records import BeamLink
from ..modal_body import Stations, StressPoint
from ..modal_body.lumped_masses import Lump
from .section_stress import section_stress


@dataclass(frozen=True)
class ModalLoads:
    """Inertia of each mode as loads on the beam, divided over Gauss points, lumps and the support at the tip.

    Attributes:
        x: (q,) where they act, m from the root.
        force: (q, 3, n) in N per unit of modal coordinate.
        moment: (q, 3, n) in N·m.
    """

    x: Array
    force: Array
    moment: Array

    def beyond(self, x: float, side: Booleans) -> tuple[Array, Array]:
        """Force and moment about the axis at x, (3, n) each, of the loads where `side` (q,) is true."""
        force, arm = self.force[side], (self.x[side] - x)[:, None]
        moment = self.moment[side].sum(axis=0)
        moment[1] -= (arm * force[:, 2]).sum(axis=0)
        moment[2] += (arm * force[:, 1]).sum(axis=0)
        return force.sum(axis=0), moment


def beam_stresses(
    link: BeamLink, stations: Stations, omega2: Array, attached: Sequence[Lump]
) -> dict[str, StressPoint]:
    """Modal stresses and strains at the points that the link file names, which lie in the beam.

    Bending, axial force, torque and transverse shear: see `section_stress`. Strains by Hooke's law. At a step of the
    section, the section beyond it counts; at a lump, what the beam carries just beyond it.

    Args:
        link: for sections, material, points.
        stations: with their elements.
        omega2: (n,) ω² in rad²/s².
        attached: lumps, with what the modes do there.
    """
    E, nu = link.material.youngs_modulus, link.material.poissons_ratio
    points = {}
    for name, position in link.stress.points.items():
        assert nu is not None  # the link file has been checked for it
        x, y, z = position
        F, M = _section_forces(link, stations, omega2, attached, x)
        segment = int(segments(link, np.array(x)))
        stress = section_stress(link.shapes[segment], link.sections[segment], F, M, y, z)
        strain = stress * (2 * (1 + nu) / E)
        strain[:3] = np.outer([1.0, -nu, -nu], stress[0] / E)
        points[name] = StressPoint(np.array(position), stress, strain)
    return points


def _section_forces(
    link: BeamLink, stations: Stations, omega2: Array, attached: Sequence[Lump], x: float
) -> tuple[Array, Array]:
    """Force (3, n) in N and moment (3, n) in N·m that the part beyond x exerts on the section there, in each mode."""
    length = link.geometry.length
    loads = _with_support(link, _inertia(link, stations, omega2, attached, x))
    # A load at the tip counts even for the section there: its stress is the one just before the end.
    return loads.beyond(x, (loads.x > x) | (loads.x == length))


def _inertia(link: BeamLink, stations: Stations, omega2: Array, attached: Sequence[Lump], x: float) -> ModalLoads:
    """ω² times mass times motion: of the beam at Gauss points of its elements, of which one ends at x; of the lumps."""
    assert stations.element is not None
    nodes = stations.position[stations.element, 0]
    starts, ends = nodes[:, 0], nodes[:, 3]
    cut = np.flatnonzero((starts < x) & (x < ends))
    element = np.concatenate([np.arange(len(nodes)), cut])
    start, end = np.append(starts, np.full(len(cut), x)), np.append(ends, ends[cut])
    end[cut] = x
    gauss, weights = roots_legendre(3)  # exact: arm × cubic
    half = 0.5 * (end - start)[:, None]
    s = 0.5 * (start + end)[:, None] + half * gauss
    shapes = _lagrange(nodes[element], s)
    translation = np.einsum("egi,eikn->egkn", shapes, stations.translation[stations.element[element]])
    rotation = np.einsum("egi,eikn->egkn", shapes, stations.rotation[stations.element[element]])
    mass, inertia = _line_inertia(link, segments(link, 0.5 * (start + end)))
    scale = half * weights
    force = (scale * mass[:, None])[:, :, None, None] * translation
    moment = scale[:, :, None, None] * inertia[:, None, :, None] * rotation
    n = omega2.size
    at = [lump.at for lump in attached]
    return ModalLoads(
        np.concatenate([s.ravel(), [place.position[0] for place in at]]),
        omega2
        * np.concatenate([force.reshape(-1, 3, n), *(lump.mass * lump.at.translation[None] for lump in attached)]),
        omega2
        * np.concatenate(
            [moment.reshape(-1, 3, n), *((lump.inertia[:, None] * lump.at.rotation)[None] for lump in attached)]
        ),
    )


def _line_inertia(link: BeamLink, segments: Integers) -> tuple[Array, Array]:
    """(e,) ρA in kg/m and (e, 3) ρI about x, y, z in kg·m; Euler–Bernoulli beams have the one of twisting alone."""
    rho = link.material.density
    mass = rho * np.array([section.area for section in link.sections])
    inertia = rho * np.array([(section.I_p, section.I_zz, section.I_yy) for section in link.sections])
    if link.model.theory == "euler-bernoulli":
        inertia[:, 1:] = 0.0
    return mass[segments], inertia[segments]


def segments(link: BeamLink, x: Array) -> Integers:
    """Number of the segment at each x; at a step of the section, of the one beyond it."""
    return np.searchsorted(link.geometry.breakpoints[1:-1], x, side="right")


def _with_support(link: BeamLink, loads: ModalLoads) -> ModalLoads:
    """The loads, with the transverse forces that hold the tip of a simply supported link: its root takes no moment."""
    if link.reference.condition == "cantilever":
        return loads
    length = link.geometry.length
    moment = loads.beyond(0.0, np.full(loads.x.size, True))[1]
    reaction = np.stack([np.zeros_like(moment[0]), -moment[2] / length, moment[1] / length])
    return ModalLoads(
        np.append(loads.x, length),
        np.concatenate([loads.force, reaction[None]]),
        np.concatenate([loads.moment, np.zeros_like(reaction)[None]]),
    )


def _lagrange(nodes: Array, s: Array) -> Array:
    """(e, g, 4) values at s (e, g) of the cubics that are 1 at one of `nodes` (e, 4) and 0 at the others."""
    values = np.ones((*s.shape, 4))
    for i in range(4):
        for j in range(4):
            if i != j:
                values[:, :, i] *= (s - nodes[:, None, j]) / (nodes[:, None, i] - nodes[:, None, j])
    return values
