"""Patches as layers of their link: the composite section, with whatever modes the link has.

Under the strains e = (φ', u') of the axis and a voltage V the layers at one place take the moment and the force

    P = f V − C e,    C = E_p [[I, −S], [−S, A]],    f = (c, ∓E_p d31 w N)

(Crawley and de Luis, AIAA J. 25, 1987, 1373–1385). The modes of the link have not the steps of curvature at the ends of
patches. What they lack is static and known: of a link that is held isostatically, a moment or a force in one section
strains that section alone, by 1/EI and 1/EA, of which the modes, with strains B p, have B K⁻¹ Bᵀ. At Gauss points of
weights w, with C and f for the length w of each,

    e = B p + R P,    R = diag(1/(w EI), 1/(w EA)) − B K⁻¹ Bᵀ,    P = (1 + C R)⁻¹ (f V − C B p)

so that the patches add the stiffness Bᵀ (1 + C R)⁻¹ C B to the link and have the modal forces Bᵀ (1 + C R)⁻¹ f V.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import Interface, ModalBody
from ...mbs.quantities.stress import SectionLoads
from .layers import as_array, layer_section, moment_per_volt, pull_per_volt, side
from .records import PztLayout

SLIVER = 1e-6  # of a patch: what a station cuts off less of stays whole
GAUSS_POINTS = 4  # products of the cubics of an element are of degree 6


class GaussPoint(NamedTuple):
    """A place x (m) under patch number `patch`, its weight (m), the link's height (m), EA (N) and EI (N·m²) there."""

    patch: int
    x: float
    weight: float
    height: float
    EA: float
    EI: float


@dataclass(frozen=True)
class Composite:
    """What k patches and their link do to each other, over the n modes of the modal body.

    Attributes:
        stiffness: (n, n) that the patches add.
        shortfall: (k, n) modal forces per volt that the layers' own stiffness takes of those on a link held straight.
    """

    stiffness: Array
    shortfall: Array


def composite(layout: PztLayout, body: ModalBody, edges: Array) -> Composite:
    """Of the patches between `edges` (k, 2), m; R is 0 where rigidities are not known.

    On both faces patches bend only. On one named face they stretch the link too; without a named face they lie on one
    and the axis stretches freely, which shifts the neutral axis, but no mode along the link feels them.
    """
    layers = _on_link(layout, body, edges)
    stiffness, per_volt = layers.B.T @ layers.by_modes, layers.by_volts.T @ layers.B
    return Composite(0.5 * (stiffness + stiffness.T), layers.straight.T @ layers.B - per_volt)


def section_loads(layout: PztLayout, body: ModalBody, edges: Array, p: Array, voltages: Array) -> SectionLoads:
    """P over a motion, per length of the link: p (T, n) in the modes of the modal body, voltages (T, k)."""
    layers = _on_link(layout, body, edges)
    P = voltages @ layers.by_volts.T - p @ layers.by_modes.T
    count = len(layers.points)
    density = P.reshape(len(p), count, -1) / np.array([at.weight for at in layers.points])[:, None]
    along = density[..., 1] if density.shape[2] == 2 else np.zeros((len(p), count))
    patch = np.array([at.patch for at in layers.points])
    x = np.array([at.x for at in layers.points])
    return SectionLoads(edges, patch, x, density[..., 0], along, P @ layers.B)


class _OnLink(NamedTuple):
    """Layers on their link, rows (φ', and on one named face u') of each Gauss point.

    B (rows, n); P of coordinates p and of voltages: `by_modes` (rows, n) taken off, `by_volts` (rows, k); `straight`
    (rows, k) of a volt on a link held straight.
    """

    points: list[GaussPoint]
    B: Array
    by_modes: Array
    by_volts: Array
    straight: Array


def _on_link(layout: PztLayout, body: ModalBody, edges: Array) -> _OnLink:
    points = list(gauss_points(body, edges))
    one_face = bool(side(layout))
    loads = [_layers(layout, at) for at in points]
    strains = np.array([np.stack(_slopes(body, at.x)) for at in points])  # (g, 2, n)
    rows = 2 if one_face else 1
    B: Array = strains[:, :rows].reshape(-1, body.mode_count)
    C, f = np.zeros((len(B), len(B))), np.zeros((len(B), len(edges)))
    straight, exact = np.zeros_like(f), np.zeros(len(B))
    for i, (at, (C_i, f_i)) in enumerate(zip(points, loads, strict=True)):
        block = slice(rows * i, rows * (i + 1))
        C[block, block], f[block, at.patch] = at.weight * C_i[:rows, :rows], at.weight * f_i[:rows]
        straight[block, at.patch] = at.weight * _volt(layout, at)[:rows]
        exact[block] = 1.0 / (at.weight * np.array([at.EI, at.EA]))[:rows]
    R = _residual(exact, B @ np.linalg.solve(body.stiffness, B.T))
    held = np.linalg.solve(np.eye(len(B)) + C @ R, np.concatenate([C @ B, f], axis=1))
    return _OnLink(points, B, held[:, : B.shape[1]], held[:, B.shape[1] :], straight)


def stiffness_ratios(layout: PztLayout, body: ModalBody, edges: Array) -> tuple[Array, Array]:
    """Of each patch (k,): ψ, and its authority; nan where the link's rigidities are not known.

    ψ = E_b A_b / (E_p w N t_p), E_b t_b / (E_p t_p) at equal widths. The authority is the curvature under a voltage, in
    parts of c V/EI, that of a link which does not feel the layers' stiffness.
    """
    found = np.zeros((len(edges), 3))
    for at in gauss_points(body, edges):
        C, f = _layers(layout, at)
        strain = np.linalg.solve(np.diag([at.EI, at.EA]) + C, f)
        ratio = at.EA / (layout.modulus * layout.width * layout.layers * layout.thickness)
        found[at.patch] += at.weight * np.array([1.0, ratio, strain[0] * at.EI / _volt(layout, at)[0]])
    return found[:, 1] / found[:, 0], found[:, 2] / found[:, 0]


def gauss_points(body: ModalBody, edges: Array) -> Iterator[GaussPoint]:
    """Along all patches. No interval crosses a station: shapes have kinks there, sections steps."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)  # type: ignore[no-untyped-call, unused-ignore]
    stations = body.stations.position[:, 0]
    unknown = np.full((len(stations), 2), np.nan)
    rigidity = unknown if body.stations.rigidity is None else body.stations.rigidity
    for patch, (start, end) in enumerate(edges.clip(0.0, body.length)):
        slack = SLIVER * (end - start)
        inside = stations[(stations > start + slack) & (stations < end - slack)]
        for a, b in np.lib.stride_tricks.sliding_window_view(np.concatenate([[start], inside, [end]]), 2):
            station = np.searchsorted(stations, (a + b) / 2, side="right") - 1
            height, (EA, EI) = float(body.stations.height[station]), rigidity[station]
            for node, weight in zip(nodes, weights, strict=True):
                x = (a + b) / 2 + node * (b - a) / 2
                yield GaussPoint(patch, x, weight * (b - a) / 2, height, float(EA), float(EI))


def _layers(layout: PztLayout, at: GaussPoint) -> tuple[Array, Array]:
    """C (2, 2) and f (2,) of the layers at one place, per length of the link, rows (φ', u')."""
    A, S, I = layer_section(layout, at.height)  # noqa: E741
    C, f = layout.modulus * np.array([[I, -S], [-S, A]]), _volt(layout, at)
    if side(layout) or layout.face == "both":
        return C, f
    if np.isnan(at.EA):
        return np.diag([C[0, 0], 0.0]), f
    axial = at.EA + C[1, 1]  # free to stretch: u' from no force along the link
    return np.diag([C[0, 0] - C[0, 1] ** 2 / axial, 0.0]), f * at.EA / axial


def _volt(layout: PztLayout, at: GaussPoint) -> Array:
    """(2,) moment and force of a volt on a link held straight."""
    return np.array([float(moment_per_volt(layout, as_array(at.height))[0]), pull_per_volt(layout)])


def _residual(exact: Array, of_modes: Array) -> Array:
    """R, without what rounding and the difference of nominal and finite element stiffness make negative of it."""
    if np.isnan(exact).any():
        return np.zeros_like(of_modes)
    scale = np.sqrt(exact)
    values, turn = np.linalg.eigh(np.eye(len(exact)) - of_modes / np.outer(scale, scale))
    return np.asarray((scale[:, None] * turn * values.clip(min=0.0)) @ (turn.T * scale))


def _slopes(body: ModalBody, x: float) -> tuple[Array, Array]:
    """φ' and u' (n,) of the modes at x: differences inside an element, exact for its quadratics."""
    stations = body.stations.position[:, 0]
    h = min(1e-3 * body.length, 0.5 * float(np.abs(stations - x).min()))
    return _differences(body.interpolate(x - h), body.interpolate(x + h), h)


def _differences(behind: Interface, ahead: Interface, h: float) -> tuple[Array, Array]:
    curvature: Array = (ahead.rotation[2] - behind.rotation[2]) / (2 * h)
    stretch: Array = (ahead.translation[0] - behind.translation[0]) / (2 * h)
    return curvature, stretch
