"""Patches of a link in space: several layouts side by side, their reach, and voltages that they find together.

The modes to be served are the eigenmodes of the families that some patch reaches: in-plane bending by patches on ±y,
out-of-plane bending by those on ±z, torsion by fibres at an angle, the axial family by one named face. Of the others
the modal forces are left as they are, and told as what voltages leave unmet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Indices, Integers
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ...mbs.model.spatial_body import SpatialBody
from .composite import Placed
from .effects import Effects, effects
from .patches import PatchArray, assembled, check_edges, patch_edges
from .reach import Reach, check_all_served, served_first, weights
from .sections import check_sections
from .spatial_records import SpatialPztLayout
from .voltages import Voltages, solve_voltages

OUT_OF_REACH = 1e-9  # of the largest modal force per volt: less is rounding


@dataclass(frozen=True)
class LinkPatches:
    """All patches of one link in space, k in all, on the n modes of its equations.

    Attributes:
        arrays: by layout, each over the modes in its own `orders`: those that it is to serve first.
        orders: (n,) by layout, numbers (from 0) of modes.
        reach: of all patches side by side, over the modes in `order`.
        order: (n,) likewise.
    """

    arrays: Mapping[str, PatchArray]
    orders: Mapping[str, Indices]
    reach: Reach
    order: Indices

    @property
    def unserved(self) -> Indices:
        """Numbers (from 0) of the modes that no patch is to serve, or can."""
        return np.sort(self.order[self.reach.served :])

    def voltages(self, F_p: Array) -> dict[str, Voltages]:
        """By layout, of modal forces F_p (T, n) on the modes of the equations; `unmet` is what all layouts leave."""
        found = solve_voltages(self.reach, F_p[:, self.order])
        unmet = np.empty_like(F_p)
        unmet[:, self.order] = found.unmet
        ends = np.cumsum([len(array.edges) for array in self.arrays.values()])
        required, within = (np.split(x, ends[:-1], axis=1) for x in (found.required, found.within_limit))
        return {
            name: Voltages(one, other, unmet[:, self.orders[name]], self.arrays[name].served)
            for name, one, other in zip(self.arrays, required, within, strict=True)
        }


def link_patches(path: Path, layouts: Sequence[SpatialPztLayout], body: ModalBody, spatial: SpatialBody) -> LinkPatches:
    """Place the layouts of one link. Raises `InputError` for patches that do not fit it, or weights that do not."""
    placed = [_placed(path, layout, body) for layout in layouts]
    label = layouts[0].label if len(layouts) == 1 else layouts[0].body
    found = effects(_key(path, label), placed, body)
    T = spatial.modal_transform
    arrays, orders = {}, {}
    for one, of in zip(placed, found, strict=True):
        layout = one.layout
        orders[layout.label], served = _order((of.Phi_V @ T).T, body.family, body.residual)
        arrays[layout.label] = _array(path, one, body, spatial, of, orders[layout.label], served)
    return LinkPatches(arrays, orders, *_together(path, layouts, arrays, found, body, spatial))


def _placed(path: Path, layout: SpatialPztLayout, body: ModalBody) -> Placed:
    key, edges = _key(path, layout.label), patch_edges(layout, body.length)
    check_sections(key, body, layout.normal, twists=layout.fibre_angle is not None)
    check_edges(key, edges, body.length)
    return Placed(layout, edges)


def _array(
    path: Path, placed: Placed, body: ModalBody, spatial: SpatialBody, of: Effects, order: Indices, served: int
) -> PatchArray:
    """One layout on the modes in its own order."""
    key, stiffness = _key(path, placed.layout.label), spatial.stiffness[order]
    points = {name: at.translation[:, order] for name, at in spatial.points.items()}
    W_sqrt = weights(key, placed.layout, served, stiffness, points)
    return assembled(placed, body, of, spatial.modal_transform[:, order], stiffness, W_sqrt, served)


def _together(
    path: Path,
    layouts: Sequence[SpatialPztLayout],
    arrays: Mapping[str, PatchArray],
    found: Sequence[Effects],
    body: ModalBody,
    spatial: SpatialBody,
) -> tuple[Reach, Indices]:
    """All patches side by side; what counts of modal forces left is told by the weights of a layout that is alone."""
    Phi_V = np.concatenate([(of.Phi_V @ spatial.modal_transform).T for of in found], axis=1)
    order, served = _order(Phi_V, body.family, body.residual)
    if len(layouts) == 1:
        array = arrays[layouts[0].label]
        reach = Reach(**{key: getattr(array, key) for key in ("Phi_V", "limit", "W_sqrt", "frequency", "served")})
    else:
        for layout in layouts:
            if layout.mode_weights is not None or layout.point_weights is not None:
                found_on = f'beside other layouts on "{layout.body}"'
                raise InputError(f"{_key(path, layout.label)}: expected no weights {found_on}, found them")
        limit = np.concatenate([array.limit for array in arrays.values()])
        W_sqrt = served_first(served, *Phi_V.shape)
        frequency = np.sqrt(spatial.stiffness[order]) / (2 * np.pi)
        reach = Reach(Phi_V=Phi_V[order], limit=limit, W_sqrt=W_sqrt, frequency=frequency, served=served)
    if all(layout.allocation == "exact" for layout in layouts):
        check_all_served(_key(path, layouts[0].label if len(layouts) == 1 else layouts[0].body), reach)
    return reach, order


def _order(Phi_V: Array, family: Sequence[str], residual: Integers) -> tuple[Indices, int]:
    """Eigenmodes of reached families first, then their attachment modes, then the rest; how many are first."""
    size = np.abs(Phi_V).max(axis=1)
    reached = {family[k] for k in np.flatnonzero(size > OUT_OF_REACH * size.max())}
    known = zip(family, residual, strict=True)
    rank = np.array([int(static) if name in reached else 2 for name, static in known])
    return np.argsort(rank, kind="stable"), int(np.count_nonzero(rank == 0))


def by_body(layouts: Sequence[SpatialPztLayout]) -> Iterator[tuple[str, list[SpatialPztLayout]]]:
    """Bodies with patches, in the order of their first layouts."""
    for body in dict.fromkeys(layout.body for layout in layouts):
        yield body, [layout for layout in layouts if layout.body == body]


def with_count(
    path: Path, layout: SpatialPztLayout, body: ModalBody, spatial: SpatialBody, count: int
) -> PatchArray | None:
    """As many of the same patches, evenly spread over the link, alone, with one limit; None where they have no room."""
    if count * layout.length > body.length * (1 + 1e-9):
        return None
    limit = min(layout.limit) if isinstance(layout.limit, tuple) else layout.limit
    changed = {"count": count, "centers": None, "limit": limit, "allocation": "least-squares"}
    try:
        found = link_patches(path, [layout.model_copy(update=changed)], body, spatial)
    except InputError:  # across a step of the section, or weights for another number
        return None
    return found.arrays[layout.label]


def _key(path: Path, label: str) -> str:
    return f'{path}: pzt "{label}"'
