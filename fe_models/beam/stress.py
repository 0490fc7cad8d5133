"""Stresses of a beam at given points: of its modes, and static ones of unit loads. NumPy only.

The part of the beam beyond a section is in equilibrium under its inertia, the lumps and the support on it, and what the
section carries. In mode k the inertia is ω_k² ρA u per unit of length, so the section forces follow by integration of
the mode itself and are as accurate as displacements; derivatives of the finite element functions lose two orders. In
attachment modes it is that of eigenmodes, beside the loads at interfaces that they are the residual of. A unit load's
section forces are those of statics: the link, supported isostatically, has no others.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.polynomial.legendre import leggauss

from ...common.arrays import Array
from ..link_records.link import BeamLink
from ..modal_body import Interface, Stations, StressPoint, craig_bampton
from ..modal_body.attachment_modes import interface_loads
from ..modal_body.lumped_masses import Lump, loads_with_lumps, lump_weights
from ..modal_body.parts import through
from ..modal_body.unit_loads import loads_at, unit_load_names
from .invariants import ROTARY, Rotary, of_load, of_tip_support, section_forces
from .section_stress import section_stress
from .sections import section_property, segments


def beam_stresses(
    link: BeamLink,
    stations: Stations,
    omega2: Array,
    families: Sequence[str],
    eigenmodes: int,
    *,
    attached: Sequence[Lump],
    interfaces: Mapping[str, Interface],
) -> dict[str, StressPoint]:
    """Stresses and strains of modes, and static stresses of unit loads, at the points that the link file names.

    Bending, axial force, torque and transverse shear: see `section_stress`. Strains by Hooke's law. At a step of the
    section, the section beyond it counts; at a lump, what the beam carries just beyond it. `omega2` (n,) is ω² in
    rad²/s² of so many `eigenmodes`, then of attachment modes; `attached` lumps and `interfaces` have the mode shapes.
    """
    if link.reference.condition == "craig-bampton":
        W, by_name = craig_bampton.interface_loads(omega2, families, omega2.size - eigenmodes, interfaces)
    else:
        W, by_name = interface_loads(omega2, eigenmodes, interfaces)
    loads = list(by_name.items())
    for lump in attached:
        loads.append((lump.name, lump_weights(lump.mass, lump.inertia)[:, None] * lump.at.motion @ W))
    E, nu, names = link.material.youngs_modulus, link.material.poissons_ratio, unit_load_names(interfaces)
    with_lumps = loads_with_lumps(names, attached)
    points, places = {}, {name: float(at.position[0]) for name, at in interfaces.items()}
    for name, position in link.stress.points.items():
        assert nu is not None  # the link file has been checked for it
        x, y, z = position
        of_loads = section_forces(link, np.array([x]), places, _rotary(link))[..., 0]
        of_modes = _of_inertia(link, stations, W, x)
        for place, load in loads:
            of_modes = of_modes + of_loads[:, loads_at(names, place)] @ load
        forces = np.hstack([of_modes, of_loads @ with_lumps])
        segment = int(segments(link, np.array(x)))
        stress = section_stress(link.shapes[segment], link.sections[segment], forces[:3], forces[3:], y, z)
        modal, static_stress = stress[:, : len(W)], stress[:, len(W) :]
        strain = modal * (2 * (1 + nu) / E)
        strain[:3] = np.outer([1.0, -nu, -nu], modal[0] / E)
        points[name] = StressPoint(np.array(position), modal, strain, static_stress)
    return points


def _rotary(link: BeamLink) -> Rotary:
    """Inertia of sections that turn; Euler–Bernoulli beams have that of twisting alone."""
    return ROTARY if link.model.theory == "timoshenko" else {"I_p": (1.0, 0.0, 0.0)}


def _of_inertia(link: BeamLink, stations: Stations, W: Array, x: float) -> Array:
    """(6, n) section forces at x of mass times motion times W (n, n), at Gauss points of elements, one ending at x."""
    assert stations.element is not None
    nodes = stations.position[stations.element, 0]
    starts, ends = nodes[:, 0], nodes[:, 3]
    cut = np.flatnonzero((starts < x) & (x < ends))
    element = np.concatenate([np.arange(len(nodes)), cut])
    start, end = np.append(starts, np.full(len(cut), x)), np.append(ends, ends[cut])
    end[cut] = x
    # Exact: arm × cubic.
    gauss, weights = leggauss(3)
    half = 0.5 * (end - start)[:, None]
    s = (0.5 * (start + end)[:, None] + half * gauss).ravel()
    moved = through(stations, np.repeat(stations.element[element], gauss.size, axis=0), s)
    middle, rotary = np.repeat(0.5 * (start + end), gauss.size), _rotary(link)
    turning = sum(np.outer(inertia, section_property(link, middle, name)) for name, inertia in rotary.items())
    inertia = np.concatenate([np.tile(section_property(link, middle, "area"), (3, 1)), turning])
    motion = np.concatenate([moved.translation, moved.rotation], axis=1).transpose(1, 0, 2)
    load = (link.material.density * (half * weights).ravel() * inertia)[:, :, None] * motion @ W  # (6, q, n)
    forces = of_load(load[:, s > x], (s[s > x] - x)[:, None]).sum(axis=1)
    if link.reference.holds_root:
        return forces
    return forces + of_tip_support(link, np.array([x]), of_load(load, s[:, None]).sum(axis=1))
