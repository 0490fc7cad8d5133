"""Patches of a link: several layouts side by side, and the voltages for all of them together. SI units.

They serve the families of modes that some patch excites: in-plane bending (patches on ±y), out-of-plane bending (±z),
torsion (fibers at an angle), axial modes (one named face). Modal forces on other families are unmet.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError, naming
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...mbs import _core
from ...mbs.model.amplifiers import Amplifiers, joined
from ...mbs.model.body import Body
from ...mbs.model.divided_link import spread_of
from .composite import SLIVER, Effects, PlacedLayout, effects, layers_on_link
from .patches import (
    PatchArray,
    Reach,
    ReachedModes,
    Voltages,
    check_edges,
    patch_edges,
    reached_modes,
    served_first,
    voltage_gain,
    voltage_scale,
    weights,
)
from .records import PztLayout
from .sections import check_sections, check_width, link_sections

WIDE = 3.0  # of its length: a link that wide keeps its sections flat, whatever its supports


@struct
class OnBody:
    """Effects of all k patches of a link on one body that carries them, on the n modes of the body's file."""

    to_link: Array  # (modes of the link, n), no unit: modal forces on the modes of the link's file by those here
    charge: Array  # (n, k) of each patch per unit of each mode, C/(m·√kg): Φ_V, whether or not voltages drive it
    capacitance: Array  # (k, k) charges of patches as sensors by voltages, F


@struct
class LinkPatches:
    """All patches of one link, k in all, on the n modes of its modal body.

    Voltages serve the modes of the link. They act on whichever of the `bodies` a model has: the link, or its pieces.
    """

    arrays: Mapping[str, PatchArray]  # by layout, each on the modes that it reaches
    reach: Reach  # of all patches side by side on the modes that they reach together
    bodies: Mapping[str, OnBody]  # by name, the link and, where it is divided, its pieces
    slowness: float  # √(ρA/EI) of the link, s/m²
    of_modes: Array  # (k, k) part of `static` by strains of the modes, F
    # (n, n), no unit, from modal forces to the part that the equations keep; None: all of them
    on_kept: Array | None = None

    @property
    def body(self) -> str:
        """Name of the link."""
        return next(iter(self.arrays.values())).layout.body

    @property
    def Phi_V(self) -> Array:
        """Modal forces per volt (n, k), N/(√kg·V), on the modes of the link's file."""
        return self.per_volt[self.body]

    def voltages(self, F_p: Array, V: Array | None = None) -> dict[str, Voltages]:
        """Voltages by layout for modal forces F_p (T, n), N/√kg, or given ones V (T, k), V, within limits.

        Their `unmet`: what all layouts together leave.
        """
        if V is None:
            forces = np.ascontiguousarray(self.reach.modes.forces(F_p))
            V, within = forces @ voltage_gain(self.reach).T, self.allocation(limited=True).solve(forces)
        else:
            within = np.clip(V, *self.amplifiers.range)
        unmet, found = self.unmet(F_p, within), {}
        for name, array in self.arrays.items():
            own = np.s_[:, self.columns(name)]
            found[name] = Voltages(V[own], within[own], array.modes.forces(unmet))
        return found

    @property
    def amplifiers(self) -> Amplifiers:
        """Amplifiers of the k patches, their capacitances on a link without loads."""
        of, driven = self.reach.amplifiers, driven_patches(self.arrays.values())
        return replace(of, capacitance=of.capacitance + driven[:, None] * self.static)

    @cached_property
    def static(self) -> Array:
        """Charges (k, k), F, by the strains of voltages that drive a link without loads."""
        arrays = [*self.arrays.values()]
        layers = layers_on_link([PlacedLayout(of.layout, of.edges) for of in arrays], arrays[0].link)
        return (layers.yielding + self.of_modes) * driven_patches(arrays)

    @property
    def edges(self) -> Array:
        """Where the patches begin and end, x (k, 2) in m."""
        return np.concatenate([array.edges for array in self.arrays.values()])

    @property
    def per_volt(self) -> dict[str, Array]:
        """Modal forces per volt (n, k), N/(√kg·V), by body, on the modes of its file."""
        return {name: of.charge * driven_patches(self.arrays.values()) for name, of in self.bodies.items()}

    @property
    def to_reached(self) -> dict[str, Array]:
        """Matrices (m, n), no unit, by body, from modal forces on modes of its file to those on modes of `reach`."""
        return {name: self.reach.modes.forces(of.to_link.T).T for name, of in self.bodies.items()}

    def on_link(self, modal: Mapping[str, Array]) -> Array:
        """Modal forces (T, n), N/√kg, on modes of the link's file by forces `modal` on its `bodies`."""
        return np.sum([modal[name] @ of.to_link.T for name, of in self.bodies.items() if name in modal], axis=0)

    def allocation(self, *, limited: bool) -> _core.Allocation:
        """The map from forces (m,) on the modes of `reach`, N/√kg, to voltages (k,), V, limited or not."""
        of = self.reach
        lower, upper = (of.amplifiers if limited else of.amplifiers.unlimited()).range
        return _core.Allocation(of.Phi_V, of.W_sqrt, voltage_gain(of), lower, upper, voltage_scale(of))

    def placed_on(self, start: float, length: float) -> list[tuple[Indices, PlacedLayout]]:
        """Return, by layout, indices (k,) of its patches on a piece of the link, and their position there.

        The piece is `length` (m) long and begins at `start` (m) from the root.
        """
        found = []
        for label, array in self.arrays.items():
            edges = (array.edges - start).clip(0.0, length)
            which = np.flatnonzero(np.diff(edges, axis=1)[:, 0] > SLIVER * array.layout.length)
            if which.size:
                found.append((self.columns(label).start + which, PlacedLayout(array.layout, edges[which])))
        return found

    def is_beside(self, place: Array) -> bool:
        """Whether `place` (3,), m, is at a section of the link without patches."""
        return bool((np.prod(self.edges - place[0], axis=1) > 0.0).all())

    def columns(self, layout: str) -> slice:
        """The columns of one layout among the k patches."""
        ends = np.cumsum([len(array.edges) for array in self.arrays.values()])
        end = int(ends[list(self.arrays).index(layout)])
        return slice(end - len(self.arrays[layout].edges), end)

    def unmet(self, F_p: Array, voltages: Array) -> Array:
        """The part (T, n) of modal forces F_p (T, n), N/√kg, that voltages (T, k), V, of all patches leave."""
        left = F_p - voltages @ self.Phi_V.T
        return left if self.on_kept is None else left @ self.on_kept


def driven_patches(placed: Iterable[PlacedLayout | PatchArray]) -> Array:
    """Return whether voltages drive each patch (k,)."""
    return np.array([one.layout.is_driven for one in placed for _ in one.edges])


def placed_patches(layouts: Sequence[PztLayout], body: ModalBody) -> list[PlacedLayout]:
    """Layouts with positions of patches, and `strain`: by default "biaxial" on wide links and outlined faces.

    Raises `InputError` for patches that do not fit the link.
    """
    placed = []
    for layout in layouts:
        edges = patch_edges(layout, body.length)
        with naming(_key(layout)):
            check_sections(body, layout.normal, twists=layout.fibre_angle is not None)
            check_edges(edges, body.length)
            edges = body.begin + edges.clip(0.0, body.length)
            check_width(body, layout, edges)
        across = link_sections(body).extent("z" if layout.normal == "y" else "y")
        is_wide = layout.coupling == "surface" or bool(np.nanmax(across, initial=0.0) >= WIDE * body.length)
        plain = layout.fibre_angle is None and layout.poissons_ratio is not None
        strain = layout.strain or ("biaxial" if plain and is_wide else "uniaxial")
        placed.append(PlacedLayout(layout.model_copy(update={"strain": strain}), edges))
    return placed


def link_patches(layouts: Sequence[PztLayout], body: ModalBody, spatial: Body) -> LinkPatches:
    """Place the layouts of one link, so that they serve all modes of its file that they excite; see `on_kept_modes`.

    `spatial`: equations of the link. Raises `InputError` for patches or weights that do not fit the link.
    """
    spatial = spatial.whole
    placed = placed_patches(layouts, body)
    with naming(_key(*layouts)):
        found = effects(placed, body)
    charge = np.concatenate([one.Phi_V for one in found]).T
    capacitance, driven = np.concatenate([one.capacitance for one in found]), driven_patches(placed)
    arrays = {one.layout.label: _array(one, body, spatial, of) for one, of in zip(placed, found, strict=True)}
    reach: Reach = next(iter(arrays.values()))
    if len(layouts) > 1:
        reached = reached_modes((charge * driven if driven.any() else charge).T, body, spatial)
        reach = _together(layouts, arrays, reached, charge.T)
    if not driven.all():
        reach = replace(reach, Phi_V=reach.Phi_V * driven)
    own = {layouts[0].body: OnBody(np.eye(body.mode_count), charge, capacitance)}
    # √(ρA/EI) of the mode that bends the link most softly: ω² = ∫ EI φ''² dx
    bent = np.diff(body.stations.rotation[:, 1:], axis=0) ** 2 / np.diff(body.stations.position[:, 0])[:, None, None]
    softest = (bent.sum(axis=(0, 1)) / np.diag(body.stiffness)).max(initial=0.0)
    on_modes = spatial.modal_transform.T @ charge
    of_modes = (on_modes.T / spatial.stiffness) @ on_modes
    return LinkPatches(arrays, reach, own, float(np.sqrt(body.mass / body.length * softest)), of_modes)


def check_reach(of_link: LinkPatches) -> None:
    """Raise `InputError` unless patches excite all modes that they are to serve, or `allocation` is least-squares."""
    layouts = [array.layout for array in of_link.arrays.values() if array.layout.is_driven]
    if not layouts or any(layout.allocation != "exact" for layout in layouts):
        return
    key, reach = _key(*layouts), of_link.reach
    advice = 'or accept unmet modal forces: allocation = "least-squares"'
    n, k = reach.served, reach.Phi_V.shape[1]
    if not n:
        raise InputError(f"{key}: expected modes of the link for the patches to serve", "none")
    if k < n:
        raise InputError(f"{key}: expected as many patches as modes ({n}) or more", f"{k}: add patches, {advice}")
    if (unreached := reach.unreached_modes).size:
        frequency = np.sqrt(reach.modes.stiffness) / (2 * np.pi)
        modes = ", ".join(f"{j + 1} ({frequency[j]:.4g} Hz)" for j in unreached)
        condition = min(reach.condition_number, 1e16)  # beyond is round-off
        raise InputError(
            f"{key}: expected patches that excite every mode",
            f"a singular Φ_V (condition number {condition:.1g}): no voltages serve mode {modes}; move patches,"
            f" {advice}",
        )


def on_pieces(whole: LinkPatches, link: ModalBody, pieces: Mapping[str, tuple[float, ModalBody]]) -> LinkPatches:
    """The patches of a link on its pieces as well: a patch across a cut acts on both sides of it.

    `pieces` by name from the root to the tip: where each begins, m from the root, and its modal body. Raises
    `InputError` for electrodes that a cut divides, and for shunts, which act at the frequencies of the link's modes.
    """
    cuts = np.array([start for start, _ in pieces.values()])[1:]
    for array in whole.arrays.values():
        layout, slack = array.layout, 1e-6 * array.layout.length
        if layout.shunt is not None:
            expected = "shunt: expected a link in one piece with a shunt"
            raise InputError(f"{_key(layout)}: {expected}", f"{len(pieces)} pieces")
        through = ((cuts > array.edges[:, :1] + slack) & (cuts < array.edges[:, 1:] - slack)).any(axis=0)
        if layout.gives_way and through.any():
            raise InputError(
                f'{_key(layout)}: electrodes: expected no cut between pieces through a patch with electrodes = "open"',
                f"one at {cuts[through][0]:g} m: change pieces, or centers",
            )
    bodies = {whole.body: whole.bodies[whole.body]}
    spread = spread_of(link, list(pieces.values()))
    ends = np.cumsum([modal.mode_count for _, modal in pieces.values()])
    for (name, (start, modal)), to_piece in zip(pieces.items(), np.split(spread, ends[:-1]), strict=True):
        on_piece = whole.placed_on(start, modal.length)
        columns, k = [k for which, _ in on_piece for k in which], len(whole.edges)
        charge, capacitance = np.zeros((modal.mode_count, k)), np.zeros((k, k))
        found = effects([placed for _, placed in on_piece], modal) if on_piece else []
        for (which, _), of in zip(on_piece, found, strict=True):
            charge[:, which], capacitance[np.ix_(which, columns)] = of.Phi_V.T, of.capacitance
        bodies[name] = OnBody(to_piece.T, charge, capacitance)
    return replace(whole, bodies=bodies)


def with_count(layout: PztLayout, body: ModalBody, spatial: Body, count: int) -> LinkPatches | None:
    """`count` patches of a layout alone, evenly spaced, with one limit; None if they do not fit the link."""
    try:
        return link_patches([layout.with_one_limit(count=count, centers=None)], body, spatial)
    except InputError:  # no room, a step of the section, weights for another number
        return None


def _array(placed: PlacedLayout, body: ModalBody, spatial: Body, of: Effects) -> PatchArray:
    (layout, edges), modes = placed, reached_modes(of.Phi_V, body, spatial)
    if not modes.served:
        families = ", ".join(dict.fromkeys(map(str, body.family[: body.eigenmode_count]))) or "none"
        raise InputError(
            f'{_key(layout)}: bends: expected eigenmodes of the link that patches for "{layout.bends}" reach',
            f"eigenmodes in {families}: add such modes ([modes] family, a larger count), or move the patches",
        )
    points = {name: modes.forces(at.translation @ spatial.on_file) for name, at in spatial.points.items()}
    with naming(_key(layout)):
        W_sqrt = weights(layout, modes.served, modes.stiffness, points)
    return PatchArray(
        modes=modes,
        Phi_V=modes.forces(of.Phi_V).T,
        amplifiers=layout.amplifiers(),
        W_sqrt=W_sqrt,
        layout=layout,
        edges=edges,
        effects=of,
        link=body,
    )


def _together(
    layouts: Sequence[PztLayout], arrays: Mapping[str, PatchArray], reached: ReachedModes, per_volt: Array
) -> Reach:
    """Reach of layouts side by side: all modal forces that are left count alike."""
    for layout in layouts:
        if layout.mode_weights is not None or layout.point_weights is not None:
            raise InputError(f'{_key(layout)}: expected no weights with other layouts on "{layout.body}"', "them")
    Phi_V = reached.forces(per_volt).T
    amplifiers = joined(of.amplifiers for of in arrays.values())
    return Reach(reached, Phi_V, amplifiers, served_first(reached.served, *Phi_V.shape))


def _key(layout: PztLayout, *others: PztLayout) -> str:
    return f'pzt "{layout.body if others else layout.label}"'


def on_kept_modes(of_link: LinkPatches, equations: Body) -> LinkPatches:
    """The patches of a link for its `equations`, which may have fewer modes than its file.

    They are unchanged with all modes, or if they can produce all modal forces. Else they produce those on coordinates
    of the equations, and may bend the link in the modes left out.
    """
    if equations.reduction is None or of_link.reach.serves_all:
        return of_link
    Phi_V, arrays = of_link.Phi_V, {}
    for layout, array in of_link.arrays.items():
        arrays[layout] = replace(array, **_on_kept(array, Phi_V[:, of_link.columns(layout)], equations))
    reach = replace(of_link.reach, **_on_kept(of_link.reach, Phi_V, equations))
    return replace(of_link, arrays=arrays, reach=reach, on_kept=equations.modal_transform @ equations.on_file)


def _on_kept(reach: Reach, Phi_V: Array, equations: Body) -> dict[str, Any]:
    """Fields of a `reach` on the coordinates kept that move the link in its modes; Φ_V is on the modes of the file."""
    squares, reached = equations.modal_transform**2, reach.modes
    columns = np.flatnonzero(squares[reached.rows].sum(axis=0) > 0.5 * squares.sum(axis=0))
    T = equations.modal_transform[np.ix_(reached.rows, columns)]
    served = int(np.count_nonzero(columns < equations.n_eigenmodes))
    modes = ReachedModes(reached.rows, T, equations.stiffness[columns], served)
    lift = reached.forces(equations.on_file[columns]).T  # forces on all that patches reach
    return {"modes": modes, "Phi_V": modes.forces(Phi_V.T).T, "W_sqrt": reach.W_sqrt @ lift}
