"""How far links in space bend, and what the loads of a run do to their stiffness: as `validity` in the plane."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody
from ..model.spatial_body import SpatialBody
from .spatial_link_loads import loads_in_equations
from .spatial_motion import SpatialMotion
from .stiffness_change import LoadedPoint, ModalLoads
from .validity import IN_SPACE, Bending, LinkInRun, bending_of_link


def bending_in_space(motion: SpatialMotion, links: Mapping[str, ModalBody]) -> dict[str, Bending]:
    """Of the flexible bodies of the equations by name; `links` are their modal bodies as their files have them."""
    loads = loads_in_equations(motion, links) if len(motion.time) else {}
    found = {}
    for name, link in links.items():
        body, sizes = motion.node(name).body, loads[name].sizes if name in loads else {}
        p = motion.q[:, motion.node(name).p_q] @ body.modal_transform.T
        run = LinkInRun(
            p, body.modal_transform, _on_modes(link, body, sizes), body.stiffening is not None, motion.is_at_rest
        )
        found[name] = bending_of_link(link, run, _largest_force(body, sizes, len(p)), IN_SPACE)
    return found


def _on_modes(link: ModalBody, body: SpatialBody, sizes: Mapping[str, Array]) -> ModalLoads:
    """Loads of `sizes` (T,) on a body, whether their geometric stiffness is in the equations or not.

    Loads by the names of `fe_models.modal_body.unit_loads`; those alone of which the file has a geometric stiffness.
    """
    T, n = body.modal_transform, len(body.stiffness)
    K = {load: T.T @ of_load @ T for load, of_load in link.geometric_stiffness.items()}
    known = [load for load in sizes if load in K]
    f = np.stack([sizes[load] for load in known], axis=1) if known else np.zeros((0, 0))
    along = {point: [f"force/{point}/{axis}" for axis in "xyz"] for point in link.interfaces}
    points = tuple(
        LoadedPoint(link.interfaces[point].translation @ T, np.stack([K[load] for load in of]))
        for point, of in along.items()
        if all(load in K for load in of)
    )
    return ModalLoads(f, np.array([K[load] for load in known]).reshape(-1, n, n), body.stiffness, points)


def _largest_force(body: SpatialBody, sizes: Mapping[str, Array], count: int) -> Array:
    """(T,) N, of the forces at the interfaces of a body."""
    largest = np.zeros(count)
    for point in body.points:
        parts = [sizes[load] for axis in "xyz" if (load := f"force/{point}/{axis}") in sizes]
        if parts:
            largest = np.maximum(largest, np.linalg.norm(parts, axis=0))
    return largest
