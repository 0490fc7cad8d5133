"""Stable depths of cut in the poses of a robot, `ffrobot map --milling`: by averaged forces, or semi-discretization.

The forces on the tool are F = a C(φ) (r(t) − r(t − τ)) with the depth of cut a, the tooth period τ and r = (x, y): x is
along the feed, y normal to it, and teeth turn from y to x. Averaged over φ, with the receptance G(iω) of r, vibration
at ω persists where 1 = a (1 − exp(−iωτ)) ν with an eigenvalue ν of C̄ G: a = 1/(2 Re ν) (Y. Altintas and E. Budak,
CIRP Annals 44, 1995).
"""

from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ..common.arrays import Array, ComplexArray
from ..common.errors import InputError
from ..common.libraries import scipy
from ..common.toml_files import load_toml
from ..common.validation import Record, validate
from ..mbs.fields.field_types import Direction, NotNegative, Positive, Quantity
from ..mbs.linear.joint_conditions import FreeCoordinates

MOST_SPEEDS = 1000
FEEDS = 12  # directions of feed within half a turn, beyond which forces are the same


def spread(given: object) -> object:
    """Return the evenly spaced numbers of a text "FIRST:LAST:COUNT"; anything else as it is."""
    if not isinstance(given, str):
        return tuple(given) if isinstance(given, list) else given
    try:
        first, last, count = given.split(":")
        if 1 <= int(count) <= MOST_SPEEDS:
            return tuple(np.linspace(float(first), float(last), int(count)).tolist())
    except ValueError:
        pass
    raise ValueError(f'expected a list, or "FIRST:LAST:COUNT" of at most {MOST_SPEEDS}, found "{given}"')


class Milling(Record):
    """A cutter, its cutting coefficients, and the engagement of its teeth."""

    teeth: Annotated[int, Field(ge=1, le=100)]
    """Number of teeth, straight and equally spaced."""
    tangential: Positive
    """Tangential cutting coefficient, N/m²."""
    radial: NotNegative
    """Radial cutting coefficient, N/m²."""
    entry: Quantity
    """Angle at which a tooth enters the cut, from the normal to the feed, rad: 0 of up milling."""
    exit: Quantity
    """Angle at which a tooth leaves the cut, rad: π of down milling."""
    axis: Direction = (0.0, 0.0, 1.0)
    """Axis of the tool, from the cut into the spindle, in the axes of the point (without own ones: global axes)."""
    feed: Direction | None = None
    """Direction of the feed of the tool in global axes; its part across the axis counts. Default: the worst one."""
    highest: Positive = 1000.0
    """Highest natural frequency, Hz, of modes that vibrate; modes above it are rigid."""
    speeds: Annotated[tuple[Positive, ...], BeforeValidator(spread), Field(max_length=MOST_SPEEDS)] = ()
    """Spindle speeds, rev/min, at which the stable depth is computed: a list, or "FIRST:LAST:COUNT"."""
    method: Literal["averaged", "semi-discretization"] = "averaged"
    """Method at these speeds: with averaged cutting forces, or with the forces of each angle, which takes longer."""

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if not 0.0 <= self.entry < self.exit <= np.pi + 1e-9:
            raise ValueError(f"expected 0 ≤ entry < exit ≤ π, found {self.entry:g} and {self.exit:g}")
        return self

    def mean_forces(self, first: Array, last: Array) -> Array:
        """Return means (…, 2, 2), N/m², of a tooth's force per depth of cut and displacement, along feed and normal.

        The means are over the tooth's angles from `first` to `last` (…), rad, within [0, 2π].
        """
        low, high = (np.clip(angle, self.entry, self.exit) for angle in (first, last))
        return (self._integral(high) - self._integral(low)) / np.asarray(last - first)[..., None, None]

    def _integral(self, angle: Array) -> Array:
        c, s, t, r = np.cos(2 * angle), np.sin(2 * angle), self.tangential, self.radial
        less, more = angle - s / 2, angle + s / 2  # of 1 − cos 2φ and 1 + cos 2φ
        rows = [[t * c / 2 - r * less, r * c / 2 - t * more], [t * less + r * c / 2, -t * c / 2 - r * more]]
        return 0.5 * np.moveaxis(np.array(rows), (0, 1), (-2, -1))

    @property
    def average(self) -> Array:
        """Mean C̄ (2, 2), N/m², over a turn: force of all teeth per depth and displacement, along feed and normal."""
        return self.teeth * self.mean_forces(np.array(0.0), np.array(2 * np.pi))

    def feeds(self, axes: Array) -> Array:
        """Return unit vectors (n, 2, 3), global axes, along n feeds and normal to each; feed × normal is the tool axis.

        `axes` (3, 3): rows are axes of the point, global axes. Raises `InputError` for a feed along the tool's axis.
        """
        axis = np.array(self.axis) @ axes / np.linalg.norm(self.axis)
        given = np.eye(3)[np.abs(axis).argmin()] if self.feed is None else np.array(self.feed)
        x = given - axis * (axis @ given)
        if (size := np.linalg.norm(x)) <= 1e-6 * np.linalg.norm(given):
            raise InputError("milling: feed: expected a direction across the axis of the tool", "one along it")
        x /= size
        angles = np.arange(FEEDS) * np.pi / FEEDS if self.feed is None else np.zeros(1)
        y, c, s = np.cross(axis, x), np.cos(angles)[:, None], np.sin(angles)[:, None]
        return np.stack([c * x + s * y, c * y - s * x], axis=1)


def read_milling(path: Path) -> Milling:
    """Read the process in the TOML file at `path`. Raises `InputError` for wrong keys."""
    return validate(Milling, load_toml(path, "milling file"), path)


def stable_depths(milling: Milling, free: FreeCoordinates, J: Array, axes: Array) -> dict[str, Array]:
    """Return stable depths of cut in a pose: `milling_depth`, m, without chatter at any speed, of the worst feed.

    J (d, f): displacements of the tip, global axes, by the f coordinates of which `free` are combinations; SI units.
    `axes` (3, 3): axes of the tip in rows. `milling_best_depth`, m, is of the best feed, `milling_feed` (3,).
    `milling_lobes` (S,), m, at S speeds: by averaged forces, of the worst feed at each, else that of `milling_depth`.
    """
    values, V = np.linalg.eigh((free.K + free.K.T) / 2)
    V = V[:, values < (2 * np.pi * milling.highest) ** 2]
    rows = np.pad(J @ free.N @ V, ((0, 3 - len(J)), (0, 0)))
    rows[np.abs(rows) < STILL] = 0.0
    tip, feeds = Tip(V.T @ free.K @ V, V.T @ free.D @ V, rows), milling.feeds(axes)
    omega, G = tip.response()
    limits = [stability_limits(milling.average, omega, across @ G @ across.T) for across in feeds]
    depths = np.array([one.least for one in limits])
    least = float(depths.min())
    found = {"milling_depth": least, "milling_best_depth": depths.max(), "milling_feed": feeds[depths.argmax(), 0]}
    if milling.speeds:
        speed, worst = np.array(milling.speeds) * 2 * np.pi / 60, tip._replace(J=feeds[depths.argmin()] @ tip.J)
        found["milling_lobes"] = (
            np.min([one.lobes(milling.teeth, speed) for one in limits], axis=0)
            if milling.method == "averaged" or not np.isfinite(least)
            else [limit_depth(worst, milling, float(each), (least / 10, least * 1000)) for each in speed]
        )
    return {name: np.asarray(value, dtype=float) for name, value in found.items()}


NEAREST, FARTHEST = 0.03, 10.0  # limits of distances from a mode: of half-bandwidths, and of its frequency
NEAR, FAR = 100, 250  # frequencies on each side, within a half-bandwidth and beyond it
LEAST = 1e-9  # damping ratio: without any, no depth is stable
FINE = 0.5  # rad, of the fastest mode in a step of semi-discretization
STEPS = (80, 400)  # of a tooth period, at least and at most
RISE = 1.25  # ratio of tried depths: above one with chatter may be others without
THINNEST = 1e-12  # m: below it no depth is stable
STILL = 1e-12  # 1/√kg: round-off of modes that do not move the tip


class Tip(NamedTuple):
    """Vibrations q̈ + D q̇ + K q = Jᵀ F, r = J q of a tip in n modes of unit mass: K, D (n, n), J (d, n), SI units."""

    K: Array
    D: Array
    J: Array

    def response(self) -> tuple[Array, ComplexArray]:
        """Return ω (F,), rad/s, dense about the modes, and G(iω) (F, d, d), m/N."""
        m = len(self.K)
        A = np.block([[np.zeros((m, m)), np.eye(m)], [-self.K, -self.D]])
        poles, V = np.linalg.eig(A)
        left = np.linalg.inv(V)[:, m:] @ self.J.T
        right = self.J @ V[:m]
        some = poles[(poles.imag >= 0.0) & (poles != 0.0)]  # real ones, too: strong damping leaves depths a limit
        size = np.abs(some)
        bandwidth = np.maximum(np.abs(some.real), LEAST * size)
        near = np.geomspace(NEAREST * bandwidth, bandwidth, NEAR)
        off = np.concatenate([near, np.geomspace(bandwidth, FARTHEST * size, FAR)])
        omega = np.concatenate([size - off, size + off]).ravel()
        omega = np.unique(omega[omega > 0.0])
        residues = right.T[:, :, None] * left[:, None, :]
        return omega, np.tensordot(1.0 / (1j * omega[:, None] - poles), residues, axes=1)


class StabilityLimits(NamedTuple):
    """Depths (F, k), m, at the edge of stability with chatter at `omega` (F,), rad/s, for each of k eigenvalues.

    Infinite where there is none. `phase` (F, k), rad: ωτ between 0 and 2π there, with the tooth period τ.
    """

    omega: Array
    depth: Array
    phase: Array

    @property
    def least(self) -> float:
        """Largest depth, m, without chatter at any spindle speed."""
        return float(self.depth.min(initial=np.inf))

    def lobes(self, teeth: int, speed: Array) -> Array:
        """Return the lowest depths (S,), m, of all lobes of a cutter with `teeth` at spindle speeds (S,), rad/s."""
        found = np.full(len(speed), np.inf)
        turned = 2 * np.pi * self.omega / (teeth * speed[:, None])  # ωτ
        for depth, phase in zip(np.where(np.isfinite(self.depth), self.depth, 0.0).T, self.phase.T, strict=True):
            first = (turned[:, :-1] - phase[:-1]) / (2 * np.pi)  # whole where a lobe is
            rise = (np.diff(turned) - ((np.diff(phase) + np.pi) % (2 * np.pi) - np.pi)) / (2 * np.pi)
            low, high = np.minimum(first, first + rise), np.maximum(first, first + rise)
            crossed = (depth[:-1] * depth[1:] > 0.0) & (np.ceil(low) <= high)
            least_first = (rise > 0.0) == (np.diff(depth) > 0.0)  # of several lobes between two frequencies
            lobe = np.where(least_first, np.ceil(low), np.floor(high))
            share = (lobe - first) / np.where(crossed & (rise != 0.0), rise, 1.0)
            between = depth[:-1] + share * np.diff(depth)
            found = np.minimum(found, np.where(crossed, between, np.inf).min(axis=1, initial=np.inf))
        return found


def stability_limits(C: Array, omega: Array, G: ComplexArray) -> StabilityLimits:
    """Return edges of stability for averaged forces `C` (d, d), N/m², by receptances G (F, d, d), m/N, at `omega`.

    `omega` (F,): angular frequencies, rad/s.
    """
    nu = _eigenvalues(C @ G)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(nu.real > 0.0, 0.5 / nu.real, np.inf)
        delayed = 1.0 - 1.0 / (depth * nu)  # exp(−iωτ)
    return StabilityLimits(omega, depth, -np.angle(delayed) % (2 * np.pi))


def _eigenvalues(A: ComplexArray) -> ComplexArray:
    """Eigenvalues (F, d) of matrices (F, d, d), d ≤ 2, in an order in which each changes least from one to the next."""
    if A.shape[1] == 1:
        return A[:, :, 0]
    mean, det = (A[:, 0, 0] + A[:, 1, 1]) / 2, A[:, 0, 0] * A[:, 1, 1] - A[:, 0, 1] * A[:, 1, 0]
    root = np.sqrt(mean**2 - det)
    values = np.stack([mean + root, mean - root], axis=1)
    kept, turned = (np.abs(values[1:] - other).sum(axis=1) for other in (values[:-1], values[:-1, ::-1]))
    is_turned = np.append(False, np.cumsum(turned < kept) % 2 == 1)
    return np.where(is_turned[:, None], values[:, ::-1], values)


def growth(tip: Tip, cutter: Milling, depth: float, speed: float) -> float:
    """Return the largest factor by which small vibrations grow in a tooth period, above 1 with chatter.

    By semi-discretization (T. Insperger and G. Stépán, Int. J. Numer. Meth. Engng 61, 2004). `depth` in m, `speed` of
    the spindle in rad/s. Raises `InputError` for too many waves in a tooth period.
    """
    (K, D, J), m, pitch = tip, len(tip.K), 2 * np.pi / cutter.teeth
    fastest = float(np.sqrt(np.abs(np.linalg.eigvals(K)).max(initial=0.0)))
    if (turned := fastest * pitch / speed) > FINE * STEPS[1]:
        raise InputError(
            f"milling: semi-discretization: expected modes within {FINE * STEPS[1]:g} rad of a tooth period",
            f"{turned:.4g} rad at {speed * 30 / np.pi:g} rev/min: lower the key highest, or average forces",
        )
    steps = max(STEPS[0], int(np.ceil(turned / FINE)))
    edges, angles = np.linspace(0.0, pitch, steps + 1)[:, None], pitch * np.arange(cutter.teeth)
    C = depth * cutter.mean_forces(edges[:-1] + angles, edges[1:] + angles).sum(axis=1)
    A = np.zeros((steps, 2 * m + 4, 2 * m + 4))  # of q, q̇, of r one period ago, and of its rise in a step
    A[:, :m, m : 2 * m], A[:, m : 2 * m, :m], A[:, m : 2 * m, m : 2 * m] = np.eye(m), J.T @ C @ J - K, -D
    A[:, m : 2 * m, 2 * m : -2] = -J.T @ C
    A[:, 2 * m : -2, -2:] = np.eye(2) * speed * steps / pitch
    start = np.eye(2 * m + 2 * (steps + 1))
    now, before = start[: 2 * m], deque(start[2 * m :].reshape(steps + 1, 2, -1), steps + 1)  # the newest r first
    for moved in scipy.linalg.expm(A * pitch / speed / steps)[:, : 2 * m]:
        rise = before[-3] - before[-2]
        # cubics, for few steps per wave
        first = (13 * (before[-2] + before[-3]) - before[-1] - before[-4]) / 24 - rise / 2
        before.appendleft(J @ now[:m])
        now = moved @ np.vstack([now, first, rise])
    return float(np.abs(np.linalg.eigvals(np.vstack([now, *before]))).max())


def limit_depth(tip: Tip, cutter: Milling, speed: float, bounds: Sequence[float]) -> float:
    """Return the least depth (m) between `bounds` (m) with chatter (`growth` above 1), to 1 %; infinite if none has.

    `speed` of the spindle in rad/s. With chatter at the lower bound, a depth below it; 0 below `THINNEST`.
    """
    low, high = map(float, bounds)
    while growth(tip, cutter, low, speed) > 1.0:
        low, high = low / 10, low
        if high < THINNEST:
            return 0.0
    while low < high and growth(tip, cutter, min(RISE * low, high), speed) <= 1.0:
        low *= RISE
    if low >= high:
        return np.inf
    high = RISE * low
    while high / low > 1.001:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if growth(tip, cutter, middle, speed) > 1.0 else (middle, high)
    return low
