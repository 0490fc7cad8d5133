"""How far a run leaves the small deformations that modes describe, and how wrong its results may be for that. SI units.

Deflection and section rotation are measured from the chord, the straight line between the ends of a link's axis, so
that they are the same under every reference condition. The foreshortening ½ pᵀG p = ½∫w'² dx is that in the link's own
frame, for just that is what the equations leave out, or know to second order where geometric stiffening is on.

Estimates of errors, by the change S = Σ f_j K_j of the modes' stiffness under loads of sizes f_j, are those of
docs/theory.md, Limits. μ are eigenvalues of K_ff^-½ S K_ff^-½: −1 means buckling.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices
from ...common.peaks import largest_below
from ...common.structs import kept, struct
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body.unit_loads import interface_load_names
from ..model.nodes import Node
from ..run.record import Run
from .link_loads import loads_in_equations
from .motion import constraint_rows, cut_motions, node_of, places

AT_ONCE = 64  # outputs whose eigenvalues are found together


class LoadedPoint(NamedTuple):
    """Interface at `position` (3,), m, with mode shapes (6, n), geometric stiffness K (6, n, n) per unit load; SI."""

    position: Array
    by_modes: Array
    K: Array


@struct
class ModalLoads:
    """Loads f (T, J), with geometric stiffness K (J, n, n) per unit, on modes of `stiffness` K_ff (n,); SI units.

    `support`: where the inner joint carries the link; rotations that the joint leaves free are 0 there.
    """

    f: Array
    K: Array
    stiffness: Array
    points: tuple[LoadedPoint, ...] = ()
    support: LoadedPoint | None = None

    @cached_property
    def relative(self) -> Array:
        """Matrices (J, n, n) K_ff^-½ K K_ff^-½, per unit of load, SI."""
        root = 1 / np.sqrt(self.stiffness)
        return self.K * root * root[:, None]

    @cached_property
    def squares(self) -> Array:
        """Squared Frobenius norms (T,), no unit, of K_ff^-½ S K_ff^-½, S = Σ f_j K_j."""
        flat = self.relative.reshape(len(self.K), -1)
        return np.maximum(((self.f @ (flat @ flat.T)) * self.f).sum(axis=1), 0.0)


def lasting(loads: ModalLoads, time: Array) -> ModalLoads:
    """Means of the loads at `time` (T,), s, over the link's lowest period: it cannot follow shorter loads.

    Loads below those that buckle the link are returned as they are.
    """
    if len(time) < 2 or not len(loads.stiffness) or stiffness_change(loads)[0] < 1.0:
        return loads
    half = min(np.pi / float(np.sqrt(loads.stiffness.min())), 0.5 * float(time[-1] - time[0]))
    impulse = np.vstack(
        [np.zeros(loads.f.shape[1]), np.cumsum(0.5 * np.diff(time)[:, None] * (loads.f[1:] + loads.f[:-1]), axis=0)]
    )
    middle = np.clip(time, time[0] + half, time[-1] - half)
    first, last = (np.array([np.interp(middle + side, time, of) for of in impulse.T]).T for side in (-half, half))
    return replace(loads, f=(last - first) / (2 * half))


@kept
def stiffness_change(loads: ModalLoads) -> tuple[float, float]:
    """The largest relative change |μ| of stiffness by the loads of a run, and −μ of the lowest μ.

    The latter is the ratio of loads to buckling loads, exact from 1 on; 0 where no loads soften the link.
    """
    largest, lowest = 0.0, 0.0
    for bound, mu in _eigenvalues(loads):
        largest, lowest = max(largest, float(np.abs(mu).max())), min(lowest, float(mu.min()))
        if bound <= largest and bound <= max(1.0, -lowest):
            break
    return largest, -lowest


def _eigenvalues(loads: ModalLoads) -> Iterator[tuple[float, Array]]:
    """μ (…, n) of some outputs, and a bound of |μ| at all others: largest Frobenius norms of S first."""
    if not loads.f.size or not len(loads.stiffness):
        return
    f, K, squares = loads.f, loads.relative, loads.squares
    known = np.flatnonzero(np.isfinite(squares))
    order = known[np.argsort(-squares[known])]
    norms = np.append(np.sqrt(squares[order]), 0.0)
    for start in range(0, len(order), AT_ONCE):
        some = order[start : start + AT_ONCE]
        yield float(norms[start + len(some)]), np.linalg.eigvalsh(np.tensordot(f[some], K, axes=1))


OUTPUTS = 64  # at which Δp is found: those with the largest ‖S‖ ‖p‖, and as many with the largest ‖p‖
IN_MOTION = 2.0  # times what is missed at rest: loads that come at once


class Missing(NamedTuple):
    """Estimated errors of one link: of points by its length, and of deflections and forces by their peaks."""

    of_length: float
    of_deflections: float

    def grown_to(self, worst: "Missing") -> "Missing":
        """Errors raised in proportion to those of the `worst` link, `of_length` at most to its own."""
        if not 0.0 < self.of_deflections < worst.of_deflections:
            return self
        in_proportion = self.of_length / self.of_deflections * worst.of_deflections
        return Missing(max(self.of_length, min(in_proportion, worst.of_length)), worst.of_deflections)


def missing_to_first_order(link: ModalBody, T: Array, p: Array, loads: ModalLoads, *, is_at_rest: bool) -> Missing:
    """The errors of a link without geometric stiffening; infinite if loads at rest buckle it.

    p (outputs, n), √kg·m, are modal coordinates of the equations; T (n_file, n), no unit, times them those of the file.
    """
    if not len(p) or not loads.f.size:
        return Missing(0.0, 0.0)
    stations, places, length = link.stations.translation @ T, link.stations.position, link.length
    # Outputs whose Δp, or whose −½ pᵀK p, may be the largest
    energy = np.sqrt(p**2 @ loads.stiffness)
    sizes, count = (np.sqrt(loads.squares) * energy, energy), min(OUTPUTS, len(p))
    at = np.unique(np.concatenate([np.argpartition(-of, count - 1)[:count] for of in sizes]))
    S = np.tensordot(loads.f[at], loads.K, axes=1)
    stiffness = np.diag(loads.stiffness) + S
    if loads.support is not None:
        stations = stations - _carried(loads.support, loads.support.by_modes, places)
    whole = _largest(p, stations)
    if np.linalg.eigvalsh(stiffness)[:, 0].min() <= 0.0:  # buckles for good, or for a moment
        return Missing(np.inf, np.inf) if is_at_rest else Missing(whole / length, 1.0)
    change = -np.linalg.solve(stiffness, np.einsum("tmn,tn->tm", S, p[at])[:, :, None])[:, :, 0]
    change *= 1.0 if is_at_rest else IN_MOTION
    missed = _largest(change, stations)
    of_support = None if loads.support is None else _moved(loads.support, p[at], change)
    for point in loads.points:
        moved = _moved(point, p[at], change)[:3]
        if loads.support is not None and of_support is not None:
            moved = moved - _carried(loads.support, of_support, point.position[None])[0]
        missed = max(missed, float(np.linalg.norm(moved, axis=0).max()))
    return Missing(missed / length, min(1.0, missed / whole) if whole else 0.0)


def _moved(point: LoadedPoint, p: Array, change: Array) -> Array:
    """(6, T) ΦΔp − ½ pᵀK p of p and Δp (T, n)."""
    return point.by_modes @ change.T - 0.5 * ((p @ point.K) * p).sum(axis=2)


def _carried(support: LoadedPoint, moved: Array, places: Array) -> Array:
    """What a section that is `moved` (6, m) does to points at `places` (k, 3) that it carries: (k, 3, m)."""
    arms = places - support.position
    return moved[:3] + np.cross(moved[3:].T, arms[:, None]).swapaxes(1, 2)


def missing_to_second_order(link: ModalBody, p: Array, shortening: float, stiffness_change: float) -> Missing:
    """The errors of a link with geometric stiffening at p (T, n), √kg·m, of the file.

    By its displacement, `shortening` (by its length), rotations (twist from the root on, bending from the chord), and
    the relative `stiffness_change`.
    """
    if stiffness_change >= 1.0:
        return Missing(np.inf, np.inf)
    stations, x = link.stations, link.stations.position[:, 0]
    chord = (stations.translation[-1] - stations.translation[0]) / (x[-1] - x[0])
    shapes = stations.rotation - np.stack([stations.rotation[0, 0], -chord[2], chord[1]])  # (k, 3, n)
    squares = sum(_largest(p, shapes[:, [k]]) ** 2 for k in range(3))
    of_deflections = squares / 3 / (1 - stiffness_change) ** 2
    displacement = largest_displacement(link, p)
    return Missing(min(of_deflections * displacement, shortening / 2), min(1.0, of_deflections))


def largest_displacement(link: ModalBody, p: Array) -> float:
    """The largest displacement of stations over p (T, n), √kg·m, of the file, relative to the length."""
    return _largest(p, link.stations.translation) / link.length


def _largest(p: Array, shapes: Array) -> float:
    """The largest |shape · p|, m or rad, of k `shapes` (k, axes, n) over p (T, n), √kg·m."""

    def largest_of(rows: Indices) -> float:  # one shape after the other: all at once may not fit into memory
        at = p[rows].T
        return float(np.sqrt(np.max([((shape @ at) ** 2).sum(axis=0).max(initial=0.0) for shape in shapes])))

    return largest_below(np.abs(p) @ np.linalg.norm(shapes, axis=1).max(axis=0), largest_of)


NOTABLE_STIFFNESS_CHANGE = 0.01  # relative, of a link, from which on "auto" switches geometric stiffening on
DEFLECTION_LIMIT = {False: 0.02, True: 0.05}  # of the length, from the chord; without and with geometric stiffening
SHORTENING_LIMIT = {False: 1e-3, True: 1e-2}  # of the length: a half wave at 2 %; where the second order ends
USELESS = 0.1  # of the length, in the position of points
ENOUGH = 1e-3  # shortening of a piece by bending: tips are then right to some 1e-4 of the length (docs/theory.md)


@struct
class Bending:
    """Largest values of one flexible link over a run."""

    deflection: float  # distance of its axis from its chord, by its length
    rotation: float  # angle between a section's normal and the chord, rad
    foreshortening: float  # ½∫w'² dx over its length, in its own frame, m
    # N·m, foreshortening times the largest force at an interface at the same time: the error of moments
    foreshortening_moment: float
    # by the loads of the run, relative, of the shape where it is largest; NaN without data in the modal body
    stiffness_change: float
    length: float  # m, of the link
    is_stiffened: bool  # whether geometric stiffening is in the equations
    missing: Missing  # estimated errors
    pieces: int = 1  # number of pieces of the link; the values are then those of its worst piece
    is_divisible: bool = False  # whether the scene lets it be divided
    buckling: float = 0.0  # ratio of loads to those under which the link buckles, exact from 1 on

    @property
    def shortening(self) -> float:
        """The foreshortening by the length."""
        return self.foreshortening / self.length

    @property
    def is_beyond(self) -> bool:
        """Whether the link exceeds a limit of small deformations."""
        return (
            self.deflection > DEFLECTION_LIMIT[self.is_stiffened]
            or self.shortening > SHORTENING_LIMIT[self.is_stiffened]
            or (not self.is_stiffened and self.stiffness_change > NOTABLE_STIFFNESS_CHANGE)
            or self.buckling >= 1.0
        )

    @property
    def in_words(self) -> str:
        """Text on deflection, change of stiffness and buckling."""
        stiffening = "with geometric stiffening" if self.is_stiffened else "geometric stiffening is off"
        many = f"{self.buckling:.3g} times those under which it buckles, if they keep their directions"
        times = f" and are {many}" if self.buckling >= 1.0 else ""
        return (
            f"bends by {_percent(self.deflection)} of its length, loads change its stiffness by"
            f" {_percent(self.stiffness_change)}{times} ({stiffening})"
        )

    @property
    def estimate(self) -> str:
        """Estimated errors of results as text."""
        if self.missing.of_length > USELESS:
            return "results may be entirely wrong"
        return (
            f"points may be off by {_percent(self.missing.of_length)} of its length, deflections and moments by"
            f" {_percent(self.missing.of_deflections)} of their peaks"
        )

    @property
    def advice(self) -> str:
        """Text with a remedy: geometric stiffening, or division of the link."""
        if not self.is_stiffened and self.shortening <= SHORTENING_LIMIT[True]:
            return "consider geometric_stiffening = true"
        if not self.is_divisible:
            return "divide the link into shorter ones, welded"
        if self.missing.of_length > USELESS:  # it does not really bend as far as this run says
            return 'divide the link: pieces = "auto" in its [[body]]'
        return f"divide the link: pieces = {enough_pieces(self.shortening, self.pieces)} in its [[body]]"


def enough_pieces(shortening: float, count: int) -> int:
    """The number of pieces, 2 or more, with which each shortens by at most `ENOUGH` of its length.

    The relative `shortening` of a link in `count` pieces falls with the square of their number.
    """
    return max(2, ceil(count * sqrt(shortening / ENOUGH)))


def link_bending(run: Run, links: Mapping[str, ModalBody]) -> dict[str, Bending]:
    """The measures of deflection of flexible bodies by name; `links` are their modal bodies."""
    loads = loads_in_equations(run, links) if len(run.time) else {}
    return {
        name: _bending_of(run, name, link, loads[name].sizes if name in loads else {}) for name, link in links.items()
    }


def _bending_of(run: Run, name: str, link: ModalBody, sizes: Mapping[str, Array]) -> Bending:
    """Of one link under loads of `sizes` (T,) by the names of `fe_models.modal_body.unit_loads`."""
    node = node_of(run, name)
    body, T, own = node.body, node.body.modal_transform, run.q[:, node.p_q]
    p, force = own @ T.T, np.zeros(len(own))
    for point in body.points:
        parts = [sizes[load] for axis in "xyz" if (load := f"force/{point}/{axis}") in sizes]
        force = np.maximum(force, np.linalg.norm(parts, axis=0)) if parts else force
    deflection, rotation, shortening = shape_from_chord(link, p)
    s, moment = (float(x.max(initial=0.0)) for x in (shortening, force * shortening))
    unknown = 0.0 if link.geometric_stiffness or not body.n_modes else np.nan
    change, buckling, missing = unknown, 0.0, Missing(unknown, unknown)
    if body.n_modes and link.geometric_stiffness:
        on_modes = lasting(_on_modes(link, run, node, sizes), run.time)
        change, buckling = stiffness_change(on_modes)
        if body.stiffening is not None:
            missing = missing_to_second_order(link, p, s / link.length, change)
        else:
            missing = missing_to_first_order(link, T, own, on_modes, is_at_rest=run.is_at_rest)
    return Bending(
        deflection=deflection / link.length,
        rotation=rotation,
        foreshortening=s,
        foreshortening_moment=moment,
        stiffness_change=change,
        length=link.length,
        is_stiffened=body.stiffening is not None,
        missing=missing,
        buckling=buckling,
    )


def _on_modes(link: ModalBody, run: Run, node: Node, sizes: Mapping[str, Array]) -> ModalLoads:
    """Loads of `sizes` (T,) of which the file has a geometric stiffness, whether it is in the equations or not."""
    T, n = node.body.modal_transform, len(node.body.stiffness)
    K = {load: T.T @ of_load @ T for load, of_load in link.geometric_stiffness.items()}
    known = [load for load in sizes if load in K]
    f = np.stack([sizes[load] for load in known], axis=1) if known else np.zeros((0, 0))
    points = {
        point: LoadedPoint(
            at.position,
            at.motion @ T,
            np.stack([K.get(load, np.zeros((n, n))) for load in interface_load_names([point])]),
        )
        for point, at in link.interfaces.items()
        if all(f"force/{point}/{axis}" in K for axis in "xyz")
    }
    support = points.get(node.outer.point)
    if support is not None:
        # Of rotations at the joint what is left without those that it is free to, unless trajectories prescribe them
        counts, axis = np.eye(6), node.outer.triad[:, 2:]
        along = [row for row in run.model.rows if row.is_trajectory and row.kind == "coordinate"]
        free = (node.joint.guess_units or node.joint.units).count("rad")
        if free and node.joint.name not in map(run.model.joint_of, along):
            counts[3:, 3:] = np.eye(3) - axis @ axis.T if free == 1 else 0.0
        support = LoadedPoint(support.position, counts @ support.by_modes, np.tensordot(counts, support.K, axes=1))
    K_known = np.array([K[load] for load in known]).reshape(-1, n, n)
    return ModalLoads(f, K_known, node.body.stiffness, tuple(points.values()), support)


def shape_from_chord(link: ModalBody, p: Array) -> tuple[float, float, Array]:
    """The largest deflection (m) and section rotation (rad) from the chord, and foreshortening (T,), m.

    At p (T, n), √kg·m, of the file. Slopes along y and z: v' = φ_z, w' = −φ_y.
    """
    stations, x = link.stations, link.stations.position[:, 0]
    shares = 0.5 * (np.append(np.diff(x), 0.0) + np.append(0.0, np.diff(x)))  # of the length, by the trapezoidal rule
    across, slopes = stations.translation[:, 1:], stations.rotation[:, [2, 1]] * [[1.0], [-1.0]]  # (stations, 2, n)
    chord = (across[-1] - across[0]) / (x[-1] - x[0])
    off = across - across[0] - (x - x[0])[:, None, None] * chord
    G = np.einsum("k,kan,kam->nm", shares, slopes, slopes)
    return _largest(p, off), _largest(p, slopes - chord), 0.5 * ((p @ G) * p).sum(axis=1)


def largest(bodies: Mapping[str, Bending]) -> tuple[str, Bending] | None:
    """Name and measures of the link with the worst results, beyond small deformations first; None without links."""
    return max(bodies.items(), key=lambda item: (item[1].is_beyond, item[1].missing.of_length), default=None)


def deflection_warning(bodies: Mapping[str, Bending]) -> str:
    """The warning on links that bend too much; empty if none does."""
    worst = largest(bodies)
    if worst is None or not worst[1].is_beyond:
        return ""
    name, link = worst
    return f"{name} {link.in_words}: {link.estimate}; {link.advice}"


def _percent(value: float) -> str:
    if np.isnan(value):
        return "an unknown share"
    return f"{100 * value:.0f} %" if value >= 1.0 else f"{100 * value:.2g} %"


TURN = 2 * np.pi
LEAST = 1e-9  # of the robot's size, or rad: constraints that are off by less are met


def doubts(run: Run, tolerance: float) -> Iterator[str]:
    """Yield doubts about a motion computed to `tolerance`: unmet constraints, ambiguous turns and angles."""
    yield from _violated(run, max(tolerance, LEAST))
    for one, of_cut in cut_motions(run):
        if not of_cut.is_counted:
            yield (
                f"{one.joint.label}: outputs are too far apart to count the turns of its coordinate, which may be off"
                " by whole turns: the loop is cut at this joint; choose a smaller output_step"
            )
    for joint in run.model.scene.joint:
        if max(map(abs, joint.rpy)) > TURN:
            angles = ", ".join(f"{angle:g}" for angle in joint.rpy)
            yield f'{joint.label}: rpy = [{angles}] rad is more than a turn (degrees are written "90*deg")'


def _violated(run: Run, allowed: float) -> Iterator[str]:
    """The constraint that is violated most, where that is more than `allowed`, of the robot's size or rad."""
    if not run.model.rows or not len(run.time):
        return
    C = np.abs(constraint_rows(run)[0])
    is_way = np.array([run.model.measures_way(row) for row in run.model.rows])
    share = np.where(is_way, C / _extent(run), C)
    at, k = np.unravel_index(int(np.argmax(share)), share.shape)  # the first NaN, if there is one
    if not share[at, k] <= allowed:
        row = run.model.rows[k]
        yield (
            f'{"trajectory" if row.is_trajectory else "joint"} "{row.owner}" is violated by {C[at, k]:.3g}'
            f" {'m' if is_way[k] else 'rad'} at t = {run.time[at]:.6g} s: the result is not a motion of this robot;"
            " choose a smaller tolerance or another integrator"
        )


def _extent(run: Run) -> float:
    """A length (m) of the robot: its largest body, or the space in which its bodies move."""
    origins = np.concatenate([places(run).frame(number).r for number in range(len(run.model.tree.nodes))])
    bodies = [
        np.ptp([at.position for at in node.body.points.values()], axis=0)
        for node in run.model.tree.nodes
        if node.body.points
    ]
    return max(float(np.linalg.norm(size)) for size in (*bodies, np.ptp(origins, axis=0))) or 1.0
