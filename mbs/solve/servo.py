"""A path as a servo constraint whose force enters through the joint motors alone: its equations and their zeros.

With p(t) given all frames follow, and r(t, p, ṗ, p̈) = 0 is what is left: the internal dynamics (Blajer and
Kolodziejczyk 2004; Seifried 2014, ch. 4). It is the zero dynamics about a path that is held.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Booleans, ComplexArray, as_floats, as_list
from ...common.errors import InputError, SolveError
from .. import _core
from .._core import TimeFunction
from ..joints.measure import Measure
from ..model.model import ZERO, Constraint, Model
from ..model.system import MechanismSystem
from .initial_state import undeformed_state
from .internal_dynamics import Evaluator, Output, Target
from .reach import REACH_CHECKS, Followed, check_reach

MOST_ITERATIONS = 50
TOLERANCE = 1e-12  # of an equilibrium's last Newton step
CENTRE = 1e-6  # |Re s| / |s| of zeros that count as undamped
SINGULAR = 1e-13  # of M of the internal dynamics, scaled


@dataclass(frozen=True)
class Servo:
    """The robot under its path, and under its motors; `factor` 1 takes the path's own points as output.

    A smaller factor takes where they would be with the same motor coordinates and the deflections `factor` p +
    `offset`, which is what is expected of the rest.
    """

    path: MechanismSystem
    driven: MechanismSystem
    factor: float
    near: Followed  # coordinates (R, θ, p) along the path, without deflections, that positions are found from
    loads: tuple[tuple[Measure, TimeFunction], ...]  # of the scene, held before and after the path as it is
    offset: tuple[TimeFunction, ...] = ()  # one for each mode of all bodies, or none

    def core(self) -> _core.ServoConstraint:
        """The evaluator of r(t, p, ṗ, p̈)."""
        order = [c.owner for c in self.driven.constraints]
        numbers = [order.index(motor_owner(name)) for name in self.path.model.motors]
        return _core.ServoConstraint(
            self.path.system, self.path.motor_measures, self.driven.system, numbers, self.factor, list(self.offset),
            as_list(self.near.times), self.near.q,
        )  # fmt: skip

    def resolver(self) -> _core.ActuatorForces:
        """What reads the motors' forces off the multipliers."""
        return _core.ActuatorForces(self.driven.system, self.driven.is_trajectory, self.driven.motor_measures)

    def source(self, shape: list[list[TimeFunction]]) -> _core.ActuationSource:
        """The motors' forces for p(t), at any time."""
        return _core.ServoActuation(self.driven.system, self.core(), shape, self.driven.is_trajectory, self.resolver())

    @property
    def scale(self) -> Array:
        """Frequencies ω of all modes (n,), rad/s."""
        omega: Array = np.sqrt(np.concatenate([body.stiffness for body in self.path.model.bodies]))
        return omega

    @property
    def scene_path(self) -> Path:
        """Of the scene, for messages."""
        return self.path.model.scene.path

    @property
    def mode_counts(self) -> list[int]:
        """By body."""
        return [body.n_modes for body in self.path.model.bodies]

    def targets(self) -> Iterator[Target]:
        """What the path follows."""
        for constraint in self.path.model.trajectories:
            yield Target(constraint.owner, constraint.component, constraint.target)

    def with_factor(self, factor: float) -> Servo:
        """The same with another factor."""
        return replace(self, factor=factor)

    def with_offset(self, offset: tuple[TimeFunction, ...]) -> Servo:
        """The same with what is expected of the deflections that the output leaves out."""
        return replace(self, offset=offset)


def motor_owner(joint: str) -> str:
    """What the constraint on a motor's coordinate is listed under."""
    return f'motor of joint "{joint}"'


def make_servo(model: Model, end: float, factor: float) -> Servo:
    """The equations for a path that is held before 0 and after `end`.

    Raises `InputError` unless there are as many motors and specified components as degrees of freedom, and modes, and
    for a path that the undeformed robot cannot follow.
    """
    for found, what in ((len(model.motors), "motors"), (len(model.trajectories), "trajectory components")):
        if found != model.degrees_of_freedom:
            raise InputError(
                f'{model.scene.path}: expected for kind = "motors-only" as many {what} as the mechanism has degrees of'
                f" freedom ({model.degrees_of_freedom}), found {found}"
            )
    if not any(body.n_modes for body in model.bodies):
        raise InputError(
            f'{model.scene.path}: expected at least one flexible body for kind = "motors-only", found only rigid ones:'
            ' kind = "pcid" gives their motors\' forces'
        )
    rows = list(model.motors.values())
    held = [Constraint(c.measure, c.target.held(0.0, end), c.owner, c.component, True) for c in model.trajectories]
    motors = [Constraint(row, ZERO, motor_owner(name), "value", True) for name, row in model.motors.items()]
    loads = tuple((row, size.held(0.0, end)) for row, size in model.loads)
    path = MechanismSystem(model, [*model.joints, *held], loads, rows)
    driven = MechanismSystem(model, [*model.joints, *motors], loads, rows)
    near = check_reach(path, undeformed_state(path), as_floats(np.linspace(0.0, end, REACH_CHECKS)))
    return Servo(path, driven, factor, near, loads)


@dataclass(frozen=True)
class LinearDynamics:
    """M δp̈ + D δṗ + K δp = 0 of the internal dynamics at `times` (N,): each (N, n, n)."""

    times: Array
    M: Array
    D: Array
    K: Array

    def __call__(self, times: Array) -> tuple[Array, Array, Array]:
        """M, D, K at any times, straight lines between those that are known."""
        right = np.clip(np.searchsorted(self.times, times), 1, len(self.times) - 1)
        left = right - 1
        width = self.times[right] - self.times[left]
        share = np.clip((times - self.times[left]) / width, 0.0, 1.0)[:, None, None]
        M, D, K = ((1 - share) * x[left] + share * x[right] for x in (self.M, self.D, self.K))
        return M, D, K


def linear_dynamics(core: Evaluator, times: Array, p: Array, v: Array, a: Array) -> LinearDynamics:
    """Derivatives of r at N nodes: times (N,), p, ṗ, p̈ (N, n)."""
    n = p.shape[1]
    found = core.derivatives(as_list(times), p, v, a)
    M, D, K = (x.reshape(-1, n, n) for x in (found.M, found.D, found.K))
    return LinearDynamics(times, M, D, K)


def equilibrium(servo: Output, core: Evaluator, t: float) -> Array:
    """Shape p (n,) at rest under path and loads as at time t. Raises `SolveError` where there is none."""
    p: Array = np.zeros((1, len(servo.scale)))
    rest = np.zeros_like(p)
    for _ in range(MOST_ITERATIONS):
        r = core.residuals([t], p, rest, rest)[0]
        K = linear_dynamics(core, np.array([t]), p, rest, rest).K[0]
        if not (np.all(np.isfinite(r)) and np.all(np.isfinite(K))):
            break
        step = np.linalg.solve(K, r)
        p = p - step
        if np.linalg.norm(step) <= TOLERANCE * (np.linalg.norm(p) + 1e-12):
            return np.asarray(p[0])
    raise SolveError(
        f"{servo.scene_path}: no equilibrium under the motors was found at t = {t:g} s: the links are too"
        " soft for their loads there"
    )


def first_order(dynamics: LinearDynamics, k: int, scale: Array) -> Array:
    """Matrix (2n, 2n) of ẏ = 𝒜 y for y = (ω p, ṗ), at node k."""
    n = len(scale)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.diag(scale)
    A[n:, :n] = -np.linalg.solve(dynamics.M[k], dynamics.K[k] / scale)
    A[n:, n:] = -np.linalg.solve(dynamics.M[k], dynamics.D[k])
    return A


def zeros(dynamics: LinearDynamics, scale: Array) -> ComplexArray:
    """Zeros (N, 2n) from motors to path, 1/s, of the equations frozen at each node; the slowest first."""
    s = np.linalg.eigvals(np.array([first_order(dynamics, k, scale) for k in range(len(dynamics.times))]))
    found: ComplexArray = np.take_along_axis(s, np.argsort(np.abs(s), axis=1, kind="stable"), axis=1)
    return found


def is_unstable(s: ComplexArray) -> Booleans:
    """Zeros in the right half plane, beyond rounding."""
    return s.real > CENTRE * np.abs(s)
