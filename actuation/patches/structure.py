"""Mass and stiffness of the patches as part of the link (the reference paper neglects both)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody
from ...mbs.model.masses import with_masses
from ...mbs.model.planar_body import PlanarBody, PlanarPoint
from .composite import Placed, composite, gauss_points
from .layers import layer_section
from .patches import patch_edges
from .records import PztLayout
from .sections import link_sections


@dataclass(frozen=True)
class StructureEffect:
    """What patches change of a link, bare → with patches.

    Attributes:
        mass: (2,) kg.
        inertia: (2,) about the frame's origin, kg·m².
        frequency: (2, n) Hz.
    """

    mass: Array
    inertia: Array
    frequency: Array


def with_patches(planar: PlanarBody, body: ModalBody, layout: PztLayout, edges: Array | None = None) -> PlanarBody:
    """The link with mass and stiffness of its patches, as far as the layout says so; it keeps its number of modes.

    Mass lies on the axis, like that of a beam. The stiffness is that of the `composite` section. `edges` (k, 2), m, say
    where patches are if not where the layout has them: on a piece of a link.
    """
    edges = patch_edges(layout, body.length) if edges is None else edges
    T = planar.modal_transform
    points: list[PlanarPoint] = []
    masses: list[float] = []
    sections = link_sections(body)
    for place in gauss_points(body, edges) if layout.adds_mass else ():
        at = body.interpolate(place.x)
        points.append(PlanarPoint(at.position[:2], at.translation[:2] @ T, at.rotation[2] @ T))
        masses.append(place.weight * layer_section(layout, sections.height[place.station]).A * (layout.density or 0.0))
    stiffness = T.T @ composite([Placed(layout, edges)], body).stiffness @ T if layout.adds_stiffness else None
    if not points:
        points, masses = [PlanarPoint(np.zeros(2), np.zeros((2, planar.n_modes)), np.zeros(planar.n_modes))], [0.0]
    return with_masses(planar, points, np.array(masses), np.zeros(len(masses)), stiffness)


def structure_effect(bare: PlanarBody, patched: PlanarBody) -> StructureEffect:
    """What the patches change."""
    pair = (bare, patched)
    return StructureEffect(
        np.array([body.mass for body in pair]),
        np.array([body.inertia for body in pair]),
        np.array([np.sqrt(body.stiffness) / (2 * np.pi) for body in pair]),
    )
