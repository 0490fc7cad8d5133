"""What a tracking problem asks for, a transition from rest to rest within limits, and the motion that answers it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Literal

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from ..inversion.servo import Servo
from ..model.amplifiers import Amplifiers
from ..run.record import GearCurve
from .geared import Gears
from .interior_point import Minimum
from .path_error import Tolerance, displaced_at, rows_of_points

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

Objective = Literal["effort", "least-voltage", "least-current", "least-torque"]

RATE = 0.005  # s, T_r where nothing is said
RATE_BEHIND_GEARS = 0.002  # s, the same where gears give


@struct
class Limits:
    """Limits of m patches, V, and of motors (motors,), N·m or N; infinite if none."""

    patches: Amplifiers
    torque: Array


@struct
class Weights:
    """τ_ref (N·m), V_ref (V) and T_r (s)."""

    torque: float
    voltage: float
    rate: float


@struct
class Transition:
    """Boundary conditions: `rest` is p at both ends; `is_free` whether V, or V̈, may start and end at any value.

    `rate` is that of the slowest zero, 1/s: voltages matter less by e^{−rate t} at the time t from the nearer end.
    """

    driven: Servo
    Phi_V: Array  # (n, m)
    limits: Limits
    weights: Weights
    rest: tuple[Array, Array]
    objective: Objective = "effort"
    is_free: bool = False
    rate: float = 0.0
    gears: Gears | None = None  # those that give; V then begins and ends at zero, with its rate
    tolerance: Tolerance | None = None  # within which points may leave their path; e = ė = 0 at both ends

    @property
    def order(self) -> int:
        """Order of the derivative of the voltages V(t) that is linear between breaks."""
        return 0 if self.gears is None else 2

    def driven_at(self, times: Array, error: PPoly | None) -> Servo:
        """The robot at ascending `times` (T,), s, on its path with this error, m."""
        if error is None:
            return self.driven
        return displaced_at(self.driven, times, np.array([error(times, order) for order in range(3)]))

    @property
    def allowed(self) -> float:
        """Largest path error, m."""
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
        """Smallest and largest values (2, …) by which shares count: limits, or sizes where there are none."""
        of, weights = self.limits.patches, self.weights
        rate = np.full_like(of.slew, weights.voltage / (weights.rate or RATE))
        both = np.array([[-1.0], [1.0]])
        pairs = {
            "voltage": (of.range, both * np.full_like(of.slew, weights.voltage)),
            "slew": (both * of.slew, both * rate),
            "current": (both * of.current, both * rate * of.capacitance),
            "torque": (both * self.limits.torque, both * np.full_like(self.limits.torque, weights.torque)),
        }
        ranges = {name: np.where(np.isfinite(limit), limit, size) for name, (limit, size) in pairs.items()}
        if self.tolerance is not None:
            each = both * np.ones(self.errors)
            ranges |= {"error": self.tolerance.error * each, "curving": self.tolerance.acceleration * each}
        return ranges


@struct
class Tracked:
    """p(t) and V(t) as piecewise polynomials, and how they were found."""

    curve: PPoly
    voltage: PPoly
    converged: bool
    iterations: int
    share: float  # σ, the least share of limits (`objective` "least-…"), or of V_ref or τ_ref where there are none
    cost: float  # J; 0 where it is not the objective
    # by how much less J, or σ, is for limits that are wider by one: "voltage", "slew" and "current" of patches (m,),
    # 1/V, s/V, 1/A, and "torque" of motors (motors,) 1/(N·m) or 1/N; zero where a limit is not reached
    prices: dict[str, Array]
    objective: Objective  # what was made small
    # largest force on modes that nobody supplies between Gauss points, relative to the largest elastic one
    unmet: float = np.nan
    # step, found: the last Newton step, relative, and its minimum; the next step is about the square of it
    step: float = np.inf
    found: Minimum | None = None
    added: float = 0.0  # what the effort adds to the objective "least-…"
    gears: Mapping[str, GearCurve] = field(default_factory=dict)  # by joint, behind which motors are
    error: PPoly | None = None  # e(t), m, of points that may leave their path
    # of the share, relative: twice its change by the last finer intervals, and what the effort may add
    doubt: float = np.inf

    @property
    def surely(self) -> float:
        """Lower bound of the share, within its uncertainty; 0 if that is unknown."""
        return max(0.0, self.share * (1.0 - self.doubt)) if np.isfinite(self.doubt) else 0.0
