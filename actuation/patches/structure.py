"""Mass and stiffness of the patches as part of the link (the reference paper neglects both)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody
from ...mbs.model.body import Body, BodyPoint
from ...mbs.model.masses import with_line_masses
from .composite import Placed, composite, gauss_points
from .layers import layer_section
from .sections import link_sections


@dataclass(frozen=True)
class StructureEffect:
    """What patches change of a link, bare → with patches.

    Attributes:
        mass: (2,) kg.
        inertia: (2,) about the body's z axis, kg·m².
        frequency: (2, n) Hz.
    """

    mass: Array
    inertia: Array
    frequency: Array


def patched_body(spatial: Body, body: ModalBody, placed: Sequence[Placed]) -> Body:
    """The link, or a piece of it, with mass and stiffness of patches, as far as layouts say so; it keeps all modes.

    Mass lies on the axis, like that of a beam, with its moment of inertia about the axis, ∫ρ (η² + ζ²) dA. The
    stiffness is that of the `composite` section.
    """
    T, sections = spatial.modal_transform, link_sections(body)
    points, masses, spins = [], [], []
    for layout, edges in placed:
        extent = sections.extent(layout.normal)
        for place in gauss_points(body, edges) if layout.adds_mass else ():
            at = body.interpolate(place.x)
            points.append(BodyPoint(at.position, at.translation @ T, at.rotation @ T))
            A, _, I = layer_section(layout, extent[place.station])  # noqa: E741
            line_density = place.weight * (layout.density or 0.0)
            masses.append(line_density * A)
            spins.append(line_density * (I + A * layout.width**2 / 12))
    stiff = [one for one in placed if one.layout.adds_stiffness]
    added = T.T @ composite(stiff, body).stiffness @ T if stiff else np.zeros((spatial.n_modes, spatial.n_modes))
    return with_line_masses(spatial, points, np.array(masses), np.array(spins), added)


def structure_effect_of(bare: Body, patched: Body) -> StructureEffect:
    """What the patches change."""
    pair = (bare, patched)
    return StructureEffect(
        np.array([body.mass for body in pair]),
        np.array([body.inertia[2, 2] for body in pair]),
        np.array([np.sqrt(body.stiffness) / (2 * np.pi) for body in pair]),
    )
