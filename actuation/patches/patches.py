"""Piezoelectric patches on a link: what a volt does to its modal coordinates (Shabana 2022, Eqs. 14–17)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from .composite import SLIVER, Placed, stiffness_ratios
from .effects import Effects
from .reach import Reach
from .records import PztLayout


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
    """

    layout: PztLayout
    edges: Array
    height: Array
    moment_per_volt: Array
    turn: Array
    link: ModalBody
    lever: Array

    @property
    def body(self) -> str:
        """Name of the link."""
        return self.layout.body

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


def edges_on_piece(layout: PztLayout, edges: Array, start: float, length: float) -> tuple[Indices, Array]:
    """Numbers (from 0) of the patches between `edges` (k, 2) that are on a piece, and where on it they are, m.

    The piece is `length` (m) long and begins at `start` (m) from the root of the link.
    """
    clipped = (edges - start).clip(0.0, length)
    which = np.flatnonzero(np.diff(clipped, axis=1)[:, 0] > SLIVER * layout.length)
    return which, clipped[which]


def patch_edges(layout: PztLayout, length: float) -> Array:
    """(k, 2) where the patches of `layout` begin and end on a link of that length, m."""
    if layout.centers is not None:
        centers = np.array(layout.centers)
    else:
        centers = (np.arange(layout.patch_count) + 0.5) * length / layout.patch_count
    edges: Array = centers[:, None] + np.array([-0.5, 0.5]) * layout.length
    return edges


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
