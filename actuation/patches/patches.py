"""Piezoelectric patches on a link: what a volt does to its modal coordinates (Shabana 2022, Eqs. 14–17)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from ...common.arrays import Array, Indices, as_floats
from ...common.errors import InputError
from ...common.structs import struct
from ...fe_models.link_records.families import Family
from ...fe_models.modal_body import ModalBody
from ...mbs import _core
from ...mbs.model.amplifiers import Amplifiers
from ...mbs.model.body import Body
from ...mbs.model.masses import uncoupling
from .composite import SLIVER, Effects, PlacedLayout, stiffness_ratios
from .records import PztLayout

SINGULAR = 1e12  # condition number of Φ_V beyond which voltages are round-off
MOST_CONDITION = 1e16  # what more is found of a condition number is round-off itself
LEAST_WEIGHT = 1e-6  # of any mode, relative to the largest: without it voltages would be neither unique nor steady
OF_STATIC_SHAPES = 1e-3  # root of the weight of attachment modes beside modes: more patches than modes serve them last
ENERGY_WEIGHT = 1e-4  # of the strain energy rᵀ K⁻¹ r beside weights of points, for the same reason


@struct
class Reach:
    """Action of k patches on n modes, and the weights of the modes."""

    _: KW_ONLY
    Phi_V: Array  # (n, k) modal forces per volt
    amplifiers: Amplifiers  # of the k patches
    W_sqrt: Array  # (rows, n) what of the modal forces left unmet counts: |W_sqrt r|² is made small
    frequency: Array  # (n,) of the modes, Hz
    served: int  # number of modes, the first ones, that the patches are to serve: attachment modes are not among them

    @property
    def limit(self) -> Array:
        """Largest voltages of either sign (k,), V; infinite without limit."""
        return np.abs(self.amplifiers.range).max(axis=0)

    @property
    def condition_number(self) -> float:
        """Condition number of Φ_V; infinite if a mode is out of reach."""
        return float(np.linalg.cond(self.Phi_V[: self.served]))

    @property
    def unreached_modes(self) -> Indices:
        """Numbers (from 0) of the modes with forces that no voltages can produce."""
        left, sizes, _ = np.linalg.svd(self.Phi_V[: self.served])
        rank = int(np.count_nonzero(sizes > sizes[0] / SINGULAR))
        return np.flatnonzero(np.abs(left[:, rank:]).max(axis=1, initial=0.0) > 0.1)

    @property
    def serves_all(self) -> bool:
        """Whether voltages can produce all forces on the actuated modes."""
        return self.Phi_V.shape[1] >= self.served and not self.unreached_modes.size


def served_first(served: int, n: int, patches: int) -> Array:
    """Return (rows, n) roots of weights that prefer the first `served` of n modes; spare patches serve the others."""
    rows = n if patches > served else served
    return np.diag(np.where(np.arange(n) < served, 1.0, OF_STATIC_SHAPES))[:rows]


def weights(key: str, layout: PztLayout, served: int, stiffness: Array, points: Mapping[str, Array]) -> Array:
    """W_sqrt (rows, n): of modes, or of the deflections Φ(x) K⁻¹ r that modal forces r cause at points.

    `stiffness` (n,) of the modes, `points` their Φ (components, n) by name. Raises `InputError` for weights that do not
    fit.
    """
    order = served_first(served, len(stiffness), layout.patch_count)
    if layout.mode_weights is not None:
        if len(layout.mode_weights) != served:
            raise InputError(
                f"{key}: mode_weights: expected {served} weights, one for each mode that the patches serve",
                len(layout.mode_weights),
            )
        shares = np.array(layout.mode_weights) / max(layout.mode_weights)
        root = np.ones(len(order))
        root[:served] = np.sqrt(shares.clip(min=LEAST_WEIGHT))
        return root[:, None] * order
    if layout.point_weights is None:
        return order
    unknown = layout.point_weights.keys() - points.keys()
    if unknown:
        raise InputError(
            f"{key}: point_weights: expected points of the link, {', '.join(points)}", ", ".join(sorted(unknown))
        )
    rows = np.vstack([np.sqrt(weight) * points[name] / stiffness for name, weight in layout.point_weights.items()])
    size = np.linalg.norm(rows, 2)
    if not size > 0.0:
        raise InputError(f"{key}: point_weights: expected points that move with the modes", "none that do")
    softest = np.sqrt(stiffness.min() / stiffness)
    return np.vstack([rows / size, np.sqrt(ENERGY_WEIGHT) * np.diag(softest)])


def check_all_served(key: str, reach: Reach) -> None:
    """Raise `InputError` unless the patches reach every mode that they are to serve."""
    advice = 'or accept unmet modal forces: allocation = "least-squares"'
    n, k = reach.served, reach.Phi_V.shape[1]
    if not n:
        raise InputError(f"{key}: expected modes of the link for the patches to serve", "none")
    if k < n:
        raise InputError(f"{key}: expected as many patches as modes ({n}) or more", f"{k}: add patches, {advice}")
    unreached = reach.unreached_modes
    if unreached.size:
        modes = ", ".join(f"{j + 1} ({reach.frequency[j]:.4g} Hz)" for j in unreached)
        raise InputError(
            f"{key}: expected patches that excite every mode",
            f"a singular Φ_V (condition number {min(reach.condition_number, MOST_CONDITION):.1g}): no voltages serve"
            f" mode {modes}; move patches, {advice}",
        )


KEPT = 4  # links: numbers of patches are tried on one after the other
OUT_OF_REACH = 1e-9  # of the largest modal force per volt: less is round-off


@struct
class ReachedModes:
    """Modes of a link that moves in some families of modes only, in coordinates that decouple them."""

    rows: Indices  # (m,) numbers (from 0) of the modes of the modal body in these families
    # (m, m) p of these rows from the coordinates p' in which m_ff is the identity and K_ff diagonal; (m, fewer) of the
    # coordinates that equations keep, see `link_patches.on_kept_modes`
    T: Array
    stiffness: Array  # (m,) of the p'
    served: int  # number of them, the first ones: the others are attachment modes

    def forces(self, F_p: Array) -> Array:
        """Return modal forces (T, m) on p' from those on the modes of the modal body (T, n)."""
        return F_p[:, self.rows] @ self.T

    def coordinates(self, p: Array) -> Array:
        """Return p' (T, m) from modal coordinates of the modal body (T, n)."""
        return as_floats(np.linalg.lstsq(self.T, p[:, self.rows].T, rcond=None)[0].T)

    def seen(self, rows: Array) -> Array:
        """Return rows (k, n), linear in the modes of the modal body, as rows (k, m) of p'."""
        return self.forces(rows)


def reached_modes(per_volt: Array, body: ModalBody, spatial: Body) -> ReachedModes:
    """Return the mode families that patches excite, from modal forces per volt (k, n) on the modal body."""
    size = np.abs(per_volt).max(axis=0)
    return _modes_of(frozenset(body.family[k] for k in np.flatnonzero(size > OUT_OF_REACH * size.max())), body, spatial)


@lru_cache(maxsize=KEPT)
def _modes_of(families: frozenset[Family], body: ModalBody, spatial: Body) -> ReachedModes:
    moving = spatial.modal_transform.any(axis=1)
    rows = np.flatnonzero([moves and family in families for moves, family in zip(moving, body.family, strict=True)])
    T_inverse, square = spatial.on_file, np.ix_(rows, rows)
    T, stiffness = uncoupling((T_inverse.T @ T_inverse)[square], (T_inverse.T * spatial.stiffness @ T_inverse)[square])
    modes_first = np.argsort(body.residual[rows], kind="stable")
    served = int(np.count_nonzero(body.residual[rows] == 0))
    return ReachedModes(rows, T[:, modes_first], stiffness[modes_first], served)


@struct
class Voltages:
    """Voltages of patches over time."""

    required: Array  # (T, k) V, with no limit; of least size or least residual where patches and modes differ in number
    within_limit: Array  # (T, k) V, the best within the limits of the patches
    unmet: Array  # (T, n) modal forces that `within_limit` leaves
    served: int  # number of modes, the first ones, that the patches are to serve

    def at(self, rows: Indices) -> Voltages:
        """Return these rows (outputs) alone."""
        return Voltages(self.required[rows], self.within_limit[rows], self.unmet[rows], self.served)

    @property
    def residual(self) -> Array:
        """Norm (T,), N/√kg, of the modal force on served modes that `within_limit` leaves unmet."""
        return np.linalg.norm(self.unmet[:, : self.served], axis=1)

    @property
    def largest(self) -> float:
        """Largest required voltage, V."""
        return float(np.abs(self.required).max(initial=0.0))


def voltage_scale(patches: Reach) -> Array:
    """Ordinary voltages (k,) of the patches: their limits, the largest of these where a patch has none, else 1 V."""
    known = np.isfinite(patches.limit)
    return np.where(known, patches.limit, patches.limit[known].max() if known.any() else 1.0)


def voltage_gain(patches: Reach) -> Array:
    """Voltages (k, n), V√kg/N, per modal force without limits: Φ_V⁻¹, or those of least weighted residual.

    Of many that do, the smallest relative to `voltage_scale`.
    """
    (n, k), served = patches.Phi_V.shape, patches.served
    if k == served and patches.serves_all:
        return as_floats(np.linalg.inv(patches.Phi_V[:served]) @ np.eye(served, n))
    W_sqrt = served_first(served, n, k) if patches.serves_all else patches.W_sqrt
    scale = voltage_scale(patches)
    return scale[:, None] * np.linalg.pinv(W_sqrt @ patches.Phi_V * scale) @ W_sqrt


def allocation(patches: Reach, *, limited: bool) -> _core.Allocation:
    """Return the map from modal forces to voltages, with limits of the patches or without."""
    lower, upper = (patches.amplifiers if limited else patches.amplifiers.unlimited()).range
    return _core.Allocation(patches.Phi_V, patches.W_sqrt, voltage_gain(patches), lower, upper, voltage_scale(patches))


def solve_voltages(patches: Reach, F_p: Array) -> Voltages:
    """Find voltages (T, k), V, that produce the modal forces F_p (T, n), N/√kg, as nearly as possible."""
    F_p = np.ascontiguousarray(F_p)
    required = F_p @ voltage_gain(patches).T
    within_limit = allocation(patches, limited=True).solve(F_p)
    return Voltages(required, within_limit, F_p - within_limit @ patches.Phi_V.T, patches.served)


@struct
class PatchArray(Reach):
    """The patches of one layout."""

    layout: PztLayout  # the keys of the scene
    edges: Array  # (k, 2) where each patch begins and ends along the link, m
    height: Array  # (k,) t_b, of the link along their normal under each patch, its mean, m
    moment_per_volt: Array  # (k,) c in N·m/V
    turn: Array  # (n, k) φ'(x2) − φ'(x1) of the n modes of the body, rad per unit of modal coordinate; of twist φ_x
    link: ModalBody  # the modal body of the link that they are on
    lever: Array  # (k,) strain of the surface by unit turn per length and distance: 1 of bending
    read_capacitance: Array  # (k,) F, as sensors; see `PztLayout.read_capacitance`

    @property
    def body(self) -> str:
        """Name of the link."""
        return self.layout.body

    @cached_property
    def _stiffness(self) -> tuple[Array, Array]:
        return stiffness_ratios(PlacedLayout(self.layout, self.edges), self.link)

    @property
    def stiffness_ratio(self) -> Array:
        """Stiffness ratio ψ (k,) of link to patch; see `composite.stiffness_ratios`."""
        return self._stiffness[0]

    @property
    def authority(self) -> Array:
        """Share (k,) of c V that bends the link against the patches' own stiffness."""
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
        layout = self.layout
        charge = f"electrodes {layout.electrodes}" if layout.shunt is None else f"shunt {layout.shunt:g} Ω"
        built = f"strain {layout.strain}, {charge}, {1e9 * layout.capacitance():.3g} nF each"
        return f"{layout.label}: stiffness ratio ψ {psi}: {left}; {built}"

    @property
    def surface_distance(self) -> Array:
        """Distance (k,) from the link's axis to the outer surface of each patch, m."""
        return self.height / 2 + self.layout.layers * self.layout.thickness


def _span(values: Array) -> str:
    """One number, or from the smallest to the largest."""
    return " … ".join(dict.fromkeys(f"{value:.3g}" for value in (values.min(), values.max())))


def assembled(
    placed: PlacedLayout, body: ModalBody, of: Effects, T: Array, *, stiffness: Array, W_sqrt: Array, served: int
) -> PatchArray:
    """The patches in modal coordinates p, of which T (n_file, n) makes those of the modal body; `stiffness` (n,)."""
    layout, edges = placed
    return PatchArray(
        layout=layout,
        edges=edges,
        height=of.extent,
        moment_per_volt=of.per_volt,
        turn=(of.turn @ T).T,
        link=body,
        lever=of.lever,
        read_capacitance=layout.read_capacitance(of.yielding),
        Phi_V=(of.Phi_V @ T).T,
        amplifiers=layout.amplifiers(),
        W_sqrt=W_sqrt,
        frequency=np.sqrt(stiffness) / (2 * np.pi),
        served=served,
    )


def edges_on_piece(layout: PztLayout, edges: Array, start: float, length: float) -> tuple[Indices, Array]:
    """Numbers (from 0) of the patches between `edges` (k, 2) that are on a piece, and where on it they are, m.

    The piece is `length` (m) long and begins at `start` (m) from the root of the link.
    """
    clipped = (edges - start).clip(0.0, length)
    which = np.flatnonzero(np.diff(clipped, axis=1)[:, 0] > SLIVER * layout.length)
    return which, clipped[which]


def patch_edges(layout: PztLayout, length: float) -> Array:
    """Return begin and end (k, 2) of the patches of `layout` on a link of that `length`, m."""
    if layout.centers is not None:
        centers = np.array(layout.centers)
    else:
        centers = (np.arange(layout.patch_count) + 0.5) * length / layout.patch_count
    return centers[:, None] + np.array([-0.5, 0.5]) * layout.length


def check_edges(key: str, edges: Array, length: float) -> None:
    """Raise `InputError` for patches (k, 2) beyond a link of that length, m, or on each other."""
    slack = 1e-9 * length
    for k, (start, end) in enumerate(edges, 1):
        if start < -slack or end > length + slack:
            raise InputError(
                f"{key}: expected patches within the link, 0 … {length:g} m", f"patch {k} from {start:g} to {end:g} m"
            )
    for k, following in pairwise(np.argsort(edges[:, 0])):
        if edges[following, 0] < edges[k, 1] - slack:
            first, second = sorted((k + 1, following + 1))
            (a, b), (c, d) = edges[first - 1], edges[second - 1]
            raise InputError(
                f"{key}: expected patches side by side",
                f"patch {first} ({a:g} to {b:g} m) and patch {second} ({c:g} to {d:g} m) on the same place",
            )
