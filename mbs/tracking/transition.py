"""What a tracking problem asks for, a transition from rest to rest within limits, and the motion that answers it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from typing import Literal

import numpy as np

from ...common.arrays import Array, Indices, PPoly
from ...common.structs import struct
from .._core import TimeFunction
from ..inversion.servo import PIECES, Servo, through
from ..model.amplifiers import Amplifiers
from ..run.record import GearCurve
from .geared import Gears
from .interior_point import Minimum

Objective = Literal["effort", "least-voltage", "least-current", "least-torque"]

TIME = 0.005  # s, T_e where nothing is said
NEAR = 1e-5  # of the robot's size: the displacement by which forces are differentiated
RATE = 0.005  # s, T_r where nothing is said
RATE_BEHIND_GEARS = 0.002  # s, the same where gears give


@struct
class Limits:
    """Limits of m patches, V, and of motors (motors,), N·m or N; infinite if none."""

    patches: Amplifiers
    torque: Array


@struct
class Weights:
    """Sizes that weigh equally in the effort: torque τ_ref (N·m), voltage V_ref (V), and time T_r = V/V̇ (s)."""

    torque: float
    voltage: float
    rate: float


@struct
class Tolerance:
    """Path tolerance of each coordinate of points, `error` (m) and `time` T_e (s): |e| ≤ error, |ë| ≤ error/T_e²."""

    error: float
    time: float = TIME

    @property
    def acceleration(self) -> float:
        """Largest |ë|, m/s²."""
        return self.error / self.time**2


def rows_of_points(servo: Servo) -> Indices:
    """Numbers (k,) of the k constraint equations that prescribe coordinates of points, m."""
    rows = servo.model.rows
    return np.flatnonzero([row.is_trajectory and row.kind == "point" and row.target is not None for row in rows])


@struct
class Transition:
    """A tracking problem: the robot on its path, `driven`, from rest to rest with m patches, within limits.

    `rest`: p (n,), m·√kg, at both ends; `is_free`: V, or V̈ with compliant gears, may start and end at any value.
    `rate`, 1/s, of the slowest zero: voltages matter less by e^{−rate t} at the time t from the nearer end.
    """

    driven: Servo
    Phi_V: Array  # (n, m) modal forces per voltage, N/(√kg·V)
    limits: Limits
    weights: Weights
    rest: tuple[Array, Array]
    objective: Objective = "effort"
    is_free: bool = False
    rate: float = 0.0
    gears: Gears | None = None  # compliant ones; V then begins and ends at zero, with its rate
    tolerance: Tolerance | None = None  # within which points may leave their path; e = ė = 0 at both ends

    @property
    def order(self) -> int:
        """Order of the derivative of the voltages V(t) that is linear between breaks."""
        return 0 if self.gears is None else 2

    @property
    def allowed(self) -> float:
        """Largest path error allowed, m."""
        return 0.0 if self.tolerance is None else self.tolerance.error

    @property
    def errors(self) -> int:
        """Number of coordinates with a path error."""
        return 0 if self.tolerance is None else len(rows_of_points(self.driven))

    @property
    def is_limited(self) -> bool:
        """Whether patches have limits of voltages."""
        return bool(np.isfinite(self.limits.patches.range).any())

    @property
    def units(self) -> Array:
        """Voltages (m,), V, that scale the unknowns: the larger of the two limits of each patch."""
        return np.abs(self.ranges["voltage"]).max(axis=0)

    @property
    def ranges(self) -> dict[str, Array]:
        """Least and largest values (2, …), SI units, by kind, to which shares refer: limits, or else `weights`."""
        of, weights, both = self.limits.patches, self.weights, np.array([[-1.0], [1.0]])
        rate = weights.voltage / (weights.rate or RATE)
        pairs = {
            "voltage": (of.range, both * weights.voltage),
            "slew": (both * of.slew, both * rate),
            "current": (both * of.current, both * rate * of.capacitance.diagonal()),
            "torque": (both * self.limits.torque, both * weights.torque),
        }
        ranges = {name: np.where(np.isfinite(limit), limit, size) for name, (limit, size) in pairs.items()}
        if self.tolerance is not None:
            each = both * np.ones(self.errors)
            ranges |= {"error": self.tolerance.error * each, "curving": self.tolerance.acceleration * each}
        return ranges


@struct
class Tracked:
    """Solution of a `Transition`: `curve` p(t) (n,), m·√kg, `voltage` V(t) (m,), V, and how they were found."""

    curve: PPoly
    voltage: PPoly
    converged: bool
    iterations: int
    share: float  # least share of limits (`objective` "least-…"), or of `Transition.weights` where none is set
    cost: float  # the effort, no unit; 0 where it is not the objective
    # decrease of effort or share per unit of limits, 0 of others: "voltage", "slew", "current" (m,), 1/V, s/V, 1/A,
    # "torque" (motors,), 1/(N·m) or 1/N, of points "error" and "curving" (its acceleration), 1/m, s²/m
    prices: dict[str, Array]
    objective: Objective
    # largest residual modal force between Gauss points, relative to the largest elastic one
    unmet: float = np.nan
    # step, found: the last Newton step relative to peaks, and its minimum
    step: float = np.inf
    found: Minimum | None = None
    added: float = 0.0  # part of the objective "least-…" that is effort
    gears: Mapping[str, GearCurve] = field(default_factory=dict)  # compliant ones, by joint
    error: PPoly | None = None  # e(t), m, of points that may leave their path
    # relative uncertainty of the share: twice its change by the last finer intervals, and what the effort may add
    doubt: float = np.inf

    @property
    def surely(self) -> float:
        """Lower bound of the share, by its uncertainty `doubt`; 0 if that is unknown."""
        return max(0.0, self.share * (1.0 - self.doubt)) if np.isfinite(self.doubt) else 0.0


def displaced_at(servo: Servo, times: Array, off: Array) -> Servo:
    """The robot with k `rows_of_points` off their paths by e, ė, ë: `off` (3, T, k), SI, only at `times` (T,), s."""
    times, first = np.unique(times, return_index=True)
    breaks, off = np.append(times, times[-1] + 1.0), off[:, first]

    def moved(target: TimeFunction, k: int) -> TimeFunction:
        y, rate, acceleration = target.sample(times) + off[:, :, k]
        return TimeFunction.polynomial(breaks, np.column_stack([0.5 * acceleration, rate, y]))

    return _with_targets(servo, moved)


def displaced_along(servo: Servo, error: PPoly) -> Servo:
    """The robot with coordinates of points off their paths by `error`(t) (k,), m, in the order of `rows_of_points`.

    The new paths are quintic pieces.
    """
    times = np.union1d(error.x, np.linspace(error.x[0], error.x[-1], PIECES + 1))
    off = np.array([error(times, order) for order in range(3)])
    return _with_targets(servo, lambda target, k: through(times, target.sample(times) + off[:, :, k]))


def forces_off_path(servo: Servo, times: Array, motion: Sequence[Array], off: Array) -> tuple[Array, Array]:
    """Residual modal forces and torques (T, n + torques) at `times` (T,), s, and slopes (3, T, n + torques, k).

    `off` (3, T, k): path errors e, ė, ë; `motion`: p, ṗ, p̈ (T, n); SI units. Slopes are by `off`, exact for ë.
    """
    now = np.hstack(displaced_at(servo, times, off).forces(times, *motion))
    slopes, size = np.zeros((3, *now.shape, off.shape[2])), NEAR * servo.model.size
    for order, step in enumerate((size, size / servo.end, size / servo.end**2)):
        for k in range(off.shape[2]):
            moved = off.copy()
            moved[order, :, k] += step
            there = displaced_at(servo, times, moved).forces(times, *motion)
            slopes[order, :, :, k] = (np.hstack(there) - now) / step
    return now, slopes


def _with_targets(servo: Servo, moved: Callable[[TimeFunction, int], TimeFunction]) -> Servo:
    rows = list(servo.model.rows)
    for k, number in enumerate(rows_of_points(servo)):
        if (target := rows[number].target) is not None:
            rows[number] = replace(rows[number], target=moved(target, k))
    return replace(servo, model=replace(servo.model, rows=tuple(rows)))
