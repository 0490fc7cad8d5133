"""Patches as layers of their link: the composite section with its modes, and what a volt on each does to these.

Under the strains e = (φ_z', u', φ_x', −φ_y') of the axis and a voltage V the layers at one place take the loads

    P = f V − C e          (`layers`; in the plane e = (φ', u'), C = E_p [[I, −S], [−S, A]], f = (c, ∓E_p d31 w N))

(Crawley and de Luis, AIAA J. 25, 1987, 1373–1385). The modes of the link have not the steps of curvature at the ends of
patches. What they lack is static and known: of a link that is held isostatically, a load in one section strains that
section alone, by 1/EI, 1/EA, 1/GJ, of which the modes, with strains B p, have B K⁻¹ Bᵀ. At Gauss points of weights w,
with C and f for the length w of each,

    e = B p + R P,    R = diag(1/(w EI), 1/(w EA) …) − B K⁻¹ Bᵀ,    P = (1 + C R)⁻¹ (f V − C B p)

so that the patches add the stiffness Bᵀ (1 + C R)⁻¹ C B to the link and have the modal forces Bᵀ (1 + C R)⁻¹ f V.
Layouts of one link feel each other through its modes, and are taken together.

Patches that bend (or twist) and name no face do that alone: on one face, where the section is free in all else, which
shifts the neutral axis, but no other mode feels them. On named faces all strains of the section feel them: those on one
face stretch the link, too, and those off the middle of the width bend it about both axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices, as_floats
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ...mbs.quantities.stress import SectionLoads
from .records import PztLayout
from .sections import (
    STRETCH,
    TWIST,
    LayerLoads,
    LinkSections,
    across_row,
    bending_row,
    felt_rows,
    layer_loads,
    link_sections,
    load_per_volt,
    own_row,
    potentials,
    side,
    straight_loads,
)

SLIVER = 1e-6  # of a patch: what a station cuts off less of stays whole
GAUSS_POINTS = 4  # products of the cubics of an element are of degree 6


class PlacedLayout(NamedTuple):
    """A layout with its patches between `edges` (k, 2), m."""

    layout: PztLayout
    edges: Array


class GaussPoint(NamedTuple):
    """A place x (m) in interval number `interval`, its weight (m), and the station whose section holds there."""

    interval: int
    x: float
    weight: float
    station: int


def composite(placed: Sequence[PlacedLayout], body: ModalBody) -> tuple[Array, Array, Array]:
    """Return the mutual effects of the k patches of all layouts and their link, over n modes of the modal body.

    The stiffness (n, n) that patches add, and the modal forces per volt (k, n) that the layers' own stiffness takes of
    those on a link held straight; R is 0 where rigidities are not known. Last `LayersOnLink.yielding`.
    """
    layers = layers_on_link(placed, body)
    stiffness, per_volt = layers.B.T @ layers.by_modes, layers.by_volts.T @ layers.B
    return 0.5 * (stiffness + stiffness.T), layers.straight.T @ layers.B - per_volt, layers.yielding


def section_loads(placed: PlacedLayout, body: ModalBody, p: Array, voltages: Array) -> SectionLoads:
    """P over a motion, per length of the link, of patches that bend in the plane: p (T, n), file's; voltages (T, k)."""
    layers = layers_on_link([placed], body)
    P = voltages @ layers.by_volts.T - p @ layers.by_modes.T
    count = len(layers.points)
    density = P.reshape(len(p), count, -1) / np.array([at.weight for at in layers.points])[:, None]
    along = density[..., STRETCH] if density.shape[2] > 1 else np.zeros((len(p), count))
    patch = np.array([at.interval for at in layers.points])
    x = np.array([at.x for at in layers.points])
    return SectionLoads(placed.edges, patch, x, density[..., 0], along, P @ layers.B)


class LayersOnLink(NamedTuple):
    """Layers on their link, of each Gauss point a row for each strain of e that is felt anywhere.

    B (rows, n); P of coordinates p and of voltages: `by_modes` (rows, n) taken off, `by_volts` (rows, k); `straight`
    (rows, k) of a volt on a link held straight. `yielding` (k,): what the residual strains add to capacitances, F.
    """

    points: list[GaussPoint]
    B: Array
    by_modes: Array
    by_volts: Array
    straight: Array
    yielding: Array


def layers_on_link(placed: Sequence[PlacedLayout], body: ModalBody) -> LayersOnLink:
    """Return what the layers of all layouts do on their link."""
    sections = link_sections(body)
    intervals, covering = _intervals(placed)
    points = list(gauss_points(body, intervals))
    strains = _strains(body, np.array([at.x for at in points]))
    felt = _felt([layout for layout, _ in placed], strains)
    B = strains[:, felt].reshape(-1, body.mode_count)
    patches = sum(len(edges) for _, edges in placed)
    C, f = np.zeros((len(B), len(B))), np.zeros((len(B), patches))
    straight, exact = np.zeros_like(f), np.zeros(len(B))
    for i, at in enumerate(points):
        block = slice(len(felt) * i, len(felt) * (i + 1))
        exact[block] = 1.0 / (at.weight * sections.rigidity[at.station, felt])
        for layout, patch in covering[at.interval]:
            loads = felt_loads(layout, sections, at.station)
            C[block, block] += at.weight * loads.C[np.ix_(felt, felt)]
            f[block, patch] = at.weight * loads.f[felt]
            straight[block, patch] = at.weight * straight_loads(layout, *place_of(layout, sections, at.station))[felt]
    R = _residual(exact, B @ np.linalg.solve(body.stiffness, B.T))
    held = np.linalg.solve(np.eye(len(B)) + C @ R, np.concatenate([C @ B, f], axis=1))
    by_volts = held[:, B.shape[1] :]
    return LayersOnLink(points, B, held[:, : B.shape[1]], by_volts, straight, (f * (R @ by_volts)).sum(axis=0))


def _felt(layouts: Sequence[PztLayout], strains: Array) -> Indices:
    """Which of the strains (g, 4, n) feel layers; a curvature about their normal only where modes have it."""
    felt = np.zeros(4, dtype=bool)
    for layout in layouts:
        rows = felt_rows(layout)
        if not layout.offset and not strains[:, across_row(layout)].any():
            rows = rows[rows != across_row(layout)]
        felt[rows] = True
    return np.flatnonzero(felt)


def stiffness_ratios(placed: PlacedLayout, body: ModalBody) -> tuple[Array, Array]:
    """Return ψ (k,) of each patch, and its authority (k,); NaN without known rigidities of the link.

    ψ = E_b A_b / (E_p w N t_p), E_b t_b / (E_p t_p) at equal widths. The authority is the curvature (or twist) under a
    voltage, in parts of c V/EI (c V/GJ), that of a link which does not feel the layers' stiffness.
    """
    layout, edges = placed
    sections = link_sections(body)
    own, felt = own_row(layout), felt_rows(layout)

    def ratios(station: int) -> tuple[float, float]:
        rigidity = sections.rigidity[station]
        C, f = felt_loads(layout, sections, station)
        strain = np.linalg.solve(np.diag(rigidity[felt]) + C[np.ix_(felt, felt)], f[felt])[np.searchsorted(felt, own)]
        psi = rigidity[STRETCH] / (layout.modulus * layout.width * layout.layers * layout.thickness)
        straight = straight_loads(layout, *place_of(layout, sections, station))[own]
        return psi, strain * rigidity[own] / straight

    lengths, alike = _lengths_between_stations(body, edges), sections.alike[:-1]
    covered = np.unique(alike[lengths.any(axis=0)])
    shares = np.stack([lengths[:, alike == station].sum(axis=1) for station in covered], axis=1)
    found = shares @ np.array([ratios(int(station)) for station in covered]) / shares.sum(axis=1, keepdims=True)
    return found[:, 0], found[:, 1]


def _lengths_between_stations(body: ModalBody, intervals: Array) -> Array:
    """(m, stations − 1) of `intervals` (m, 2) between one station and the next, m, without slivers."""
    x = body.stations.position[:, 0]
    starts, ends = (edge[:, None] for edge in intervals.clip(0.0, body.length).T)
    lengths: Array = (np.minimum(ends, x[1:]) - np.maximum(starts, x[:-1])).clip(min=0.0)
    return np.where(lengths > SLIVER * (ends - starts), lengths, 0.0)


def gauss_points(body: ModalBody, intervals: Array) -> Iterator[GaussPoint]:
    """Along `intervals` (m, 2). None is integrated across a station: shapes have kinks there, sections steps."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)  # type: ignore[no-untyped-call, unused-ignore]
    stations = body.stations.position[:, 0]
    for number, (start, end) in enumerate(intervals.clip(0.0, body.length)):
        slack = SLIVER * (end - start)
        inside = stations[(stations > start + slack) & (stations < end - slack)]
        for a, b in np.lib.stride_tricks.sliding_window_view(np.concatenate([[start], inside, [end]]), 2):
            station = int(np.searchsorted(stations, (a + b) / 2, side="right")) - 1
            for node, weight in zip(nodes, weights, strict=True):
                yield GaussPoint(number, (a + b) / 2 + node * (b - a) / 2, weight * (b - a) / 2, station)


def place_of(layout: PztLayout, sections: LinkSections, station: int) -> tuple[float, float]:
    """Extent along the patches' normal (m), as `LinkSections.extent` has it of their face, and β at a station."""
    lever = sections.shear_lever(station, layout.normal, layout.width) if layout.lamina.shears else 0.0
    return float(sections.extent(layout.normal, side(layout))[station]), lever


def felt_loads(layout: PztLayout, sections: LinkSections, station: int) -> LayerLoads:
    """Loads C (4, 4) and f (4,) of the layers in the rows that feel them, the section free in the others, else 0.

    Free means that link and layers together carry nothing there: e_d = (C_l + C)_dd⁻¹ (f_d V − C_df e_f), eliminated.
    """
    loads = layer_loads(layout, *place_of(layout, sections, station))
    felt = felt_rows(layout)
    free = np.setdiff1d([row for row in (bending_row(layout), STRETCH, TWIST) if loads.C[row].any()], felt)
    C, f = np.zeros((4, 4)), np.zeros(4)
    C[np.ix_(felt, felt)], f[felt] = loads.C[np.ix_(felt, felt)], loads.f[felt]
    rigidity = sections.rigidity[station, free]
    if free.size and not np.isnan(rigidity).any():
        across = np.linalg.solve(np.diag(rigidity) + loads.C[np.ix_(free, free)], loads.C[np.ix_(free, felt)])
        C[np.ix_(felt, felt)] -= loads.C[np.ix_(felt, free)] @ across
        f[felt] -= across.T @ loads.f[free]
    return LayerLoads(C, f)


def _intervals(placed: Sequence[PlacedLayout]) -> tuple[Array, list[list[tuple[PztLayout, int]]]]:
    """Stretches (m, 2) of the link with the same patches on each, and which: layouts with numbers of their patches.

    Patches are numbered through the layouts. Those of one layout lie beside each other and are the stretches.
    """
    edges = np.concatenate([edges for _, edges in placed])
    owners = [layout for layout, of_layout in placed for _ in of_layout]
    if len(placed) == 1:
        return edges, [[(layout, k)] for k, layout in enumerate(owners)]
    slack = SLIVER * np.diff(edges, axis=1).min()
    cuts = np.unique(edges)
    cuts = cuts[np.append(True, np.diff(cuts) > slack)]
    pairs = np.stack([cuts[:-1], cuts[1:]], axis=1)
    on = [np.flatnonzero((edges[:, 0] < b - slack) & (edges[:, 1] > a + slack)) for a, b in pairs]
    kept = [k for k, patches in enumerate(on) if patches.size]
    return pairs[kept], [[(owners[patch], int(patch)) for patch in on[k]] for k in kept]


def _residual(exact: Array, of_modes: Array) -> Array:
    """R, without what round-off and the difference of nominal and finite element stiffness make negative of it."""
    if np.isnan(exact).any():
        return np.zeros_like(of_modes)
    scale = np.sqrt(exact)
    values, turn = np.linalg.eigh(np.eye(len(exact)) - of_modes / np.outer(scale, scale))
    return np.asarray((scale[:, None] * turn * values.clip(min=0.0)) @ (turn.T * scale))


def _strains(body: ModalBody, x: Array) -> Array:
    """B (m, 4, n): e of the modes at x (m,): differences inside an element, exact for its quadratics."""
    stations = body.stations.position[:, 0]
    h = np.minimum(1e-3 * body.length, 0.5 * np.abs(stations - x[:, None]).min(axis=1))
    rise = potentials(body, x + h) - potentials(body, x - h)
    return as_floats(rise / (2 * h)[:, None, None])


STEP = 0.1  # of the extent, from one station to the next; less is a taper


class Effects(NamedTuple):
    """Effects of k patches on the n modes of a modal body."""

    extent: Array  # (k,) t_b, of the link along their normal under each patch, its mean, m: see `LinkSections.extent`
    per_volt: Array  # (k,) c, the load that each is there for, N·m/V
    lever: Array  # (k,) strain of the surface by unit curvature and distance; by twist, β/2, of its diagonals
    turn: Array  # (k, n) by how much the sections at the patch's ends turn against each other in its own sense, rad
    Phi_V: Array  # (k, n) modal forces per volt, less what the layers' own stiffness takes
    yielding: Array  # (k,) what strains that modes lack add to the capacitance, F


def effects(key: str, placed: Sequence[PlacedLayout], body: ModalBody) -> list[Effects]:
    """Return the effects of one link's layouts, coupled by their stiffness if it counts."""
    found = [_straight(key, one, body) for one in placed]
    stiff = [k for k, one in enumerate(placed) if one.layout.adds_stiffness]
    if not stiff:
        return found
    _, *of_patches = composite([placed[k] for k in stiff], body)
    ends = np.cumsum([len(placed[k].edges) for k in stiff])[:-1]
    for k, lacking, yielding in zip(stiff, *(np.split(of, ends) for of in of_patches), strict=True):
        found[k] = found[k]._replace(Phi_V=found[k].Phi_V - lacking, yielding=yielding)
    return found


def _straight(key: str, placed: PlacedLayout, body: ModalBody) -> Effects:
    """On a link held straight: the loads of a volt times the differences of what they work on, stretch by stretch."""
    layout, edges = placed
    own, sections = own_row(layout), link_sections(body)
    starts, ends, stations, first = _stretches(key, layout, body, sections, edges)
    alike, which = np.unique(sections.alike[stations], return_inverse=True)
    places = np.array([place_of(layout, sections, station) for station in alike.tolist()])
    loads = np.array([straight_loads(layout, *place) for place in places])[which]
    before, after = np.split(potentials(body, np.concatenate([starts, ends])), 2)
    differences = after - before
    of_stretch = np.stack([places[:, 0], load_per_volt(layout, *places.T), places[:, 1]])[:, which]
    extent, c, lever = np.add.reduceat(of_stretch * (ends - starts), first, axis=1) / np.add.reduceat(
        ends - starts, first
    )
    turn = np.add.reduceat(differences[:, own], first)
    Phi_V = np.add.reduceat(np.einsum("ir,irn->in", loads, differences), first)
    if layout.coupling == "surface":
        membrane = c / (layout.width * extent / 2)
        if layout.strain == "biaxial":
            membrane /= 1.0 - (layout.poissons_ratio or 0.0)
        Phi_V = membrane[:, None] * _outlined(key, layout, body, edges)
    lever = lever / 2 if layout.acts_in == "twist" else np.ones(len(edges))
    return Effects(extent, c, lever, turn, Phi_V, np.zeros(len(edges)))


class _Stretches(NamedTuple):
    """Of k patches, one after the other, each m of one extent: `starts`, `ends` (m,), m; `first` (k,) of each patch."""

    starts: Array
    ends: Array
    stations: Indices
    first: Indices


def _stretches(key: str, layout: PztLayout, body: ModalBody, sections: LinkSections, edges: Array) -> _Stretches:
    """Stretches into which changes of the link's extent cut patches between `edges` (k, 2), and their stations."""
    x, (starts, ends) = body.stations.position[:, 0], edges.T
    slack = np.minimum(1e-9 * body.length, 0.25 * (ends - starts))
    covered = (x[1:] > (starts + slack)[:, None]) & (x[:-1] < (ends - slack)[:, None])
    if not covered.any(axis=1).all():  # round-off: it begins where it ends
        raise InputError(f"{key}: length: expected patches that can be seen on a link of {body.length:g} m", "less")
    extents = sections.extent(layout.normal, side(layout))[:-1]
    jump = np.abs(np.diff(extents)) / np.maximum(extents[1:], extents[:-1])
    jumps = np.where(covered[:, 1:] & covered[:, :-1], jump, 0.0)
    if jumps.max(initial=0.0) > STEP:
        number = int((jumps > STEP).any(axis=1).argmax())
        k = int(jumps[number].argmax())
        what = "height" if layout.normal == "y" else "width"
        raise InputError(
            f"{key}: expected patches on one section each",
            f"patch {number + 1} ({starts[number]:g} to {ends[number]:g} m) across a step of the {what} from"
            f" {extents[k]:g} to {extents[k + 1]:g} m at {x[k + 1]:g} m",
        )
    last, cut = covered.copy(), covered.copy()
    last[:, :-1] &= ~covered[:, 1:]
    cut[:, :-1] &= last[:, :-1] | (jumps > 1e-9)
    patch, stations = np.nonzero(cut)
    is_last = last[patch, stations]
    found = np.where(is_last, np.minimum(ends, body.length)[patch], x[stations + 1])
    first = np.append(0, np.flatnonzero(is_last)[:-1] + 1)
    begin = np.append(0.0, found[:-1])
    begin[first] = np.maximum(starts, 0.0)
    return _Stretches(begin, found, stations, first)


def _outlined(key: str, layout: PztLayout, body: ModalBody, edges: Array) -> Array:
    """(k, n) modal forces of unit membrane force (N/m): pressing the upper face, pulling the lower, halved on both.

    On the layout's face; all that are outlined where it names none. Raises `InputError` where they are not outlined.
    """
    patches = body.surface_patches
    if patches is None:
        raise InputError(
            f'{key}: coupling: expected "rotation", or a link whose file outlines the patches ([surface_patch])',
            '"surface" and none outlined',
        )
    found = (*edges.ravel(), layout.width)
    outlined = (*patches.edges.ravel(), patches.width)
    if len(found) != len(outlined) or not np.allclose(found, outlined, rtol=0.0, atol=1e-6 * body.length):
        raise InputError(
            f"{key}: coupling: expected the {len(patches.edges)} patches that the link file outlines, from"
            f" {_places(patches.edges)} m and {patches.width:g} m wide",
            f"{len(edges)}, from {_places(edges)} m and {layout.width:g} m wide",
        )
    outlined_on = {"+y": patches.top, "-y": patches.bottom}
    if layout.strain == "biaxial":
        across = {"+y": patches.top_across, "-y": patches.bottom_across}
        if any((of is None) != (across[face] is None) for face, of in outlined_on.items()):
            raise InputError(
                f'{key}: strain: expected "uniaxial", or a modal body file with strains across outlined patches',
                "one of an earlier version: recompute it from its link file with `ffrobot link`",
            )
        outlined_on = {
            face: None if of is None or (more := across[face]) is None else of + more
            for face, of in outlined_on.items()
        }
    wanted = ["+y", "-y"] if layout.face == "both" else [layout.face] if layout.face else []
    if missing := [face for face in wanted if outlined_on[face] is None]:
        raise InputError(
            f"{key}: face: expected patches on faces that the link file outlines ([surface_patch] faces)",
            f'"{layout.face}", of which {missing[0]} has none outlined',
        )
    signs = {"+y": -1.0, "-y": 1.0}
    faces = [signs[name] * of for name, of in outlined_on.items() if of is not None and (not wanted or name in wanted)]
    return np.asarray(sum(faces) / len(faces))


def _places(edges: Array) -> str:
    return ", ".join(f"{start:g} to {end:g}" for start, end in edges)
