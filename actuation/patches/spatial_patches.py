"""Patches of a link in space: several layouts side by side, their reach, and voltages that they find together.

The modes to be served are those of the link that moves in the families which some patch reaches, and in no other:
in-plane bending by patches on ±y, out-of-plane bending by those on ±z, torsion by fibres at an angle, the axial family
by one named face. Modal forces on the other families are left as they are, and told as what voltages leave unmet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Indices, as_floats
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ...mbs import _core
from ...mbs.model.spatial_body import SpatialBody
from ...mbs.model.spatial_masses import uncoupling
from .composite import Placed
from .effects import Effects, effects
from .patches import PatchArray, assembled, check_edges, patch_edges
from .reach import Reach, check_all_served, served_first, weights
from .sections import check_sections
from .spatial_records import SpatialPztLayout
from .voltages import Voltages, allocation, solve_voltages

OUT_OF_REACH = 1e-9  # of the largest modal force per volt: less is rounding


@dataclass(frozen=True)
class ReachedModes:
    """The modes of a link that moves in some of its families alone, with what it carries.

    Attributes:
        rows: (m,) numbers (from 0) of the modes of the modal body in these families.
        T: (m, m) p of these rows from the coordinates p' in which m_ff is the identity and K_ff diagonal.
        stiffness: (m,) of the p'.
        served: number of them, the first ones: the others are attachment modes.
    """

    rows: Indices
    T: Array
    stiffness: Array
    served: int

    def forces(self, F_p: Array) -> Array:
        """(T, m) on the p' from those on the modes of the modal body (T, n)."""
        on_modes: Array = F_p[:, self.rows] @ self.T
        return on_modes

    def coordinates(self, p: Array) -> Array:
        """(T, m) p' from those of the modal body (T, n)."""
        return as_floats(np.linalg.solve(self.T, p[:, self.rows].T).T)

    def seen(self, rows: Array) -> Array:
        """(k, m) what is linear in the modes of the modal body, (k, n), over p'."""
        return self.forces(rows)


@dataclass(frozen=True)
class LinkPatches:
    """All patches of one link in space, k in all, on the n modes of its modal body.

    Attributes:
        arrays: by layout, each on the modes that it reaches, `modes`.
        modes: by layout.
        reach: of all patches side by side on the modes that they reach together, `reached`.
        reached: likewise.
        Phi_V: (n, k) modal forces per volt on the modes of the modal body.
    """

    arrays: Mapping[str, PatchArray]
    modes: Mapping[str, ReachedModes]
    reach: Reach
    reached: ReachedModes
    Phi_V: Array

    def voltages(self, F_p: Array) -> dict[str, Voltages]:
        """By layout, of modal forces F_p (T, n); `unmet` is what all layouts leave of those that this one reaches."""
        found = solve_voltages(self.reach, self.reached.forces(F_p))
        unmet = self.unmet(F_p, found.within_limit)
        ends = np.cumsum([len(array.edges) for array in self.arrays.values()])
        required, within = (np.split(x, ends[:-1], axis=1) for x in (found.required, found.within_limit))
        return {
            name: Voltages(one, other, self.modes[name].forces(unmet), self.modes[name].served)
            for name, one, other in zip(self.arrays, required, within, strict=True)
        }

    @property
    def to_reached(self) -> Array:
        """(m, n) modal forces on `reached` by those on the modes of the modal body."""
        return self.reached.forces(np.eye(len(self.Phi_V))).T

    def allocation(self, *, limited: bool) -> _core.Allocation:
        """From modal forces on `reached` to voltages (k,), with the limits of the patches or without."""
        return allocation(self.reach, limited=limited)

    def of_layout(self, name: str) -> Array:
        """(n, k) modal forces per volt of the patches of one layout."""
        first = 0
        for label, array in self.arrays.items():
            if label == name:
                return self.Phi_V[:, first : first + len(array.edges)]
            first += len(array.edges)
        raise KeyError(name)

    def unmet(self, F_p: Array, voltages: Array) -> Array:
        """(T, n) of modal forces F_p, at voltages (T, k) of all patches."""
        return F_p - voltages @ self.Phi_V.T


def link_patches(path: Path, layouts: Sequence[SpatialPztLayout], body: ModalBody, spatial: SpatialBody) -> LinkPatches:
    """Place the layouts of one link: they serve all modes of its file, also where the equations have fewer.

    Modal forces on those left out follow from the loads on the link. Raises `InputError` for patches that do not fit
    it, or weights that do not.
    """
    spatial = spatial.whole
    key = _key(path, layouts[0].label if len(layouts) == 1 else layouts[0].body)
    placed = [_placed(path, layout, body) for layout in layouts]
    found = effects(key, placed, body)
    modes = {one.layout.label: _reached(of.Phi_V, body, spatial) for one, of in zip(placed, found, strict=True)}
    for layout in layouts:
        _check_reached(path, layout, modes[layout.label], body)
    arrays = {
        one.layout.label: _array(path, one, body, spatial, of, modes[one.layout.label])
        for one, of in zip(placed, found, strict=True)
    }
    Phi_V = np.concatenate([of.Phi_V for of in found])
    reached = modes[layouts[0].label] if len(layouts) == 1 else _reached(Phi_V, body, spatial)
    reach = _alone(arrays[layouts[0].label]) if len(layouts) == 1 else _together(path, layouts, arrays, reached, Phi_V)
    if all(layout.allocation == "exact" for layout in layouts):
        check_all_served(key, reach)
    return LinkPatches(arrays, modes, reach, reached, Phi_V.T)


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


def _placed(path: Path, layout: SpatialPztLayout, body: ModalBody) -> Placed:
    key, edges = _key(path, layout.label), patch_edges(layout, body.length)
    check_sections(key, body, layout.normal, twists=layout.fibre_angle is not None)
    check_edges(key, edges, body.length)
    return Placed(layout, edges)


def _reached(per_volt: Array, body: ModalBody, spatial: SpatialBody) -> ReachedModes:
    """By modal forces per volt (k, n) on the modes of the modal body: the families in which any is not 0."""
    size = np.abs(per_volt).max(axis=0)
    families = {body.family[k] for k in np.flatnonzero(size > OUT_OF_REACH * size.max())}
    moving = spatial.modal_transform.any(axis=1)
    rows = np.flatnonzero([moves and family in families for moves, family in zip(moving, body.family, strict=True)])
    T_inverse, square = spatial.on_file, np.ix_(rows, rows)
    T, stiffness = uncoupling((T_inverse.T @ T_inverse)[square], (T_inverse.T * spatial.stiffness @ T_inverse)[square])
    modes_first = np.argsort(body.residual[rows], kind="stable")
    served = int(np.count_nonzero(body.residual[rows] == 0))
    return ReachedModes(rows, T[:, modes_first], stiffness[modes_first], served)


def _check_reached(path: Path, layout: SpatialPztLayout, modes: ReachedModes, body: ModalBody) -> None:
    """Raise `InputError` where a layout bends or twists the link in no mode."""
    if not modes.served:
        families = ", ".join(dict.fromkeys(str(family) for family in body.family)) or "none"
        raise InputError(
            f'{_key(path, layout.label)}: bends: expected modes of the link that patches for "{layout.acts_in}" reach,'
            f" found modes in {families}: move the patches, or add such modes to the link ([modes] family)"
        )


def _array(
    path: Path, placed: Placed, body: ModalBody, spatial: SpatialBody, of: Effects, modes: ReachedModes
) -> PatchArray:
    T_inverse = spatial.on_file
    points = {name: modes.seen(at.translation @ T_inverse) for name, at in spatial.points.items()}
    W_sqrt = weights(_key(path, placed.layout.label), placed.layout, modes.served, modes.stiffness, points)
    to_modes = np.zeros((body.mode_count, len(modes.rows)))
    to_modes[modes.rows] = modes.T
    return assembled(placed, body, of, to_modes, modes.stiffness, W_sqrt, modes.served)


def _alone(array: PatchArray) -> Reach:
    """Of a layout by itself, with its weights."""
    return Reach(**{key: getattr(array, key) for key in ("Phi_V", "limit", "W_sqrt", "frequency", "served")})


def _together(
    path: Path,
    layouts: Sequence[SpatialPztLayout],
    arrays: Mapping[str, PatchArray],
    reached: ReachedModes,
    per_volt: Array,
) -> Reach:
    """Of layouts side by side: all modal forces that are left count alike."""
    for layout in layouts:
        if layout.mode_weights is not None or layout.point_weights is not None:
            beside = f'with other layouts on "{layout.body}"'
            raise InputError(f"{_key(path, layout.label)}: expected no weights {beside}, found them")
    Phi_V = reached.seen(per_volt).T
    return Reach(
        Phi_V=Phi_V,
        limit=np.concatenate([array.limit for array in arrays.values()]),
        W_sqrt=served_first(reached.served, *Phi_V.shape),
        frequency=np.sqrt(reached.stiffness) / (2 * np.pi),
        served=reached.served,
    )


def _key(path: Path, label: str) -> str:
    return f'{path}: pzt "{label}"'
