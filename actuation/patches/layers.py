"""The layers of a patch by themselves: where they are on a section, and what a volt and the section's strains do.

Layers at the distance η from the axis, on faces with the outward sign s, strain as the section does,

    ε = u' − η κ,    γ = β |η| φ_x'

with the curvature κ towards their normal and β of `sections.LinkSections.shear_lever`, and take C (ε, γ) − C Λ V
(`lamina`). By virtual work their loads on the section are ∫ Bᵀ (C Λ V − C B e) dA with the rows B of these strains.
Faces are driven against each other to bend, alike to twist.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices
from .records import PztLayout
from .sections import BEND_Y, BEND_Z, STRETCH, TWIST


class LayerSection(NamedTuple):
    """(A, S, I) = w ∫ (1, η, η²) dη over all layers, m², m³, m⁴; η from the link's axis."""

    A: float
    S: float
    I: float  # noqa: E741, second moment of area


class LayerLoads(NamedTuple):
    """Loads of layers on a section, P = f V − C e over its strains e = (φ_z', u', φ_x', −φ_y'): C (4, 4), f (4,)."""

    C: Array
    f: Array


def side(layout: PztLayout) -> float:
    """1.0 of patches on the face at largest y (or z), -1.0 at smallest, 0.0 of those on both or on no named face."""
    return {"+": 1.0, "-": -1.0}.get((layout.face or " ")[0], 0.0)


def bending_row(layout: PztLayout) -> int:
    """Which of the strains e is the curvature towards the patches' normal."""
    return BEND_Y if layout.normal == "y" else BEND_Z


def own_row(layout: PztLayout) -> int:
    """Which of the strains e the layout is there for."""
    return TWIST if layout.acts_in == "twist" else bending_row(layout)


def felt_rows(layout: PztLayout) -> Indices:
    """Which of the strains e feel the patches: see `composite`."""
    found = {own_row(layout)}
    if side(layout):
        found |= {bending_row(layout), STRETCH}
        found |= {TWIST} if layout.lamina.C[0, 1] or layout.lamina.per_volt[1] else set()
    elif layout.acts_in == "twist" and layout.face == "both":
        found |= {STRETCH}
    return np.array(sorted(found))


def layer_section(layout: PztLayout, extent: float) -> LayerSection:
    """On a link of that extent t_b (m) along their normal; those without a named face lie on one."""
    w, t = layout.width, layout.layers * layout.thickness
    inner, outer = extent / 2, extent / 2 + t
    faces = 2 if layout.face == "both" else 1
    sign = 0.0 if layout.face == "both" else side(layout) or 1.0
    return LayerSection(faces * w * t, sign * w * (outer**2 - inner**2) / 2, faces * w * (outer**3 - inner**3) / 3)


def layer_loads(layout: PztLayout, extent: float, lever: float) -> LayerLoads:
    """Of all layers at a place of that extent (m) along their normal, on its strains; `lever`: β, 0 without fibres."""
    A, S, I = layer_section(layout, extent)  # noqa: E741
    sign = np.sign(S)
    arm = A * (extent + layout.layers * layout.thickness) / 2  # ∫ |η| dA
    (E, D), (_, G) = layout.lamina.C
    n_x, n_s = layout.lamina.per_volt
    C, f, bend = np.zeros((4, 4)), np.zeros(4), bending_row(layout)
    C[bend, bend], C[bend, STRETCH], C[STRETCH, STRETCH] = E * I, -E * S, E * A
    C[TWIST, TWIST], C[bend, TWIST], C[STRETCH, TWIST] = G * lever**2 * I, -D * lever * sign * I, D * lever * arm
    if layout.acts_in == "twist":
        f[[bend, STRETCH, TWIST]] = -n_x * S, n_x * A, n_s * lever * arm
    else:
        f[[bend, STRETCH, TWIST]] = n_x * arm, -sign * n_x * A, -sign * n_s * lever * arm
    return LayerLoads(C + C.T - np.diag(np.diag(C)), f)


def straight_loads(layout: PztLayout, extent: float, lever: float) -> Array:
    """(4,) of a volt on a link held straight, of the rows that feel it: N·m, N."""
    found, rows = np.zeros(4), felt_rows(layout)
    found[rows] = layer_loads(layout, extent, lever).f[rows]
    return found


def load_per_volt(layout: PztLayout, extent: Array, lever: Array) -> Array:
    """Moment (k,) c per volt, N·m/V, of a link held straight; the layers' own stiffness takes of it: see `composite`.

    Of bending, E_p d31 w_p N (t_b + N t_p)/2 of N layers on one face, twice that on both: the layers' arms,
    t_b/2 + (i − ½) t_p, are summed. One layer on one face is Eq. 14 of Shabana 2022. Of twist, the shear force per
    width of a volt instead of E_p d31, times β.
    """
    row = own_row(layout)
    return np.array([layer_loads(layout, *place).f[row] for place in zip(extent, lever, strict=True)])
