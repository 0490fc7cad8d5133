"""Piezoelectric patches on a link: what a volt does to its modal coordinates (Shabana 2022, Eqs. 14–17)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ...mbs.model.divided_link import DividedLink, Piece
from ...mbs.model.planar_body import PlanarBody
from .composite import SLIVER, Placed, stiffness_ratios
from .effects import Effects, effects
from .reach import Reach, check_all_served, weights
from .records import PatchKeys


@dataclass(frozen=True)
class PatchArray(Reach):
    """The patches of one layout.

    Attributes:
        layout: the keys of the scene.
        edges: (k, 2) where each patch begins and ends along the link, m.
        height: (k,) t_b, of the link along their normal under each patch, its mean, m.
        moment_per_volt: (k,) c in N·m/V.
        turn: (n, k) φ'(x2) − φ'(x1) of the n modes of the body, rad per unit of modal coordinate; of twist φ_x.
        link: the modal body of the link that they are on.
        lever: (k,) strain of the surface by unit turn per length and distance: 1 of bending.
        of_all_modes: where the `PlanarBody` has not all modes, but the patches reach all: the same patches
            on all modes, and (n_all, n) the modal forces on these from those on the `PlanarBody`. Of a link in pieces:
            the patches on the link, and its modal forces from those on the pieces.
        pieces: names of the pieces of a link in pieces, whose modes, side by side, are the n modes; else empty.
    """

    layout: PatchKeys
    edges: Array
    height: Array
    moment_per_volt: Array
    turn: Array
    link: ModalBody
    lever: Array
    pieces: tuple[str, ...] = ()

    @property
    def body(self) -> str:
        """Name of the link."""
        return self.layout.body

    @property
    def carriers(self) -> tuple[str, ...]:
        """The bodies of the model whose modes, side by side, the n modes are."""
        return self.pieces or (self.body,)

    @cached_property
    def _stiffness(self) -> tuple[Array, Array]:
        return stiffness_ratios(Placed(self.layout, self.edges), self.link)

    @property
    def stiffness_ratio(self) -> Array:
        """(k,) ψ of link to patch: see `composite.stiffness_ratios`."""
        return self._stiffness[0]

    @property
    def authority(self) -> Array:
        """(k,) the part of c V that bends the link, whose own stiffness takes the rest: see there."""
        return self._stiffness[1]

    @property
    def stiffness_in_words(self) -> str:
        """ψ and the authority, and whether the link feels the stiffness of its patches."""
        if not np.isfinite(self.authority).all():
            return f"{self.layout.label}: stiffness ratio ψ not known: the modal body has no rigidities"
        psi, authority = (_span(values) for values in (self.stiffness_ratio, self.authority))
        felt = "included in the model" if self.layout.adds_stiffness else "not included (structural = false)"
        what = "twist" if self.layout.acts_in == "twist" else "curvature"
        left = f"patch stiffness reduces the induced {what} to {authority} of its value, {felt}"
        return f"{self.layout.label}: stiffness ratio ψ {psi}: {left}"

    @property
    def surface_distance(self) -> Array:
        """(k,) from the link's axis to the outer surface of each patch, m."""
        return self.height / 2 + self.layout.layers * self.layout.thickness


def _span(values: Array) -> str:
    """One number, or from the smallest to the largest."""
    return " … ".join(dict.fromkeys(f"{value:.3g}" for value in (values.min(), values.max())))


def patch_array(scene_path: Path, layout: PatchKeys, body: ModalBody, planar: PlanarBody) -> PatchArray:
    """Place the patches of `layout` on a link.

    A patch works on the difference of the section rotations at its ends, piecewise where t_b changes gradually; on one
    named face also on its elongation, since it pulls there; with `coupling = "surface"`, on the strain of the faces on
    which it is outlined in the mesh. Where the layout adds stiffness, the link has it too (`structure.with_patches`).
    Raises `InputError` for patches beyond the link, on each other or across a step of
    its section, for outlines that are not those of the layout, and for weights that do not fit.
    """
    key = f'{scene_path}: pzt "{layout.body}"'
    edges = patch_edges(layout, body.length)
    check_edges(key, edges, body.length)
    if planar.reduction is not None:
        whole = patch_array(scene_path, layout, body, planar.reduction.whole)
        return _on_fewer_modes(whole, planar)
    placed = Placed(layout, edges)
    (found,) = effects(key, [placed], body)
    points = {name: at.translation for name, at in planar.points.items()}
    W_sqrt = weights(key, layout, planar.n_eigenmodes, planar.stiffness, points)
    return assembled(placed, body, found, planar.modal_transform, planar.stiffness, W_sqrt, planar.n_eigenmodes)


def assembled(
    placed: Placed, body: ModalBody, of: Effects, T: Array, stiffness: Array, W_sqrt: Array, served: int
) -> PatchArray:
    """The patches in modal coordinates p, of which T (n_file, n) makes those of the modal body; `stiffness` (n,)."""
    layout, edges = placed
    return PatchArray(
        layout, edges, of.extent, of.per_volt, (of.turn @ T).T, body, of.lever,
        Phi_V=(of.Phi_V @ T).T, limit=np.full(len(edges), np.inf if layout.limit is None else layout.limit),
        W_sqrt=W_sqrt, frequency=np.sqrt(stiffness) / (2 * np.pi), served=served,
    )  # fmt: skip


def on_pieces(scene_path: Path, whole: PatchArray, link: DividedLink, pieces: Sequence[Piece]) -> PatchArray:
    """The patches of `whole`, those of a link, on its `pieces`: a patch across a cut acts on both sides of it.

    Voltages are those that serve the modes of the link.
    """
    key = f'{scene_path}: pzt "{whole.body}"'
    turn, Phi_V = np.zeros((2, len(link.spread), len(whole.edges)))
    first = 0
    for piece in pieces:
        rows = slice(first, first + piece.planar.n_modes)
        which, edges = edges_on_piece(whole.layout, whole.edges, piece.start, piece.modal.length)
        if which.size:
            (found,), T = effects(key, [Placed(whole.layout, edges)], piece.modal), piece.planar.modal_transform
            turn[rows, which], Phi_V[rows, which] = (found.turn @ T).T, (found.Phi_V @ T).T
        first = rows.stop
    return replace(
        whole,
        turn=turn,
        Phi_V=Phi_V,
        W_sqrt=whole.W_sqrt @ link.spread.T,
        of_all_modes=(whole, link.spread.T),
        pieces=link.bodies,
    )


def edges_on_piece(layout: PatchKeys, edges: Array, start: float, length: float) -> tuple[Indices, Array]:
    """Numbers (from 0) of the patches between `edges` (k, 2) that are on a piece, and where on it they are, m.

    The piece is `length` (m) long and begins at `start` (m) from the root of the link.
    """
    clipped = (edges - start).clip(0.0, length)
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


def patch_edges(layout: PatchKeys, length: float) -> Array:
    """(k, 2) where the patches of `layout` begin and end on a link of that length, m."""
    if layout.centers is not None:
        centers = np.array(layout.centers)
    else:
        centers = (np.arange(layout.patch_count) + 0.5) * length / layout.patch_count
    edges: Array = centers[:, None] + np.array([-0.5, 0.5]) * layout.length
    return edges


def with_patch_count(
    scene_path: Path, layout: PatchKeys, body: ModalBody, planar: PlanarBody, count: int
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
    if patches.layout.allocation == "exact":
        check_all_served(f'{scene_path}: pzt "{patches.body}"', patches)


def check_edges(key: str, edges: Array, length: float) -> None:
    """Raise `InputError` for patches (k, 2) beyond a link of that length, m, or on each other."""
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
                f"{key}: expected patches side by side, found patch {first} ({a:g} to {b:g} m) and patch {second}"
                f" ({c:g} to {d:g} m) on the same place"
            )
