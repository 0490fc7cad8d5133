"""The bare sections of a link under patches: extents, rigidities, and how twist shears their surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...fe_models.beam.section_stress import surface_shear
from ...fe_models.modal_body import ModalBody

BEND_Y, STRETCH, TWIST, BEND_Z = range(4)
"""Strains of a section, e = (φ_z', u', φ_x', −φ_y'): curvature towards y, stretch, twist, curvature towards z."""

ROUND = 1e-6  # of the radius: corners of an outline that are so far from the axis are on a circle


@dataclass(frozen=True)
class LinkSections:
    """From each of k stations on; NaN where not known.

    Attributes:
        x: (k,) m.
        height, width: (k,) along y and z, m.
        is_round: (k,) whether a circle bounds the section.
        rigidity: (k, 4) of the strains e: EI in plane, EA, GJ, EI out of plane, N·m² and N.
    """

    x: Array
    height: Array
    width: Array
    is_round: Array
    rigidity: Array

    def extent(self, normal: Literal["y", "z"]) -> Array:
        """(k,) between the faces with that normal, m."""
        return self.height if normal == "y" else self.width

    @property
    def alike(self) -> Indices:
        """(k,) of each station the first one with the same section."""
        of_station = np.column_stack([self.height, self.width, self.is_round, self.rigidity])
        _, first, same = np.unique(of_station, axis=0, return_index=True, return_inverse=True)
        found: Indices = first[same.ravel()]
        return found

    def shear_lever(self, station: int, normal: Literal["y", "z"], patch_width: float) -> float:
        """β: mean shear of the surface under a patch, of unit twist, over its distance from the axis.

        1 of round sections (γ = r φ'), 2 of thin strips (γ = 2 d φ', plates), St Venant's of other rectangles.
        """
        if self.is_round[station]:
            return 1.0
        high, wide = self.height[station], self.width[station]
        return _lever_of_rectangle(*((high, wide) if normal == "y" else (wide, high)), patch_width)


def link_sections(body: ModalBody) -> LinkSections:
    """Of a modal body."""
    stations = body.stations
    k = len(stations.height)
    unknown = np.full(k, np.nan)
    in_plane = np.full((k, 2), np.nan) if stations.rigidity is None else stations.rigidity
    width, is_round = unknown, np.zeros(k, dtype=bool)
    if stations.outline is not None:
        distance = np.linalg.norm(stations.outline, axis=2)
        is_round = np.ptp(distance, axis=1) <= ROUND * distance.max(axis=1)
        is_round &= np.isclose(2 * distance.max(axis=1), stations.height, rtol=ROUND)
        width = np.ptp(stations.outline[..., 1], axis=1)
    rest = (stations.torsional_rigidity, stations.out_of_plane_rigidity)
    GJ, EI_z = (unknown if values is None else values for values in rest)
    return LinkSections(
        stations.position[:, 0],
        stations.height,
        width if stations.width is None else stations.width,
        is_round,
        np.stack([in_plane[:, 1], in_plane[:, 0], GJ, EI_z], axis=1),
    )


def check_sections(key: str, body: ModalBody, normal: Literal["y", "z"], *, twists: bool) -> None:
    """Raise `InputError` where the modal body does not say what patches on faces with that normal need to know."""
    if np.isnan(link_sections(body).extent(normal)).any():
        raise InputError(
            f"{key}: expected a modal body file with the width of the link (stations/width), found one of an earlier"
            " version: recompute it from its link file with `ffrobot link`"
        )
    if twists and body.stations.outline is None:
        raise InputError(
            f'{key}: bends: expected a beam link for "twist", found a {body.kind}: how twist shears its surface is not'
            " known"
        )


def potentials(body: ModalBody, x: Array) -> Array:
    """(m, 4, n) at x (m,) whose differences are integrals of the strains e along the link: φ_z, u, φ_x, −φ_y."""
    _, translation, rotation = body.along_axis(x)
    return np.stack([rotation[:, 2], translation[:, 0], rotation[:, 0], -rotation[:, 1]], axis=1)


@lru_cache
def _lever_of_rectangle(extent: float, across: float, patch_width: float) -> float:
    return surface_shear(extent, across, min(patch_width, across)) / (extent / 2)
