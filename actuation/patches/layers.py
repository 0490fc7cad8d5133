"""The layers of a patch by themselves: where they are on a section, the moment and pull of a volt."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .records import PztLayout


class LayerSection(NamedTuple):
    """(A, S, I) = w ∫ (1, y, y²) dy over all layers, m², m³, m⁴; y from the link's axis."""

    A: float
    S: float
    I: float  # noqa: E741, second moment of area


def side(layout: PztLayout) -> float:
    """1.0 of patches on the face at largest y, -1.0 at smallest y, 0.0 of those that bend only."""
    return {"+y": 1.0, "-y": -1.0}.get(layout.face or "", 0.0)


def layer_section(layout: PztLayout, height: float) -> LayerSection:
    """On a link of that height t_b (m); those without a named face lie on one."""
    w, t = layout.width, layout.layers * layout.thickness
    inner, outer = height / 2, height / 2 + t
    faces = 2 if layout.face == "both" else 1
    sign = 0.0 if layout.face == "both" else side(layout) or 1.0
    return LayerSection(faces * w * t, sign * w * (outer**2 - inner**2) / 2, faces * w * (outer**3 - inner**3) / 3)


def moment_per_volt(layout: PztLayout, height: Array) -> Array:
    """Moment (k,) c = E_p d31 w_p N (t_b + N t_p)/2 of N layers on one face, N·m/V; twice that on both faces.

    The layers' arms, t_b/2 + (i − ½) t_p, are summed. One layer on one face is Eq. 14 of Shaban 2022. It is that of a
    link held straight: what the layers' own stiffness takes of it is in `composite`.
    """
    layers, faces = layout.layers, 2 if layout.face == "both" else 1
    arms = layers * (height + layers * layout.thickness) / 2
    return faces * layout.modulus * layout.d31 * layout.width * arms


def pull_per_volt(layout: PztLayout) -> float:
    """Force along the link of the layers on one named face, N/V: bending forwards (M > 0) is a pull above the axis."""
    return float(-side(layout) * layout.modulus * layout.d31 * layout.width * layout.layers)


def as_array(values: float) -> Array:
    """One height as the array that `moment_per_volt` takes."""
    return np.array([values])
