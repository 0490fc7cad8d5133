"""Patches as layers of their link: the composite section with its modes, what a volt does, what patches add. SI units.

docs/theory.md, eqs. 32 to 34 and Patches in 3D, with strains e = (φ_z', u', φ_x', −φ_y') of the axis. Layers take the
loads P = f V − C e (`layer_loads`); at Gauss points of weights w, with C and f for the length w of each,

    e = B p + R P,    R = diag(1/(w EI), 1/(w EA) …) − B K⁻¹ Bᵀ,    P = (1 + C R)⁻¹ (f V − C B p)
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...common.keys import SMALLEST
from ...common.rotations import skew
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...mbs.model.body import Body, BodyPoint
from ...mbs.model.masses import with_line_masses
from ...mbs.quantities.stress import SectionLoads
from .records import PztLayout
from .sections import (
    STRETCH,
    TWIST,
    LinkSections,
    across_row,
    bending_row,
    felt_rows,
    layer_loads,
    layer_section,
    link_sections,
    own_row,
    potentials,
    side,
)

SLIVER = 1e-6  # of a patch: what a station cuts off less of stays whole
GAUSS_POINTS = 4  # products of the cubics of an element are of degree 6


class PlacedLayout(NamedTuple):
    """A layout with the begin and end of its k patches, x (k, 2) in m, `edges`."""

    layout: PztLayout
    edges: Array


class GaussPoint(NamedTuple):
    """Gauss point at x (m) in interval no. `interval`, its weight (m), index of the station before it."""

    interval: int
    x: float
    weight: float
    station: int


def section_loads(placed: PlacedLayout, body: ModalBody, p: Array, voltages: Array) -> SectionLoads:
    """Moments, N·m, and axial forces, N, of patches that bend a link in the plane on its sections.

    The motion is p (T, n), m·√kg, on the modes of the body's file, under voltages (T, k), V.
    """
    layers = layers_on_link([placed], body)
    P = voltages @ layers.by_volts.T - p @ layers.by_modes.T
    patch, x, weights, _ = map(np.array, zip(*layers.points, strict=True))
    density = P.reshape(len(p), len(x), -1) / weights[:, None]
    along = density[..., STRETCH] if density.shape[2] > 1 else np.zeros((len(p), len(x)))
    return SectionLoads(placed.edges, patch, x, density[..., 0], along, P @ layers.B)


class LayersOnLink(NamedTuple):
    """Layers of k patches on a link with n modes; each row is one strain, which the patches affect, at a Gauss point.

    B (rows, n): strains of the modes, SI. Under voltages V, layers load a link bent by p with `by_volts` (rows, k) V −
    `by_modes` (rows, n) p, and a straight one with `straight` (rows, k) V, N·m² and N·m: loads times weights of the
    points. `yielding` (k, k): what strains that modes lack add to capacitances, F.
    """

    points: list[GaussPoint]
    B: Array
    by_modes: Array
    by_volts: Array
    straight: Array
    yielding: Array


def layers_on_link(placed: Sequence[PlacedLayout], body: ModalBody) -> LayersOnLink:
    """The loads of the layers of all layouts on their link."""
    sections = link_sections(body)
    intervals, covering = _intervals(placed)
    points = list(gauss_points(body, intervals))
    strains = _strains(body, np.array([at.x for at in points]))
    is_felt = np.zeros(4, dtype=bool)
    for layout, _ in placed:
        rows, across = felt_rows(layout), across_row(layout)
        if not layout.offset and not strains[:, across].any():  # no mode has this curvature
            rows = rows[rows != across]
        is_felt[rows] = True
    felt = np.flatnonzero(is_felt)
    B = strains[:, felt].reshape(-1, body.mode_count)
    patches = sum(len(edges) for _, edges in placed)
    C, f = np.zeros((len(B), len(B))), np.zeros((len(B), patches))
    straight, exact, known = np.zeros_like(f), np.zeros(len(B)), dict[tuple[int, int], tuple[Array, Array, Array]]()
    for i, at in enumerate(points):
        block = slice(len(felt) * i, len(felt) * (i + 1))
        exact[block] = 1.0 / (at.weight * sections.rigidity[at.station, felt])
        for layout, patch in covering[at.interval]:
            key = id(layout), int(sections.alike[at.station])
            if key not in known:
                known[key] = felt_loads(layout, sections, at.station)
            of_strain, of_volt, on_straight = known[key]
            C[block, block] += at.weight * of_strain[np.ix_(felt, felt)] * layout.adds_stiffness
            f[block, patch] = at.weight * (of_volt if layout.adds_stiffness else on_straight)[felt]
            straight[block, patch] = at.weight * on_straight[felt]
    R = _residual(exact, np.linalg.solve(np.linalg.cholesky(body.stiffness), B.T).T)
    held = np.linalg.solve(np.eye(len(B)) + C @ R, np.concatenate([C @ B, f], axis=1))
    by_volts = held[:, B.shape[1] :]
    return LayersOnLink(points, B, held[:, : B.shape[1]], by_volts, straight, f.T @ R @ by_volts)


def stiffness_ratios(placed: PlacedLayout, body: ModalBody) -> tuple[Array, Array]:
    """The stiffness ratio ψ (k,) of link to patch, and the authority (k,), no unit; NaN for unknown rigidities.

    ψ = E_b A_b / (E_p w N t_p), E_b t_b / (E_p t_p) at equal widths. The authority is the curvature (or twist) under a
    voltage, relative to c V/EI (c V/GJ), that of a link without the layers' stiffness.
    """
    layout, edges = placed
    sections = link_sections(body)
    own, felt = own_row(layout), felt_rows(layout)

    @cache
    def ratios(station: int) -> Array:
        rigidity = sections.rigidity[station]
        C, f, straight = felt_loads(layout, sections, station)
        strain = np.linalg.solve(np.diag(rigidity[felt]) + C[np.ix_(felt, felt)], f[felt])[np.searchsorted(felt, own)]
        psi = rigidity[STRETCH] / (layout.modulus * layout.width * layout.layers * layout.thickness)
        return np.array([psi, strain * rigidity[own] / straight[own]])

    found = np.zeros((2, len(edges)))
    for at in gauss_points(body, edges):
        found[:, at.interval] += at.weight * ratios(int(sections.alike[at.station]))
    psi, authority = found / np.diff(edges)[:, 0]
    return psi, authority


def gauss_points(body: ModalBody, intervals: Array) -> Iterator[GaussPoint]:
    """Yield Gauss points along `intervals` (m, 2), m, split at stations, where shapes have kinks and sections steps."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    stations = body.stations.position[:, 0]
    for number, (start, end) in enumerate(intervals):
        slack = SLIVER * (end - start)
        inside = stations[(stations > start + slack) & (stations < end - slack)]
        for a, b in np.lib.stride_tricks.sliding_window_view(np.concatenate([[start], inside, [end]]), 2):
            station = int(np.searchsorted(stations, (a + b) / 2, side="right")) - 1
            for node, weight in zip(nodes, weights, strict=True):
                yield GaussPoint(number, (a + b) / 2 + node * (b - a) / 2, weight * (b - a) / 2, station)


def place_of(layout: PztLayout, sections: LinkSections, station: int) -> tuple[float, float]:
    """The link's extent along the normal of its patches (m), see `LinkSections.extent`, and β at a station.

    β, see `LinkSections.shear_lever`, is shear per twist and distance; 0 where the layers carry no shear.
    """
    lever = sections.shear_lever(station, layout.normal, layout.width) if layout.lamina.shears else 0.0
    return float(sections.extent(layout.normal, side(layout))[station]), lever


def felt_loads(layout: PztLayout, sections: LinkSections, station: int) -> tuple[Array, Array, Array]:
    """Stiffness C (4, 4) and loads per volt f (4,), SI, of the layers by strains that interact with patches.

    Other strains are eliminated, as link and layers carry no load along them; C and f are 0 there. The third result is
    f (4,) on a straight link.
    """
    every, of_volt = layer_loads(layout, *place_of(layout, sections, station))
    felt = felt_rows(layout)
    free = np.setdiff1d([row for row in (bending_row(layout), STRETCH, TWIST) if every[row].any()], felt)
    C, f = np.zeros((4, 4)), np.zeros(4)
    C[np.ix_(felt, felt)], f[felt] = every[np.ix_(felt, felt)], of_volt[felt]
    rigidity, straight = sections.rigidity[station, free], f.copy()
    if free.size and not np.isnan(rigidity).any():
        across = np.linalg.solve(np.diag(rigidity) + every[np.ix_(free, free)], every[np.ix_(free, felt)])
        C[np.ix_(felt, felt)] -= every[np.ix_(felt, free)] @ across
        f[felt] -= across.T @ of_volt[free]
    return C, f, straight


def _intervals(placed: Sequence[PlacedLayout]) -> tuple[Array, list[list[tuple[PztLayout, int]]]]:
    """Stretches (m, 2) of the link with the same patches on each, and which: layouts with numbers of their patches."""
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
    """R = exact − A Aᵀ by A `of_modes`, without what differences of nominal and FE stiffness make negative of it."""
    if np.isnan(exact).any():
        return np.zeros((len(exact), len(exact)))
    scale = np.sqrt(exact)[:, None]
    left, sizes, _ = np.linalg.svd(of_modes / scale, full_matrices=False)
    shapes = scale * left * sizes.clip(max=1.0)
    return np.diag(exact) - shapes @ shapes.T


def _strains(body: ModalBody, x: Array) -> Array:
    """B (m, 4, n): e of the modes at x (m,): differences inside an element, exact for its quadratics."""
    stations = body.stations.position[:, 0]
    h = np.minimum(1e-3 * body.length, 0.5 * np.abs(stations - x[:, None]).min(axis=1))
    return (potentials(body, x + h) - potentials(body, x - h)) / (2 * h)[:, None, None]


ROUND_OFF = 1e-12  # of c times the largest rotation in a mode, of a modal force per volt
STEP = 0.1  # of the extent, from one station to the next; less is a taper


class Effects(NamedTuple):
    """Effects of k patches on the n modes of a modal body."""

    # (k,) t_b, mean extent of the link along the normal under each patch, m: see `LinkSections.extent`
    extent: Array
    per_volt: Array  # (k,) c, load along the strain that each patch actuates, N·m/V
    # (k,), no unit, strain of the surface per curvature and distance: 1; of diagonals per twist: β/2, see `place_of`
    lever: Array
    # (k, n) rotation of the sections at the ends of a patch against each other, in its sense, rad/(m·√kg)
    turn: Array
    Phi_V: Array  # (k, n) modal forces per volt, N/(√kg·V), reduced by the stiffness of the layers
    # (k, K) charges, F, as sensors by voltages of the K patches of the link; open ones are clamped, but for the strains
    # that modes lack
    capacitance: Array


def effects(placed: Sequence[PlacedLayout], body: ModalBody) -> list[Effects]:
    """The effects of each layout of one link, coupled by their stiffness if it counts."""
    found = [_straight(one, body) for one in placed]
    layouts, share = _each(placed)
    opened = np.array([of.electrodes == "open" for of in layouts])
    C = np.diag([of.capacitance(clamped=of.electrodes == "open") for of in layouts] * share)
    Phi_V = np.concatenate([one.Phi_V for one in found])
    if any(of.adds_stiffness for of in layouts):
        layers = layers_on_link(placed, body)
        Phi_V -= (layers.straight - layers.by_volts).T @ layers.B
        C += np.outer(opened, opened) * layers.yielding
    loads, turns = np.concatenate([one.per_volt for one in found]), np.abs(body.stations.rotation).max(axis=(0, 1))
    Phi_V *= np.abs(Phi_V) > ROUND_OFF * np.abs(np.outer(loads, turns))
    ends = np.cumsum([len(one.edges) for one in placed])[:-1]
    parts = zip(found, np.split(Phi_V, ends), np.split(C, ends), strict=True)
    return [one._replace(Phi_V=per_volt, capacitance=c) for one, per_volt, c in parts]


def _each(placed: Sequence[PlacedLayout]) -> tuple[list[PztLayout], Array]:
    """Layouts of k patches, and the share (k,) of each that lies on the body."""
    layouts = [one.layout for one in placed for _ in one.edges]
    return layouts, np.diff(np.concatenate([one.edges for one in placed]))[:, 0] / [of.length for of in layouts]


def _straight(placed: PlacedLayout, body: ModalBody) -> Effects:
    """Effects on a straight link: loads of a volt times differences of `potentials`, stretch by stretch."""
    layout, edges = placed
    own, sections = own_row(layout), link_sections(body)
    starts, ends, stations, first = _stretches(layout, body, sections, edges)
    alike, which = np.unique(sections.alike[stations], return_inverse=True)
    places = np.array([place_of(layout, sections, station) for station in alike.tolist()])
    loads = np.array([felt_loads(layout, sections, station)[2] for station in alike.tolist()])
    before, after = np.split(potentials(body, np.concatenate([starts, ends])), 2)
    differences = after - before
    of_stretch = np.stack([places[:, 0], loads[:, own], places[:, 1]])[:, which]
    extent, c, lever = np.add.reduceat(of_stretch * (ends - starts), first, axis=1) / np.add.reduceat(
        ends - starts, first
    )
    turn = np.add.reduceat(differences[:, own], first)
    Phi_V = np.add.reduceat(np.einsum("ir,irn->in", loads[which], differences), first)
    if layout.coupling == "surface":
        membrane = c / (layout.width * extent / 2)
        if layout.strain == "biaxial":
            membrane /= 1.0 - (layout.poissons_ratio or 0.0)
        Phi_V = membrane[:, None] * _outlined(layout, body, edges)
    lever = lever / 2 if layout.bends == "twist" else np.ones(len(edges))
    return Effects(extent, c, lever, turn, Phi_V, np.zeros(0))


def _stretches(
    layout: PztLayout, body: ModalBody, sections: LinkSections, edges: Array
) -> tuple[Array, Array, Indices, Indices]:
    """Stretches of one extent below k patches: starts and ends (m,), m, stations (m,), first stretch (k,) of each."""
    x, (starts, ends) = body.stations.position[:, 0], edges.T
    slack = np.minimum(1e-9 * body.length, 0.25 * (ends - starts))
    covered = (x[1:] > (starts + slack)[:, None]) & (x[:-1] < (ends - slack)[:, None])
    if not covered.any(axis=1).all():  # round-off: it begins where it ends
        raise InputError(f"length: expected patches that can be seen on a link of {body.length:g} m", "less")
    extents = sections.extent(layout.normal, side(layout))[:-1]
    jump = np.abs(np.diff(extents)) / np.maximum(extents[1:], extents[:-1])
    jumps = np.where(covered[:, 1:] & covered[:, :-1], jump, 0.0)
    if jumps.max(initial=0.0) > STEP:
        number = int((jumps > STEP).any(axis=1).argmax())
        k = int(jumps[number].argmax())
        what = "height" if layout.normal == "y" else "width"
        raise InputError(
            "expected patches on one section each",
            f"patch {number + 1} ({starts[number]:g} to {ends[number]:g} m) across a step of the {what} from"
            f" {extents[k]:g} to {extents[k + 1]:g} m at {x[k + 1]:g} m",
        )
    last, cut = covered.copy(), covered.copy()
    last[:, :-1] &= ~covered[:, 1:]
    cut[:, :-1] &= last[:, :-1] | (jumps > 1e-9)
    patch, stations = np.nonzero(cut)
    is_last = last[patch, stations]
    found = np.where(is_last, ends[patch], x[stations + 1])
    first = np.append(0, np.flatnonzero(is_last)[:-1] + 1)
    begin = np.append(0.0, found[:-1])
    begin[first] = starts
    return begin, found, stations, first


def _outlined(layout: PztLayout, body: ModalBody, edges: Array) -> Array:
    """Modal forces (k, n) of unit membrane force, N/m, pressure on +y, tension on −y: mean of the layout's faces."""
    patches = body.surface_patches
    if patches is None:
        raise InputError(
            'coupling: expected "rotation", or a link whose file outlines the patches ([surface_patch])',
            '"surface" and none outlined',
        )
    found = (*edges.ravel(), layout.width)
    outlined = (*(body.begin + patches.edges).ravel(), patches.width)
    if len(found) != len(outlined) or not np.allclose(found, outlined, rtol=0.0, atol=1e-6 * body.length):
        raise InputError(
            f"coupling: expected the {len(patches.edges)} patches that the link file outlines, from"
            f" {_places(patches.edges)} m and {patches.width:g} m wide",
            f"{len(edges)}, from {_places(edges)} m and {layout.width:g} m wide",
        )
    outlined_on: dict[str, Array] = {}
    sides = ("+y", -1.0, patches.top, patches.top_across), ("-y", 1.0, patches.bottom, patches.bottom_across)
    for face, sign, along, across in sides:
        if along is None:
            continue
        if layout.strain == "biaxial" and across is None:
            raise InputError(
                'strain: expected "uniaxial", or a modal body file with strains across outlined patches',
                "one of an earlier version: recompute it from its link file with `ffrobot link`",
            )
        outlined_on[face] = sign * (along if layout.strain != "biaxial" or across is None else along + across)
    wanted = ["+y", "-y"] if layout.face == "both" else [layout.face] if layout.face else list(outlined_on)
    if missing := [face for face in wanted if face not in outlined_on]:
        raise InputError(
            "face: expected patches on faces that the link file outlines ([surface_patch] faces)",
            f'"{layout.face}", of which {missing[0]} has none outlined',
        )
    return np.mean([outlined_on[face] for face in wanted], axis=0)


def _places(edges: Array) -> str:
    return ", ".join(f"{start:g} to {end:g}" for start, end in edges)


PASSES = 6  # until modes and the stiffness of shunts at their frequencies agree


@struct
class StructureEffect:
    """Properties of a link, each first bare, then with patches."""

    mass: Array  # (2,) kg
    inertia: Array  # (2,) about the body's z axis, kg·m²
    frequency: Array  # (2, n) Hz


def patched_body(spatial: Body, body: ModalBody, placed: Sequence[PlacedLayout]) -> Body:
    """Add mass and stiffness of patches, by their key `structural`, to `spatial`, made of `body`; all modes stay.

    Mass lies in the plane of the patches' normal at their offset from the axis, with its moment of inertia about the
    line that it is on. The stiffness is that of the `composite` section.
    """
    T, sections = spatial.modal_transform, link_sections(body)
    points, masses, spins = [], [], []
    for layout, edges in placed:
        extent = sections.extent(layout.normal, side(layout))
        arm = layout.offset * np.eye(3)[2 if layout.normal == "y" else 1]
        for place in gauss_points(body, edges) if layout.adds_mass else ():
            at = body.interpolate(place.x)
            moved = at.translation - skew(arm) @ at.rotation
            points.append(BodyPoint(at.position + arm, moved @ T, at.rotation @ T))
            A, _, I = layer_section(layout, extent[place.station])  # noqa: E741
            line_density = place.weight * (layout.density or 0.0)
            masses.append(line_density * A)
            spins.append(line_density * (I + A * layout.width**2 / 12))
    stiff = [one for one in placed if one.layout.adds_stiffness]
    added = np.zeros((spatial.n_modes, spatial.n_modes))
    if stiff:
        layers = layers_on_link(stiff, body)
        added = T.T @ layers.B.T @ layers.by_modes @ T
    patched = with_line_masses(spatial, points, np.array(masses), np.array(spins), (added + added.T) / 2)
    return _with_charges(patched, layers, stiff) if any(one.layout.gives_way for one in stiff) else patched


def _with_charges(patched: Body, layers: LayersOnLink, placed: Sequence[PlacedLayout]) -> Body:
    """The body with the effect of the charges of patches with open electrodes, or a resistor of R Ω each.

    With the charge q = C V + Φᵀp and V = −R q̇ a patch has the dynamic stiffness Φ iωR/(1 + iωRC) Φᵀ (Hagood and von
    Flotow, J. Sound Vib. 146, 1991), ΦΦᵀ/C where R is infinite. Its stiffness and damping are those at the frequency
    of each mode that they lead to.
    """
    layouts, share = _each(placed)
    charged = np.flatnonzero([of.gives_way for of in layouts])
    C = np.diag([of.capacitance(clamped=True) for of in layouts] * share) + layers.yielding
    turn = np.linalg.inv(np.linalg.cholesky(C[np.ix_(charged, charged)]))
    conductance = share[charged] / [layouts[k].shunt or np.inf for k in charged]
    rates, independent = np.linalg.eigh(turn * conductance @ turn.T)
    Phi = independent.T @ turn @ (layers.by_volts.T @ layers.B @ patched.modal_transform)[charged]
    K, modes = np.diag(patched.stiffness), np.eye(patched.n_modes)
    values, added = patched.stiffness, np.zeros_like(K)
    for _ in range(PASSES):
        omega = np.sqrt(values.clip(min=SMALLEST))
        lag = rates[:, None].clip(min=0.0) / omega  # 1/(ωRC)
        stiff = Phi @ modes / np.sqrt(1.0 + lag**2) @ modes.T
        damps = Phi @ modes * np.sqrt(lag / (omega * (1.0 + lag**2))) @ modes.T
        added = stiff.T @ stiff
        values, modes = np.linalg.eigh(K + added)
    with_damping = replace(patched, damping=patched.damping + damps.T @ damps)
    return with_line_masses(with_damping, (), np.zeros(0), np.zeros(0), added)


def structure_effect_of(bare: Body, patched: Body) -> StructureEffect:
    """Mass, moment of inertia and frequencies of a link without and with patches."""
    pair = (bare, patched)
    return StructureEffect(
        np.array([body.mass for body in pair]),
        np.array([body.inertia[2, 2] for body in pair]),
        np.array([np.sqrt(body.stiffness) / (2 * np.pi) for body in pair]),
    )
