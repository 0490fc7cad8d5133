"""Stresses of a beam at given points: of its modes, and static ones of unit loads. NumPy only.

The part of the beam beyond a section is in equilibrium under its inertia, the lumps and the support on it, and what the
section carries. In mode k the inertia is ω_k² ρA u per unit of length, so the section forces follow by integration of
the mode itself and are as accurate as displacements; derivatives of the finite element functions lose two orders. In
attachment modes it is that of eigenmodes, beside the loads at interfaces that they are the residual of. A unit load's
section forces are those of statics: the link, held isostatically, has no others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import roots_legendre

from ...common.arrays import Array, Booleans, Integers
from ..link_records import BeamLink
from ..modal_body import Interface, Stations, StressPoint, craig_bampton
from ..modal_body.attachment_modes import interface_loads
from ..modal_body.interpolation import through
from ..modal_body.lumped_masses import Lump
from ..modal_body.unit_loads import inertia_wrenches, unit_load_names
from .line import on_axis
from .section_stress import section_stress


@dataclass(frozen=True)
class SectionLoads:
    """Loads on the beam: n cases, such as the inertia of each mode, at Gauss points, lumps, interfaces and supports.

    Attributes:
        x: (q,) where they act, m from the root.
        force: (q, 3, n) in N per unit of the case, a modal coordinate or a unit load.
        moment: (q, 3, n) in N·m.
    """

    x: Array
    force: Array
    moment: Array

    def beside(self, others: Sequence[tuple[float, Array]]) -> SectionLoads:
        """These and others: x, and force and moment there (6, n)."""
        if not others:
            return self
        load = np.array([both for _, both in others])
        return SectionLoads(
            np.concatenate([self.x, [x for x, _ in others]]),
            np.concatenate([self.force, load[:, :3]]),
            np.concatenate([self.moment, load[:, 3:]]),
        )

    def beyond(self, x: float, side: Booleans) -> tuple[Array, Array]:
        """Force and moment about the axis at x, (3, n) each, of the loads where `side` (q,) is true."""
        force, arm = self.force[side], (self.x[side] - x)[:, None]
        moment = self.moment[side].sum(axis=0)
        moment[1] -= (arm * force[:, 2]).sum(axis=0)
        moment[2] += (arm * force[:, 1]).sum(axis=0)
        return force.sum(axis=0), moment


@dataclass(frozen=True)
class Material:
    """The mass of a beam and of what is attached to it, at q places, with what its modes do there.

    Attributes:
        x: (q,) m from the root.
        mass: (q,) kg.
        inertia: (q, 3) about the axes of the section, kg·m².
        translation: (q, 3, n), as in `Interface`.
        rotation: (q, 3, n).
    """

    x: Array
    mass: Array
    inertia: Array
    translation: Array
    rotation: Array

    def with_lumps(self, attached: Sequence[Lump]) -> Material:
        """With lumps."""
        return Material(
            np.concatenate([self.x, [lump.at.position[0] for lump in attached]]),
            np.concatenate([self.mass, [lump.mass for lump in attached]]),
            np.concatenate([self.inertia, *(lump.inertia[None] for lump in attached)]),
            np.concatenate([self.translation, *(lump.at.translation[None] for lump in attached)]),
            np.concatenate([self.rotation, *(lump.at.rotation[None] for lump in attached)]),
        )

    def times_modes(self, W: Array) -> SectionLoads:
        """Mass times motion times W (n, n)."""
        force = self.mass[:, None, None] * self.translation
        return SectionLoads(self.x, force @ W, (self.inertia[:, :, None] * self.rotation) @ W)

    def under_unit_motions(self) -> SectionLoads:
        """D'Alembert forces of unit motions of the frame, in the order of `unit_load_names`."""
        wrench = np.stack([*inertia_wrenches(on_axis(self.x), self.mass, self.inertia).values()], axis=2)
        return SectionLoads(self.x, wrench[:, :3], wrench[:, 3:])


def beam_stresses(
    link: BeamLink,
    stations: Stations,
    omega2: Array,
    families: Sequence[str],
    attached: Sequence[Lump],
    residual: Integers,
    interfaces: Mapping[str, Interface],
) -> dict[str, StressPoint]:
    """Stresses and strains of modes, and static stresses of unit loads, at the points that the link file names.

    Bending, axial force, torque and transverse shear: see `section_stress`. Strains by Hooke's law. At a step of the
    section, the section beyond it counts; at a lump, what the beam carries just beyond it.

    Args:
        link: for sections, material, points.
        stations: with their elements.
        omega2: (n,) ω² in rad²/s².
        families: of the modes.
        attached: lumps, with what the modes do there.
        residual: (n,) 1 of residual attachment modes.
        interfaces: likewise, where loads act in these.
    """
    W, at_interfaces = _loads_of_modes(link, omega2, families, residual, interfaces)
    n = len(W)
    of_modes = [(interfaces[name].position[0], load) for name, load in at_interfaces.items()]
    E, nu = link.material.youngs_modulus, link.material.poissons_ratio
    points = {}
    for name, position in link.stress.points.items():
        assert nu is not None  # the link file has been checked for it
        x, y, z = position
        material = _material(link, stations, x)
        inertia = material.with_lumps(attached).times_modes(W).beside(of_modes)
        static = _unit_loads(material, attached, interfaces)
        F, M = np.concatenate([_section_forces(link, inertia, x), _section_forces(link, static, x)], axis=2)
        segment = int(segments(link, np.array(x)))
        stress = section_stress(link.shapes[segment], link.sections[segment], F, M, y, z)
        modal, static_stress = stress[:, :n], stress[:, n:]
        strain = modal * (2 * (1 + nu) / E)
        strain[:3] = np.outer([1.0, -nu, -nu], modal[0] / E)
        points[name] = StressPoint(np.array(position), modal, strain, static_stress)
    return points


def _loads_of_modes(
    link: BeamLink, omega2: Array, families: Sequence[str], residual: Integers, interfaces: Mapping[str, Interface]
) -> tuple[Array, dict[str, Array]]:
    """The inertia and the loads at interfaces that bend the link into its modes: see `interface_loads`."""
    if link.reference.condition == "craig-bampton":
        return craig_bampton.interface_loads(omega2, families, int(residual.sum()), interfaces)
    return interface_loads(omega2, residual, interfaces)


def stress_loads(link: BeamLink, interfaces: Mapping[str, Interface]) -> tuple[str, ...]:
    """Names of the unit loads of static stresses; none where no point is asked for."""
    return tuple(unit_load_names(interfaces)) if link.stress.points else ()


def _unit_loads(material: Material, attached: Sequence[Lump], interfaces: Mapping[str, Interface]) -> SectionLoads:
    """All unit loads, (q, 3, l), in the order of `unit_load_names`."""
    moving = material.with_lumps(attached).under_unit_motions()
    places, motions = len(interfaces), moving.force.shape[2]
    loads = np.pad(np.eye(6 * places).reshape(places, 6, -1), ((0, 0), (0, 0), (motions, 0)))
    force, moment = (np.pad(of, ((0, 0), (0, 0), (0, 6 * places))) for of in (moving.force, moving.moment))
    widened = SectionLoads(moving.x, force, moment)
    return widened.beside([(at.position[0], load) for at, load in zip(interfaces.values(), loads, strict=True)])


def _section_forces(link: BeamLink, loads: SectionLoads, x: float) -> Array:
    """Force in N and moment in N·m (2, 3, n) that the part beyond x exerts on the section there, of each load."""
    length = link.geometry.length
    loads = _with_support(link, loads)
    # A load at the tip counts even for the section there: its stress is the one just before the end.
    return np.stack(loads.beyond(x, (loads.x > x) | (loads.x == length)))


def _material(link: BeamLink, stations: Stations, x: float) -> Material:
    """The beam at Gauss points of its elements, one ending at x."""
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
    moved = through(stations, np.repeat(stations.element[element], gauss.size, axis=0), s.ravel())
    mass, inertia = _line_inertia(link, segments(link, 0.5 * (start + end)))
    scale = half * weights
    spread = (scale * mass[:, None]).ravel(), (scale[:, :, None] * inertia[:, None]).reshape(-1, 3)
    return Material(s.ravel(), *spread, moved.translation, moved.rotation)


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


def _with_support(link: BeamLink, loads: SectionLoads) -> SectionLoads:
    """The loads, with the transverse forces that hold the tip of a simply supported link: its root takes no moment."""
    if link.reference.holds_root:
        return loads
    length = link.geometry.length
    moment = loads.beyond(0.0, np.full(loads.x.size, True))[1]
    reaction = np.stack([np.zeros_like(moment[0]), -moment[2] / length, moment[1] / length])
    return SectionLoads(
        np.append(loads.x, length),
        np.concatenate([loads.force, reaction[None]]),
        np.concatenate([loads.moment, np.zeros_like(reaction)[None]]),
    )
