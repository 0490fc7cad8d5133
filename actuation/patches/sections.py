"""The bare sections of a link under patches, and the loads of layers on them (docs/theory.md, eqs. 35, 36). SI units.

Layers at the distance η from the axis and ζ across the width strain as the section does: ε = u' − η κ − ζ κ_t,
γ = β |η| φ_x' with β of `LinkSections.shear_lever`. Voltages on both faces are opposite to bend, and alike to twist.
"""

from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...common.structs import struct
from ...fe_models.beam.section_stress import surface_shear
from ...fe_models.modal_body import ModalBody
from .records import PztLayout

BEND_Y, STRETCH, TWIST, BEND_Z = range(4)
"""Strains of a section, e = (φ_z', u', φ_x', −φ_y'): curvature towards y, stretch, twist, curvature towards z."""

ROUND = 1e-6  # of the radius: corners of an outline that are so far from the axis are on a circle


@struct
class LinkSections:
    """Section properties of a link from each of its k stations on; NaN if unknown."""

    x: Array  # (k,) m
    # (k,) along y and z, m
    height: Array
    width: Array
    is_round: Array  # (k,) whether a circle bounds the section
    rigidity: Array  # (k, 4) of the strains e: EI in plane, EA, GJ, EI out of plane, N·m² and N
    middle: Array  # (k, 2) between the faces along y and z, from the axis, m

    def extent(self, normal: Literal["y", "z"], side: float = 0.0) -> Array:
        """Extents (k,) along a normal, m; for `side` ±1, twice the distance of that face from the axis."""
        between, axis = (self.height, 0) if normal == "y" else (self.width, 1)
        return between + 2 * side * self.middle[:, axis]

    @cached_property
    def alike(self) -> Indices:
        """Indices (k,) of the first station with the same section as each."""
        of_station = np.column_stack([self.height, self.width, self.is_round, self.rigidity, self.middle])
        _, first, same = np.unique(of_station, axis=0, return_index=True, return_inverse=True)
        return first[same.ravel()]

    def shear_lever(self, station: int, normal: Literal["y", "z"], patch_width: float) -> float:
        """β: mean shear of the surface under a patch by unit twist, over its distance from the axis.

        It is 1 of round sections (γ = r φ'), 2 of thin strips (γ = 2 d φ', plates), St Venant's of other rectangles.
        `patch_width` is in m.
        """
        if self.is_round[station]:
            return 1.0
        high, wide = self.height[station], self.width[station]
        extent, across = (high, wide) if normal == "y" else (wide, high)
        return _surface_shear(extent, across, min(patch_width, across)) / (extent / 2)


_surface_shear = lru_cache(surface_shear)  # a series, asked for at each station


@lru_cache(maxsize=4)
def link_sections(body: ModalBody) -> LinkSections:
    """The section properties of a modal body."""
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
        np.zeros((k, 2)) if stations.middle is None else stations.middle,
    )


def check_sections(body: ModalBody, normal: Literal["y", "z"], *, twists: bool) -> None:
    """Raise `InputError` where the modal body lacks the size of sections or, if patches twist it, their outline."""
    extent = link_sections(body).extent(normal)
    if not (extent.any() and (extent >= 0.0).all()):
        raise InputError(
            "expected a modal body file with height and width of stations",
            "an imported or old one: compute it from a link file by `ffrobot link`",
        )
    if twists and body.stations.outline is None:
        raise InputError(
            'bends: expected a beam link for "twist"',
            f"a {body.kind}: how twist shears its surface is not known",
        )


def check_width(body: ModalBody, layout: PztLayout, edges: Array) -> None:
    """Raise `InputError` for patches between x `edges` (k, 2), m, that are wider than the face that they lie on."""
    sections = link_sections(body)
    x, across = sections.x, sections.extent("z" if layout.normal == "y" else "y")
    ends = np.append(x[1:], np.inf)
    under = ((x < edges[:, 1:]) & (ends > edges[:, :1])).any(axis=0)
    face = np.where(sections.is_round, np.pi, 1.0) * across
    taken = layout.width + 2 * abs(layout.offset - sections.middle[:, 1 if layout.normal == "y" else 0])
    if (beyond := under & (taken > face * (1.0 + ROUND))).any():
        k = int(beyond.argmax())
        where = f", {layout.offset:g} m off its axis," if layout.offset else ""
        raise InputError(
            f"width: expected patches on the face of the link, {face[k]:.3g} m wide at {x[k]:.3g} m",
            f"patches {layout.width:g} m wide{where} which stand out: units are SI; is this in mm?",
        )


def potentials(body: ModalBody, x: Array) -> Array:
    """Rotations and displacement φ_z, u, φ_x, −φ_y (m, 4, n) of n modes at x (m,), m: rad and m per m·√kg.

    Their derivatives by x are the strains.
    """
    _, translation, rotation = body.along_axis(x)
    return np.stack([rotation[:, 2], translation[:, 0], rotation[:, 0], -rotation[:, 1]], axis=1)


def side(layout: PztLayout) -> float:
    """1.0 of patches on the face at largest y (or z), -1.0 at smallest, 0.0 on both faces or no named one."""
    return {"+": 1.0, "-": -1.0}.get((layout.face or " ")[0], 0.0)


def bending_row(layout: PztLayout) -> int:
    """The index, in the four strains of a section, of the curvature towards the patches' normal."""
    return BEND_Y if layout.normal == "y" else BEND_Z


def own_row(layout: PztLayout) -> int:
    """The index in e of the strain that the layout actuates."""
    return TWIST if layout.bends == "twist" else bending_row(layout)


def across_row(layout: PztLayout) -> int:
    """The index in e of the curvature across the patches' width."""
    return BEND_Z if layout.normal == "y" else BEND_Y


def felt_rows(layout: PztLayout) -> Indices:
    """Indices (any,) in strains e (see `layer_loads`) of those that interact with the patches."""
    if layout.face is None:
        return np.array([own_row(layout)])
    return np.flatnonzero([True, True, layout.lamina.shears, True])


def layer_section(layout: PztLayout, extent: float) -> tuple[float, float, float]:
    """(A, S, I) = w ∫ (1, η, η²) dη over all layers, m², m³, m⁴; η from the link's axis.

    `extent` is t_b (m) of the link along their normal; layers without a named face lie on one.
    """
    w, t = layout.width, layout.layers * layout.thickness
    inner, outer = extent / 2, extent / 2 + t
    faces = 2 if layout.face == "both" else 1
    sign = 0.0 if layout.face == "both" else side(layout) or 1.0
    return faces * w * t, sign * w * (outer**2 - inner**2) / 2, faces * w * (outer**3 - inner**3) / 3


def layer_loads(layout: PztLayout, extent: float, lever: float) -> tuple[Array, Array]:
    """C (4, 4), f (4,) of loads P = f V − C e, N·m and N, of the layers by strains e = (φ_z', u', φ_x', −φ_y').

    The link has `extent` t_b (m) along their normal; `lever` is β of `LinkSections.shear_lever`. Along the strain that
    they actuate, f of plain ceramic on one face is E_p d31 w_p times the sum of the layers' arms t_b/2 + (i − ½) t_p
    (one: Eq. 14 of Shabana 2022), N·m/V. Both faces double it; twist has the shear force per width of a volt, times β,
    in place of E_p d31.
    """
    A, S, I = layer_section(layout, extent)  # noqa: E741
    sign, middle, w = np.sign(S), layout.offset, layout.width
    arm = A * (extent + layout.layers * layout.thickness) / 2  # ∫ |η| dA
    (E, D), (_, G) = layout.lamina.C
    n_x, n_s = layout.lamina.per_volt
    axial = [STRETCH, bending_row(layout), across_row(layout)]  # ε of these: 1, −η, −ζ
    area = np.array([[A, -S, -A * middle], [-S, I, S * middle], [-A * middle, S * middle, A * (middle**2 + w**2 / 12)]])
    at_arm = arm * np.array([1.0, 0.0, -middle])  # ∫ |η| (1, −η, −ζ) dA
    at_arm[1] = -sign * I
    C, f = np.zeros((4, 4)), np.zeros(4)
    C[np.ix_(axial, axial)] = E * area
    C[axial, TWIST] = C[TWIST, axial] = D * lever * at_arm
    C[TWIST, TWIST] = G * lever**2 * I
    if layout.bends == "twist":
        f[axial], f[TWIST] = n_x * area[0], n_s * lever * arm
    else:
        f[axial], f[TWIST] = n_x * np.array([-sign * A, arm, sign * A * middle]), -sign * n_s * lever * arm
    return C, f
