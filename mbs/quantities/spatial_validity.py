"""How far links in space bend, and what the loads of a run do to their stiffness: as `validity` in the plane."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody
from ..model.spatial_body import SpatialBody
from .spatial_link_loads import loads_in_equations
from .spatial_motion import SpatialMotion
from .stiffness_change import StiffnessChange, stiffness_change
from .validity import IN_SPACE, Bending, bending_of_link


def bending_in_space(motion: SpatialMotion, links: Mapping[str, ModalBody]) -> dict[str, Bending]:
    """Of the flexible bodies of the equations by name; `links` are their modal bodies as their files have them."""
    loads = loads_in_equations(motion, links) if len(motion.time) else {}
    found = {}
    for name, link in links.items():
        node, sizes = motion.node(name), loads[name].sizes if name in loads else {}
        p = motion.q[:, node.p_q] @ node.body.modal_transform.T
        change = change_by_loads(link, node.body, sizes)
        force = _largest_force(node.body, sizes, len(p))
        found[name] = bending_of_link(link, p, force, change, node.body.stiffening is not None, IN_SPACE)
    return found


def change_by_loads(link: ModalBody, body: SpatialBody, sizes: Mapping[str, Array]) -> StiffnessChange:
    """By loads of `sizes` (T,) on a body, whether it is in the equations or not.

    Loads by the names of `fe_models.modal_body.unit_loads`; none by those of which the file has no geometric stiffness.
    """
    T, known = body.modal_transform, [load for load in sizes if load in link.geometric_stiffness]
    matrices = [T.T @ link.geometric_stiffness[load] @ T for load in known]
    return stiffness_change([sizes[load] for load in known], matrices, body.stiffness)


def _largest_force(body: SpatialBody, sizes: Mapping[str, Array], count: int) -> Array:
    """(T,) N, of the forces at the interfaces of a body."""
    largest = np.zeros(count)
    for point in body.points:
        parts = [sizes[load] for axis in "xyz" if (load := f"force/{point}/{axis}") in sizes]
        if parts:
            largest = np.maximum(largest, np.linalg.norm(parts, axis=0))
    return largest
