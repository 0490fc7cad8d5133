"""Stresses of links in space over a motion, where their files hold those of modes."""

from __future__ import annotations

from collections.abc import Mapping

from ..actuation.patches.spatial_patches import LinkPatches
from ..mbs.quantities.spatial_link_loads import link_loads_in_space
from ..mbs.quantities.spatial_motion import SpatialMotion
from ..mbs.quantities.stress import BodyStress, body_stress, has_stresses, mode_acceleration, mode_displacement
from .spatial_bodies import LoadedSpatialBody


def stresses_in_space(
    motion: SpatialMotion, bodies: Mapping[str, LoadedSpatialBody], patches: Mapping[str, LinkPatches]
) -> dict[str, BodyStress]:
    """By body; by mode acceleration where files and loads allow it.

    Of links that patches stiffen by mode displacement: static stresses of their files are those of the bare link.
    """
    links = {name: body.modal for name, body in bodies.items() if body.modal is not None and has_stresses(body.modal)}
    stiffened = {
        name for name, of in patches.items() if any(array.layout.adds_stiffness for array in of.arrays.values())
    }
    known = [name for name, link in links.items() if link.stress_loads and name not in stiffened]
    loads = link_loads_in_space(motion, known) if known else {}
    found = {}
    for name, link in links.items():
        p = motion.body(name).modal
        recovery = mode_displacement(p)
        if name in loads:
            recovery = mode_acceleration(link, bodies[name].spatial.modal_transform, p, loads[name].sizes)
        found[name] = body_stress(link, recovery)
    return found
