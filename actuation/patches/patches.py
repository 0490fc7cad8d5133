"""Piezoelectric patches on a link: what a volt does to its modal coordinates (Shabana 2022, Eqs. 14–17). SI units."""

from collections.abc import Mapping
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...common.structs import struct
from ...fe_models.link_records.families import Family
from ...fe_models.modal_body import ModalBody
from ...mbs.model.amplifiers import Amplifiers
from ...mbs.model.body import Body
from ...mbs.model.masses import uncoupling
from .composite import Effects, PlacedLayout, stiffness_ratios
from .records import PztLayout

SINGULAR = 1e12  # condition number of Φ_V beyond which voltages are round-off
LEAST_WEIGHT = 1e-6  # of any mode, relative to the largest: without it voltages would be neither unique nor steady
OF_STATIC_SHAPES = 1e-3  # root of the weight of attachment modes beside modes: more patches than modes serve them last
ENERGY_WEIGHT = 1e-4  # of the strain energy rᵀ K⁻¹ r beside weights of points, for the same reason


@struct
class ReachedModes:
    """Modes of the families that patches excite, among n modes of a link, in coordinates p' that decouple them."""

    rows: Indices  # (m,) numbers (from 0) of the modes of the modal body in these families
    # (m, m) p of these modes from p', no unit: m_ff is the identity and K_ff diagonal; (m, fewer) where equations
    # keep fewer, see `link_patches.on_kept_modes`
    T: Array
    stiffness: Array  # (m,) of the p', rad²/s²
    served: int  # number of the p', the first ones, that are no attachment modes

    def forces(self, F_p: Array) -> Array:
        """Modal forces (T, m) on p' from those (T, n) of the body, both N/√kg; or other derivatives by modes."""
        return F_p[:, self.rows] @ self.T

    def coordinates(self, p: Array) -> Array:
        """Return p' (T, m) from modal coordinates (T, n) of the modal body, both m·√kg."""
        return np.linalg.lstsq(self.T, p[:, self.rows].T, rcond=None)[0].T


@struct
class Reach:
    """Modal forces of k patches on n modes, and the weights of the modes."""

    modes: ReachedModes
    Phi_V: Array  # (n, k) modal forces per volt, N/(√kg·V)
    amplifiers: Amplifiers  # of the k patches
    W_sqrt: Array  # (rows, n) weights, no unit: least squares minimize |W_sqrt r|² of the unmet modal forces r

    @property
    def served(self) -> int:
        """Number of modes, the first ones, that the patches are to serve: attachment modes are not among them."""
        return self.modes.served

    @property
    def limit(self) -> Array:
        """Largest voltage of either sign (k,), V; infinite without limit."""
        return np.abs(self.amplifiers.range).max(axis=0)

    @property
    def condition_number(self) -> float:
        """Condition number of Φ_V; infinite if a mode is out of reach."""
        return float(np.linalg.cond(self.Phi_V[: self.served]))

    @property
    def unreached_modes(self) -> Indices:
        """Indices (count,) of the served modes with forces that no voltages can produce."""
        left, sizes, _ = np.linalg.svd(self.Phi_V[: self.served])
        rank = int(np.count_nonzero(sizes > sizes[0] / SINGULAR))
        return np.flatnonzero(np.abs(left[:, rank:]).max(axis=1, initial=0.0) > 0.1)

    @property
    def serves_all(self) -> bool:
        """Return whether voltages can produce all forces on the served modes."""
        return self.Phi_V.shape[1] >= self.served and not self.unreached_modes.size


def served_first(served: int, n: int, patches: int) -> Array:
    """Roots (rows, n), no unit, of weights that prefer the first `served` of n modes.

    Other modes have weights only if there are more `patches`.
    """
    rows = n if patches > served else served
    return np.diag(np.where(np.arange(n) < served, 1.0, OF_STATIC_SHAPES))[:rows]


def weights(layout: PztLayout, served: int, stiffness: Array, points: Mapping[str, Array]) -> Array:
    """Root weights W_sqrt (rows, n), no unit, of modes, or of deflections Φ(x) K⁻¹ r by unmet modal forces r.

    The first `served` of n modes have `stiffness` (n,), rad²/s², and at points by name Φ (components, n), 1/√kg. Raises
    `InputError` for weights that do not fit.
    """
    order = served_first(served, len(stiffness), layout.patch_count)
    if layout.mode_weights is not None:
        if len(layout.mode_weights) != served:
            raise InputError(
                f"mode_weights: expected {served} weights, one for each mode that the patches serve",
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
        raise InputError(f"point_weights: expected points of the link, {', '.join(points)}", ", ".join(sorted(unknown)))
    rows = np.vstack([np.sqrt(weight) * points[name] / stiffness for name, weight in layout.point_weights.items()])
    size = np.linalg.norm(rows, 2)
    if not size > 0.0:
        raise InputError("point_weights: expected points that move with the modes", "none that do")
    softest = np.sqrt(stiffness.min() / stiffness)
    return np.vstack([rows / size, np.sqrt(ENERGY_WEIGHT) * np.diag(softest)])


OUT_OF_REACH = 1e-9  # of the largest modal force per volt: less is round-off


def reached_modes(per_volt: Array, body: ModalBody, spatial: Body) -> ReachedModes:
    """The modes of the families that k patches excite, by their modal forces per volt (k, n), N/(√kg·V)."""
    size = np.abs(per_volt).max(axis=0)
    return _modes_of(frozenset(body.family[k] for k in np.flatnonzero(size > OUT_OF_REACH * size.max())), body, spatial)


@lru_cache(maxsize=4)  # links: numbers of patches are tried on one after the other
def _modes_of(families: frozenset[Family], body: ModalBody, spatial: Body) -> ReachedModes:
    moving = spatial.modal_transform.any(axis=1)
    rows = np.flatnonzero([moves and family in families for moves, family in zip(moving, body.family, strict=True)])
    T_inverse, square = spatial.on_file, np.ix_(rows, rows)
    T, stiffness = uncoupling((T_inverse.T @ T_inverse)[square], (T_inverse.T * spatial.stiffness @ T_inverse)[square])
    modes_first = np.lexsort((stiffness, body.residual[rows]))
    served = int(np.count_nonzero(body.residual[rows] == 0))
    return ReachedModes(rows, T[:, modes_first], stiffness[modes_first], served)


@struct
class Voltages:
    """Voltages of patches over time."""

    # (T, k) V, with no limit; of least size or least residual where patches and modes differ in number
    required: Array
    within_limit: Array  # (T, k) V, the best within the limits of the patches
    unmet: Array  # (T, n) N/√kg, modal forces that `within_limit` leaves

    def at(self, rows: Indices) -> "Voltages":
        """The voltages at some outputs alone, by their indices (k,)."""
        return Voltages(self.required[rows], self.within_limit[rows], self.unmet[rows])

    @property
    def largest(self) -> float:
        """Largest required voltage, V."""
        return float(np.abs(self.required).max(initial=0.0))


def voltage_scale(patches: Reach) -> Array:
    """Voltages (k,), V, that scale those of the patches: limits, the largest one where a patch has none, else 1 V."""
    known = np.isfinite(patches.limit)
    return np.where(known, patches.limit, patches.limit[known].max() if known.any() else 1.0)


def voltage_gain(patches: Reach) -> Array:
    """Voltages (k, n), V√kg/N, per modal force without limits: Φ_V⁻¹, or of least weighted residual.

    Of several solutions it is the smallest relative to `voltage_scale`.
    """
    (n, k), served = patches.Phi_V.shape, patches.served
    if k == served and patches.serves_all:
        return np.linalg.inv(patches.Phi_V[:served]) @ np.eye(served, n)
    W_sqrt = served_first(served, n, k) if patches.serves_all else patches.W_sqrt
    scale = voltage_scale(patches)
    return scale[:, None] * np.linalg.pinv(W_sqrt @ patches.Phi_V * scale, 1 / SINGULAR) @ W_sqrt


@struct
class PatchArray(Reach):
    """The patches of one layout."""

    layout: PztLayout  # the keys of the scene
    edges: Array  # (k, 2) x where each patch begins and ends, m
    effects: Effects  # effects on the modes of the `link`
    link: ModalBody  # modal body of the link

    @property
    def moment_per_volt(self) -> Array:
        """Loads c (k,) along the strain that each patch actuates, N·m/V."""
        return self.effects.per_volt

    @cached_property
    def _stiffness(self) -> tuple[Array, Array]:
        return stiffness_ratios(PlacedLayout(self.layout, self.edges), self.link)

    @property
    def stiffness_ratio(self) -> Array:
        """Axial stiffness of the link over that of each patch, ψ (k,), no unit."""
        return self._stiffness[0]

    @property
    def authority(self) -> Array:
        """Curvature (or twist) (k,) under a voltage, relative to that without the stiffness of the patches, no unit."""
        return self._stiffness[1]

    @property
    def stiffness_in_words(self) -> str:
        """Text with the stiffness ratio and authority, and whether the equations have the stiffness of patches."""
        if not np.isfinite(self.authority).all():
            unknown = "stiffness ratio ψ not known: the modal body has no rigidities"
            return f"{self.layout.label}: {unknown}; with few modes patches stiffen the link too little"
        spans = [dict.fromkeys(f"{value:.3g}" for value in (of.min(), of.max())) for of in self._stiffness]
        psi, authority = (" … ".join(span) for span in spans)
        felt = "included in the model" if self.layout.adds_stiffness else "not included (structural = false)"
        what = "twist" if self.layout.bends == "twist" else "curvature"
        left = f"patch stiffness reduces the induced {what} to {authority} of its value, {felt}"
        layout = self.layout
        charge = f"electrodes {layout.electrodes}" if layout.shunt is None else f"shunt {layout.shunt:g} Ω"
        built = f"strain {layout.strain}, {charge}, {1e9 * layout.capacitance():.3g} nF each"
        return f"{layout.label}: stiffness ratio ψ {psi}: {left}; {built}"


def patch_edges(layout: PztLayout, length: float) -> Array:
    """Where the patches of `layout` begin and end (k, 2), m from the root of a link of that `length`, m."""
    if layout.centers is not None:
        centers = np.array(layout.centers)
    else:
        centers = (np.arange(layout.patch_count) + 0.5) * length / layout.patch_count
    return centers[:, None] + np.array([-0.5, 0.5]) * layout.length


def check_edges(edges: Array, length: float) -> None:
    """Raise `InputError` for patches between `edges` (k, 2), m, beyond a link of that `length`, or on each other."""
    slack = 1e-9 * length
    for k, (start, end) in enumerate(edges, 1):
        if start < -slack or end > length + slack:
            raise InputError(
                f"expected patches within the link, 0 … {length:g} m", f"patch {k} from {start:g} to {end:g} m"
            )
    for k, following in pairwise(np.argsort(edges[:, 0])):
        if edges[following, 0] < edges[k, 1] - slack:
            first, second = sorted((k + 1, following + 1))
            (a, b), (c, d) = edges[first - 1], edges[second - 1]
            raise InputError(
                "expected patches side by side",
                f"patch {first} ({a:g} to {b:g} m) and patch {second} ({c:g} to {d:g} m) on the same place",
            )
