"""Mass and stiffness of the patches as part of the link (the reference paper neglects both)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import Interface, ModalBody
from ...mbs.model.masses import with_masses
from ...mbs.model.planar_body import PlanarBody, PlanarPoint
from .patches import patch_edges, section_height
from .records import PztLayout

GAUSS_POINTS = 4  # products of the cubics of an element are of degree 6


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


def with_patches(planar: PlanarBody, body: ModalBody, layout: PztLayout) -> PlanarBody:
    """The link with mass and stiffness of its patches, as far as `layout.structural` names them.

    Its own modes are the Ritz functions, so it keeps their number. Mass lies on the axis, like that of a beam. Layers
    from y1 to y2 strain as the section does, ε = u' − y φ':

        ΔK = E_p ∫ (A u'ᵀu' − S (u'ᵀφ' + φ'ᵀu') + I φ'ᵀφ') dx,   (A, S, I) = w ∫ (1, y, y²) dy

    On both faces, or without a named one, they bend only: the terms in u' are left out.
    """
    points: list[PlanarPoint] = []
    masses: list[float] = []
    stiffness = np.zeros((planar.n_modes, planar.n_modes))
    T = planar.modal_transform
    for x, weight, (A, S, I) in _gauss_points(layout, body):  # noqa: E741, second moment of area
        at = body.interpolate(x)
        points.append(PlanarPoint(at.position[:2], at.translation[:2] @ T, at.rotation[2] @ T))
        masses.append(weight * A * (layout.density or 0.0))
        stretch, curvature = (slope @ T for slope in _slopes(body, x))
        stiffness += weight * layout.modulus * I * np.outer(curvature, curvature)
        if layout.face in ("+y", "-y"):
            cross = np.outer(stretch, curvature)
            stiffness += weight * layout.modulus * (A * np.outer(stretch, stretch) - S * (cross + cross.T))
    if "mass" not in layout.structural:
        masses = [0.0] * len(masses)
    if "stiffness" not in layout.structural:
        stiffness[:] = 0.0
    return with_masses(planar, points, np.array(masses), np.zeros(len(masses)), stiffness)


def structure_effect(bare: PlanarBody, patched: PlanarBody) -> StructureEffect:
    """What the patches change."""
    pair = (bare, patched)
    return StructureEffect(
        np.array([body.mass for body in pair]),
        np.array([body.inertia for body in pair]),
        np.array([np.sqrt(body.stiffness) / (2 * np.pi) for body in pair]),
    )


def _section(layout: PztLayout, t_b: float) -> tuple[float, float, float]:
    """A, S, I (m², m³, m⁴) of all layers about the axis of a link of height t_b."""
    w, t = layout.width, layout.layers * layout.thickness
    inner, outer = t_b / 2, t_b / 2 + t
    faces = 2 if layout.face == "both" else 1
    side = {"-y": -1.0, "both": 0.0}.get(layout.face or "+y", 1.0)
    return faces * w * t, side * w * (outer**2 - inner**2) / 2, faces * w * (outer**3 - inner**3) / 3


def _gauss_points(layout: PztLayout, body: ModalBody) -> Iterator[tuple[float, float, tuple[float, float, float]]]:
    """Gauss points along all patches: x, weight, (A, S, I). No interval crosses a station: shapes have kinks there."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)  # type: ignore[no-untyped-call, unused-ignore]
    stations = body.stations.position[:, 0]
    for start, end in patch_edges(layout, body.length).clip(0.0, body.length):
        section = _section(layout, section_height(body, start, end))
        inside = stations[(stations > start) & (stations < end)]
        for a, b in np.lib.stride_tricks.sliding_window_view(np.concatenate([[start], inside, [end]]), 2):
            for node, weight in zip(nodes, weights, strict=True):
                yield (a + b) / 2 + node * (b - a) / 2, weight * (b - a) / 2, section


def _slopes(body: ModalBody, x: float) -> tuple[Array, Array]:
    """Slopes u' and φ' (n,) of the modes at x: differences inside an element, exact for its quadratics."""
    stations = body.stations.position[:, 0]
    h = min(1e-3 * body.length, 0.5 * float(np.abs(stations - x).min()))
    behind, ahead = (body.interpolate(x + step) for step in (-h, h))
    return _difference(behind, ahead, h)


def _difference(behind: Interface, ahead: Interface, h: float) -> tuple[Array, Array]:
    stretch: Array = (ahead.translation[0] - behind.translation[0]) / (2 * h)
    curvature: Array = (ahead.rotation[2] - behind.rotation[2]) / (2 * h)
    return stretch, curvature
