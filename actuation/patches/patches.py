"""Piezoelectric patches on a link: what a volt does to its modal coordinates (Shaban 2022, Eqs. 14–17)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ...mbs.model.divided_link import DividedLink, Piece
from ...mbs.model.planar_body import PlanarBody
from .composite import SLIVER, composite, stiffness_ratios
from .layers import moment_per_volt, pull_per_volt
from .records import PztLayout

STEP = 0.1  # of the height, from one station to the next; less is a taper
SINGULAR = 1e12  # condition number of Φ_V beyond which voltages are rounding
MOST_CONDITION = 1e16  # what more is found of a condition number is rounding itself
LEAST_WEIGHT = 1e-6  # of any mode, relative to the largest: without it voltages would be neither unique nor steady
OF_STATIC_SHAPES = 1e-3  # root of the weight of attachment modes beside modes: more patches than modes serve them last
ENERGY_WEIGHT = 1e-4  # of the strain energy rᵀ K⁻¹ r beside weights of points, for the same reason


@dataclass(frozen=True)
class PatchArray:
    """The patches of one body.

    Attributes:
        layout: the keys of the scene.
        edges: (k, 2) where each patch begins and ends along the link, m.
        height: (k,) t_b, of the link in the plane under each patch, its mean, m.
        moment_per_volt: (k,) c in N·m/V.
        turn: (n, k) φ'(x2) − φ'(x1) of the modes of the `PlanarBody`, rad per unit of modal coordinate.
        Phi_V: (n, k) modal forces per volt, in the same coordinates: c times `turn`, and more on one named face.
        limit: (k,) largest voltages, V; infinite where the scene gives none.
        W_sqrt: (rows, n) what of the modal forces left unmet counts: |W_sqrt r|² is made small.
        frequency: (n,) of the modes, Hz.
        served: number of modes, the first ones, that the patches are to serve: attachment modes are not among them.
        stiffness_ratio: (k,) ψ of link to patch, and `authority`, the part of c V that bends the link: see
            `composite.stiffness_ratios`.
        of_all_modes: where the `PlanarBody` has not all modes, but the patches reach all: the same patches
            on all modes, and (n_all, n) the modal forces on these from those on the `PlanarBody`. Of a link in pieces:
            the patches on the link, and its modal forces from those on the pieces.
        pieces: names of the pieces of a link in pieces, whose modes, side by side, are the n modes; else empty.
    """

    layout: PztLayout
    edges: Array
    height: Array
    moment_per_volt: Array
    turn: Array
    Phi_V: Array
    limit: Array
    W_sqrt: Array
    frequency: Array
    served: int
    stiffness_ratio: Array
    authority: Array
    of_all_modes: tuple[PatchArray, Array] | None = None
    pieces: tuple[str, ...] = ()

    @property
    def body(self) -> str:
        """Name of the link."""
        return self.layout.body

    @property
    def carriers(self) -> tuple[str, ...]:
        """The bodies of the model whose modes, side by side, the n modes are."""
        return self.pieces or (self.body,)

    @property
    def condition_number(self) -> float:
        """Of Φ_V: how unequally the patches reach the modes; infinite where some mode is out of reach."""
        return float(np.linalg.cond(self.Phi_V[: self.served]))

    @property
    def unreached_modes(self) -> Indices:
        """Numbers (from 0) of the modes that take part in what no voltages can produce."""
        left, sizes, _ = np.linalg.svd(self.Phi_V[: self.served])
        rank = int(np.count_nonzero(sizes > sizes[0] / SINGULAR))
        return np.flatnonzero(np.abs(left[:, rank:]).max(axis=1, initial=0.0) > 0.1)

    @property
    def in_order(self) -> Array:
        """(rows, n) roots of weights: modes first, and attachment modes with what more patches than modes are left."""
        n, k = self.Phi_V.shape
        return served_first(self.served, n, k)

    @property
    def stiffness_in_words(self) -> str:
        """ψ and the authority, and whether the link feels the stiffness of its patches."""
        if not np.isfinite(self.authority).all():
            return f"{self.body}: stiffness ratio ψ not known: the modal body has no rigidities"
        psi, authority = (_span(values) for values in (self.stiffness_ratio, self.authority))
        felt = "which counts" if self.layout.adds_stiffness else "left out: structural = false"
        return f"{self.body}: stiffness ratio ψ {psi}: their own stiffness leaves {authority} of the curvature, {felt}"

    @property
    def surface_distance(self) -> Array:
        """(k,) from the link's axis to the outer surface of each patch, m."""
        return self.height / 2 + self.layout.layers * self.layout.thickness


def served_first(served: int, n: int, patches: int) -> Array:
    """(rows, n) roots of weights of the `served` first of n modes; more patches than these serve the others, too."""
    rows = n if patches > served else served
    return np.diag(np.where(np.arange(n) < served, 1.0, OF_STATIC_SHAPES))[:rows]


def _span(values: Array) -> str:
    """One number, or from the smallest to the largest."""
    return " … ".join(dict.fromkeys(f"{value:.3g}" for value in (values.min(), values.max())))


def patch_array(scene_path: Path, layout: PztLayout, body: ModalBody, planar: PlanarBody) -> PatchArray:
    """Place the patches of `layout` on a link.

    A patch works on the difference of the section rotations at its ends, piecewise where t_b changes gradually; on one
    named face also on its elongation, since it pulls there; with `coupling = "surface"`, on the strain of the faces on
    which it is outlined in the mesh. Where the layout adds stiffness, the link has it too (`structure.with_patches`).
    Raises `InputError` for patches beyond the link, on each other or across a step of
    its section, for outlines that are not those of the layout, and for weights that do not fit.
    """
    key = f'{scene_path}: pzt "{layout.body}"'
    edges = patch_edges(layout, body.length)
    _check_edges(key, edges, body.length)
    if planar.reduction is not None:
        whole = patch_array(scene_path, layout, body, planar.reduction.whole)
        return _on_fewer_modes(whole, planar)
    height, c, turn, Phi_V = _effects(key, layout, body, planar, edges)
    limit = np.full(len(edges), np.inf if layout.limit is None else layout.limit)
    weights, frequency = _weights(key, layout, planar), np.sqrt(planar.stiffness) / (2 * np.pi)
    return PatchArray(
        layout, edges, height, c, turn, Phi_V, limit, weights, frequency, planar.n_eigenmodes,
        *stiffness_ratios(layout, body, edges),
    )  # fmt: skip


def _effects(
    key: str, layout: PztLayout, body: ModalBody, planar: PlanarBody, edges: Array
) -> tuple[Array, Array, Array, Array]:
    """Height (k,), moment per volt (k,), `turn` (n, k) and `Phi_V` (n, k) of the patches between `edges` (k, 2)."""
    pieces = [_pieces(key, body, k, start, end) for k, (start, end) in enumerate(edges, 1)]
    height = np.array([np.average(heights, weights=np.diff(x)) for x, heights in pieces])
    moments = [moment_per_volt(layout, heights) for _, heights in pieces]
    c = np.array([np.average(moment, weights=np.diff(x)) for (x, _), moment in zip(pieces, moments, strict=True)])
    turns = [np.diff([body.interpolate(end).rotation[2] for end in x], axis=0) for x, _ in pieces]
    if layout.coupling == "surface":
        per_volt = (c / (layout.width * height / 2))[:, None] * _outlined(key, layout, body, edges)
    else:
        per_volt = np.array([moment @ turn for moment, turn in zip(moments, turns, strict=True)])
        per_volt += _pull(layout, body, edges)
    if layout.adds_stiffness:
        per_volt -= composite(layout, body, edges).shortfall
    T = planar.modal_transform
    return height, c, (np.array([turn.sum(axis=0) for turn in turns]) @ T).T, (per_volt @ T).T


def on_pieces(scene_path: Path, whole: PatchArray, link: DividedLink, pieces: Sequence[Piece]) -> PatchArray:
    """The patches of `whole`, those of a link, on its `pieces`: a patch across a cut acts on both sides of it.

    Voltages are those that serve the modes of the link.
    """
    key = f'{scene_path}: pzt "{whole.body}"'
    turn, Phi_V = np.zeros((2, len(link.spread), len(whole.edges)))
    first = 0
    for piece in pieces:
        rows = slice(first, first + piece.planar.n_modes)
        which, edges = edges_on_piece(whole.layout, whole.edges, piece)
        if which.size:
            _, _, turn[rows, which], Phi_V[rows, which] = _effects(key, whole.layout, piece.modal, piece.planar, edges)
        first = rows.stop
    return replace(
        whole,
        turn=turn,
        Phi_V=Phi_V,
        W_sqrt=whole.W_sqrt @ link.spread.T,
        of_all_modes=(whole, link.spread.T),
        pieces=link.bodies,
    )


def edges_on_piece(layout: PztLayout, edges: Array, piece: Piece) -> tuple[Indices, Array]:
    """Numbers (from 0) of the patches between `edges` (k, 2) that are on a piece, and where on it they are, m."""
    clipped = (edges - piece.start).clip(0.0, piece.modal.length)
    which = np.flatnonzero(np.diff(clipped, axis=1)[:, 0] > SLIVER * layout.length)
    return which, clipped[which]


def with_factors(patches: PatchArray, factors: Array) -> PatchArray:
    """The patches on a body in coordinates p' = factors · p, factors (n,): see `mbs.model.raised_mass`."""
    if np.all(factors == 1.0):
        return patches
    of_all = patches.of_all_modes
    return replace(
        patches,
        turn=patches.turn / factors[:, None],
        Phi_V=patches.Phi_V / factors[:, None],
        W_sqrt=patches.W_sqrt * factors,
        of_all_modes=None if of_all is None else (of_all[0], of_all[1] * factors),
    )


def _on_fewer_modes(whole: PatchArray, planar: PlanarBody) -> PatchArray:
    """The patches of `whole` on a body of which fewer modes are kept.

    Where they are enough for all its modes, voltages serve all: modal forces on those left out follow from the loads on
    the link. Otherwise they serve the modes kept, and may bend the others.
    """
    reduction = planar.reduction
    assert reduction is not None
    T, lift = reduction.T, reduction.lift
    reaches_all = whole.Phi_V.shape[1] >= whole.served and not whole.unreached_modes.size
    return replace(
        whole,
        turn=T.T @ whole.turn,
        Phi_V=T.T @ whole.Phi_V,
        W_sqrt=whole.W_sqrt @ lift,
        frequency=np.sqrt(planar.stiffness) / (2 * np.pi),
        served=planar.n_eigenmodes,
        of_all_modes=(whole, lift) if reaches_all else None,
    )


def _pull(layout: PztLayout, body: ModalBody, edges: Array) -> Array:
    """(k, n) modal forces per volt along the link, of patches on one named face."""
    force = pull_per_volt(layout)
    if not force:
        return np.zeros((len(edges), body.mode_count))
    ends = [[body.interpolate(x).translation[0] for x in pair] for pair in edges.clip(0.0, body.length)]
    stretch: Array = np.diff(ends, axis=1)[:, 0]
    return force * stretch


def patch_edges(layout: PztLayout, length: float) -> Array:
    """(k, 2) where the patches of `layout` begin and end on a link of that length, m."""
    if layout.centers is not None:
        centers = np.array(layout.centers)
    else:
        centers = (np.arange(layout.patch_count) + 0.5) * length / layout.patch_count
    edges: Array = centers[:, None] + np.array([-0.5, 0.5]) * layout.length
    return edges


def with_patch_count(
    scene_path: Path, layout: PztLayout, body: ModalBody, planar: PlanarBody, count: int
) -> PatchArray | None:
    """As many of the same patches, evenly spread over the link, with one limit; None where they have no room."""
    if count * layout.length > body.length * (1 + 1e-9):
        return None
    limit = min(layout.limit) if isinstance(layout.limit, tuple) else layout.limit
    spread = layout.model_copy(update={"count": count, "centers": None, "limit": limit})
    try:
        return patch_array(scene_path, spread, body, planar)
    except InputError:  # across a step of the section
        return None


def check_reach(scene_path: Path, patches: PatchArray) -> None:
    """Raise `InputError` unless the patches reach every mode, or the scene is content with less."""
    if patches.layout.allocation == "least-squares":
        return
    key = f'{scene_path}: pzt "{patches.body}"'
    advice = 'or be content with the best they can do: allocation = "least-squares"'
    n, k = patches.served, len(patches.edges)
    if k < n:
        raise InputError(f"{key}: expected as many patches as modes ({n}) or more, found {k}: add patches, {advice}")
    unreached = patches.unreached_modes
    if unreached.size:
        modes = ", ".join(f"{j + 1} ({patches.frequency[j]:.4g} Hz)" for j in unreached)
        raise InputError(
            f"{key}: expected patches that reach every mode, found a singular Φ_V (condition number"
            f" {min(patches.condition_number, MOST_CONDITION):.1g}): no voltages serve mode {modes};"
            f" move patches, {advice}"
        )


def _check_edges(key: str, edges: Array, length: float) -> None:
    slack = 1e-9 * length
    for k, (start, end) in enumerate(edges, 1):
        if start < -slack or end > length + slack:
            raise InputError(
                f"{key}: expected patches within the link, 0 … {length:g} m, found patch {k} from {start:g} to"
                f" {end:g} m"
            )
    for k, following in pairwise(np.argsort(edges[:, 0])):
        if edges[following, 0] < edges[k, 1] - slack:
            first, second = sorted((k + 1, following + 1))
            (a, b), (c, d) = edges[first - 1], edges[second - 1]
            raise InputError(
                f"{key}: expected patches beside each other, found patch {first} ({a:g} to {b:g} m) and patch {second}"
                f" ({c:g} to {d:g} m) on the same place"
            )


def _weights(key: str, layout: PztLayout, planar: PlanarBody) -> Array:
    """W_sqrt: of modes, or of the deflections Φ(x) K⁻¹ r that modal forces r cause at points."""
    n = planar.n_eigenmodes
    order = served_first(n, planar.n_modes, layout.patch_count)
    if layout.mode_weights is not None:
        if len(layout.mode_weights) != n:
            raise InputError(
                f"{key}: mode_weights: expected {n} weights, one for each mode that moves in the plane, found"
                f" {len(layout.mode_weights)}"
            )
        weights = np.array(layout.mode_weights) / max(layout.mode_weights)
        root = np.ones(len(order))
        root[:n] = np.sqrt(weights.clip(min=LEAST_WEIGHT))
        return root[:, None] * order
    if layout.point_weights is None:
        return order
    unknown = layout.point_weights.keys() - planar.points.keys()
    if unknown:
        raise InputError(
            f"{key}: point_weights: expected points of the link, {', '.join(planar.points)}, found"
            f" {', '.join(sorted(unknown))}"
        )
    rows = np.vstack(
        [
            np.sqrt(weight) * planar.points[name].translation / planar.stiffness
            for name, weight in layout.point_weights.items()
        ]
    )
    size = np.linalg.norm(rows, 2)
    if not size > 0.0:
        raise InputError(f"{key}: point_weights: expected points that move with the modes, found none that do")
    softest = np.sqrt(planar.stiffness.min() / planar.stiffness)
    return np.vstack([rows / size, np.sqrt(ENERGY_WEIGHT) * np.diag(softest)])


def _pieces(key: str, body: ModalBody, number: int, start: float, end: float) -> tuple[Array, Array]:
    """The stretches (m + 1,) into which a change of the link's height along y cuts a patch, and the heights (m,)."""
    x = body.stations.position[:, 0]
    slack = min(1e-9 * body.length, 0.25 * (end - start))
    covered = np.flatnonzero((x[1:] > start + slack) & (x[:-1] < end - slack))
    if not len(covered):  # rounding: it begins where it ends
        raise InputError(f"{key}: length: expected patches that can be seen on a link of {body.length:g} m, found less")
    heights = body.stations.height[covered]
    jump = np.abs(np.diff(heights)) / np.maximum(heights[1:], heights[:-1])
    if jump.max(initial=0.0) > STEP:
        k = int(jump.argmax())
        raise InputError(
            f"{key}: expected patches on one section each, found patch {number} ({start:g} to {end:g} m) across a step"
            f" of the height from {heights[k]:g} to {heights[k + 1]:g} m at {x[covered[k + 1]]:g} m"
        )
    changes = np.flatnonzero(jump > 1e-9)
    ends = np.concatenate([[max(start, 0.0)], x[covered[changes + 1]], [min(end, body.length)]])
    return ends, heights[np.append(changes, len(heights) - 1)]


def _outlined(key: str, layout: PztLayout, body: ModalBody, edges: Array) -> Array:
    """(k, n) modal forces of unit membrane force (N/m): pressing the upper face, pulling the lower, halved on both."""
    patches = body.surface_patches
    if patches is None:
        raise InputError(
            f'{key}: coupling: expected "rotation", or a link whose file outlines the patches ([surface_patch]), found'
            ' "surface" and none outlined'
        )
    found = (*edges.ravel(), layout.width)
    outlined = (*patches.edges.ravel(), patches.width)
    if len(found) != len(outlined) or not np.allclose(found, outlined, rtol=0.0, atol=1e-6 * body.length):
        raise InputError(
            f"{key}: coupling: expected the {len(patches.edges)} patches that the link file outlines, from"
            f" {_places(patches.edges)} m and {patches.width:g} m wide, found {len(edges)}, from {_places(edges)} m and"
            f" {layout.width:g} m wide"
        )
    faces = [sign * face for sign, face in ((-1.0, patches.top), (1.0, patches.bottom)) if face is not None]
    return np.asarray(sum(faces) / len(faces))


def _places(edges: Array) -> str:
    return ", ".join(f"{start:g} to {end:g}" for start, end in edges)
