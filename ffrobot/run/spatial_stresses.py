"""Stresses of links in space over a motion, where their files hold those of modes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..actuation.patches.spatial_patches import LinkPatches
from ..common.arrays import Array
from ..fe_models.modal_body import ModalBody
from ..mbs.quantities.link_loads import link_loads_in_space
from ..mbs.quantities.spatial_motion import SpatialMotion
from ..mbs.quantities.stress import BodyStress, body_stress, has_stresses, mode_acceleration, mode_displacement
from .spatial_bodies import LoadedSpatialBody


def stresses_in_space(
    motion: SpatialMotion, bodies: Mapping[str, LoadedSpatialBody], patches: Mapping[str, LinkPatches]
) -> dict[str, BodyStress]:
    """By body; by mode acceleration where files and loads allow it.

    By mode displacement of links that patches stiffen, as static stresses of their files are those of the bare link,
    and of those on which forces act elsewhere than at interfaces.
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
        if name in loads and _is_known(link, loads[name].sizes):
            recovery = mode_acceleration(link, bodies[name].spatial.modal_transform, p, loads[name].sizes)
        found[name] = body_stress(link, recovery)
    return found


def _is_known(link: ModalBody, sizes: Mapping[str, Array]) -> bool:
    """Whether the file of a link has the static stress of everything that acts on it."""
    return all(name in link.stress_loads or not np.any(size) for name, size in sizes.items())
