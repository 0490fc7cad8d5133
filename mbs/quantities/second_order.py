"""What the equations of one link miss of bending and twist, estimated from its modal coordinates and its loads.

Loads of sizes f_j with geometric stiffness K_j change the stiffness of the modes by S = Σ f_j K_j, and move the points
of the link by −½ pᵀK p besides Φp. Without geometric stiffening both are missing: p is off by
Δp = −(K_ff + S)⁻¹ S p, a point by |ΦΔp − ½ pᵀK p|, as seen from the section that the inner joint carries.
With it, what is missing is of third order in the rotations θ of sections, θ²/3, and grows near buckling as 1/(1 − μ)²,
μ the largest relative change of stiffness. Measured against exact rods: docs/theory.md, Limits.

Loads couple modes, bending with twist most of all, so that the change of each mode alone says nothing of buckling. The
eigenvalues μ of K_ff^-½ S K_ff^-½ are the extreme relative changes of the stiffness of any shape; at −1 a shape has
none left (Bathe, Finite Element Procedures, §6.8.2, linearized buckling).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody

AT_ONCE = 64  # outputs whose eigenvalues are found together


class LoadedPoint(NamedTuple):
    """Interface at `position` (3,), m, with mode shapes (6, n) and stiffness K (6, n, n) by unit load there."""

    position: Array
    by_modes: Array
    K: Array


@struct
class ModalLoads:
    """Loads of sizes f (T, J) with geometric stiffness K (J, n, n), on modes of stiffness K_ff (n,), rad²/s².

    `support`: where the inner joint carries the link; rotations that the joint leaves free are 0 there.
    """

    f: Array
    K: Array
    stiffness: Array
    points: tuple[LoadedPoint, ...] = ()
    support: LoadedPoint | None = None

    @cached_property
    def relative(self) -> Array:
        """Matrices (J, n, n) K_ff^-½ K K_ff^-½."""
        root = 1 / np.sqrt(self.stiffness)
        return self.K * root * root[:, None]

    @cached_property
    def squares(self) -> Array:
        """Squared Frobenius norms (T,) of K_ff^-½ S K_ff^-½."""
        flat = self.relative.reshape(len(self.K), -1)
        return np.maximum(((self.f @ (flat @ flat.T)) * self.f).sum(axis=1), 0.0)


def lasting(loads: ModalLoads, time: Array) -> ModalLoads:
    """Return means of the loads at `time` (T,), s, over the link's lowest period: it cannot follow shorter ones.

    The loads themselves if they stay below those that buckle the link.
    """
    if len(time) < 2 or not len(loads.stiffness) or stiffness_change(loads)[0] < 1.0:
        return loads
    half = min(np.pi / float(np.sqrt(loads.stiffness.min())), 0.5 * float(time[-1] - time[0]))
    impulse = np.vstack(
        [np.zeros(loads.f.shape[1]), np.cumsum(0.5 * np.diff(time)[:, None] * (loads.f[1:] + loads.f[:-1]), axis=0)]
    )
    middle = np.clip(time, time[0] + half, time[-1] - half)
    ends = (np.array([np.interp(middle + side, time, of) for of in impulse.T]).T for side in (-half, half))
    first, last = ends
    return replace(loads, f=(last - first) / (2 * half))


def stiffness_change(loads: ModalLoads) -> tuple[float, float]:
    """Return the largest |μ| by the loads of a run, and −μ of the lowest, exact from 1 on: loads over buckling loads.

    The latter is 0 where no loads soften the link.
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
        S = np.tensordot(f[some], K, axes=1)
        yield float(norms[start + len(some)]), np.linalg.eigvalsh(S)


OUTPUTS = 64  # at which Δp is found: those with the largest ‖S‖ ‖p‖, and as many with the largest ‖p‖
IN_MOTION = 2.0  # times what is missed at rest: loads that come at once


class Missing(NamedTuple):
    """Estimated errors of one link: of points, of its length; of deflections and forces, of their peaks."""

    of_length: float
    of_deflections: float

    def grown_to(self, worst: Missing) -> Missing:
        """Scale to the `worst` link's error of deflections; that of points in proportion, but no more than its own."""
        if not 0.0 < self.of_deflections < worst.of_deflections:
            return self
        in_proportion = self.of_length / self.of_deflections * worst.of_deflections
        return Missing(max(self.of_length, min(in_proportion, worst.of_length)), worst.of_deflections)


class Rotations(NamedTuple):
    """Largest rotations of sections (rad): twist from the root on, about y and z from the chord."""

    twist: float
    bending_y: float
    bending_z: float


def missing_to_first_order(
    loads: ModalLoads, p: Array, stations: Array, places: Array, length: float, *, is_at_rest: bool
) -> Missing:
    """Return the errors of a link without geometric stiffening; infinite if loads at rest buckle it.

    p (T, n), √kg·m, are modal coordinates, `stations` (k, 3, n) translations of stations at `places` (k, 3), m, of a
    link with that `length`, m.
    """
    if not len(p) or not loads.f.size:
        return Missing(0.0, 0.0)
    # Outputs whose Δp, or whose −½ pᵀK p, may be the largest
    energy = np.sqrt((p**2 * loads.stiffness).sum(axis=1))
    sizes = np.sqrt(loads.squares) * energy, energy
    at = np.unique(np.concatenate([np.argsort(-of)[:OUTPUTS] for of in sizes]))
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


def missing_to_second_order(
    displacement: float, shortening: float, rotations: Rotations, stiffness_change: float
) -> Missing:
    """Return the errors of a link with geometric stiffening, from d and s (of its length), rotations and μ."""
    if stiffness_change >= 1.0:
        return Missing(np.inf, np.inf)
    of_deflections = sum(angle**2 for angle in rotations) / 3 / (1 - stiffness_change) ** 2
    return Missing(min(of_deflections * displacement, shortening / 2), min(1.0, of_deflections))


def largest_rotations(link: ModalBody, p: Array) -> Rotations:
    """Return the largest rotations of sections, rad, over p (T, n), √kg·m, of the file."""
    stations, x = link.stations, link.stations.position[:, 0]
    chord = (stations.translation[-1] - stations.translation[0]) / (x[-1] - x[0])
    shapes = stations.rotation - np.stack([stations.rotation[0, 0], -chord[2], chord[1]])  # (k, 3, n)
    return Rotations(*(_largest(p, shapes[:, [k]]) for k in range(3)))


def largest_displacement(link: ModalBody, p: Array) -> float:
    """Return the largest displacement of stations over p (T, n), √kg·m, of the file, relative to the length."""
    return _largest(p, link.stations.translation) / link.length


def _largest(p: Array, shapes: Array) -> float:
    """Largest length over p (T, n) of what moves by `shapes` (k, axes, n)."""
    return float(largest_lengths(p, shapes).max(initial=0.0))


def largest_lengths(p: Array, shapes: Array) -> Array:
    """Return the largest length (T,), m or rad, at p (T, n), √kg·m, of what moves by `shapes` (k, axes, n).

    One k after the other: all of them at once do not fit into memory in long runs.
    """
    squares = np.zeros(len(p))
    for shape in shapes:
        np.maximum(squares, ((shape @ p.T) ** 2).sum(axis=0), out=squares)
    return np.sqrt(squares)
