"""A path whose force enters through the joint motors alone: see `zero_dynamics`."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...common.arrays import Array, Indices, in_parts
from ...common.errors import InputError
from ...common.libraries import scipy
from ...common.structs import struct
from .. import _core
from .._core import TimeFunction
from ..linear.statics import modal_sizes
from ..model.model import Model
from ..model.nodes import ConstraintRow
from ..model.system import driven_mechanism, fastest_mechanism
from ..posture.posture import check_smooth, describe_posture, mobility, worst_posture
from ..posture.prescribed import PrescribedMotion, following_motors, left_slopes
from ..posture.reach import out_of_reach
from ..posture.start import undeformed_posture

POSTURES = 201  # along the path, from which others are looked for
EVERY = 10  # of these is looked at for singular ones
PIECES = 400  # of a path that is slowed down
TINY = 1e-12  # of its time
MOST_STATES = 10_000  # that are evaluated at once, a fraction of a second


class Stopped(Exception):  # noqa: N818 (nothing is wrong)
    """An observer of the solution asked to stop."""


@struct
class Servo:
    """The robot under its path, at rest before 0 and after `end`, s; with `factor` 1 its points are the output.

    With a smaller factor, the output is where these would be with the same motor coordinates and the deflections
    `factor` p + `offset` in place of p (Wang and Vidyasagar 1991; De Luca and Siciliano 1993).
    At `near_times` (N,), s, `near` (N, n_q), rad and m, are postures without deflections.
    """

    model: Model
    end: float
    factor: float
    near_times: Array
    near: Array
    goes_on: Callable[[], bool]  # is called often; False stops the solution
    # functions of time, m·√kg, one per mode of all bodies: 1 − `factor` of quasi-static p; () for 0
    offset: tuple[TimeFunction, ...] = ()

    @cached_property
    def scale(self) -> Array:
        """Frequencies ω of all modes (n,), rad/s."""
        return np.sqrt(np.concatenate([node.body.stiffness for node in self.model.tree.nodes]))

    @cached_property
    def mode_sizes(self) -> Array:
        """Modal coordinates p (n,), m·√kg, that bend a link by about its length."""
        return modal_sizes(node.body for node in self.model.tree.nodes)

    @cached_property
    def doubt(self) -> str:
        """Message on the worst posture along the path; empty if all are regular."""
        times, near = self.near_times[::EVERY], self.near[::EVERY]
        ratio, worst = worst_posture(self.model, times, near)
        return describe_posture(self.model, ratio, float(times[worst]), near[worst], is_end=False)

    @property
    def functions(self) -> list[TimeFunction]:
        """Functions of time, s, one per component of trajectories, in the scene's order: m, rad, of directions 1."""
        return [function for path in self.model.scene.trajectory for _, function in path.targets]

    def slowed(self, factor: float) -> "Servo":
        """The robot on the path in `factor` times the time, by quintic Hermite pieces."""
        times = self.end * np.linspace(0.0, 1.0, PIECES + 1)
        inside = times.clip(TINY * self.end, (1.0 - TINY) * self.end)  # outside it rests

        def slower(function: TimeFunction) -> TimeFunction:
            return through(factor * times, function.sample(inside) / factor ** np.arange(3.0)[:, None])

        rows = tuple(_with_functions(row, slower) for row in self.model.rows)
        model = replace(self.model, rows=rows)
        return replace(self, model=model, end=factor * self.end, near_times=factor * self.near_times)

    @cached_property
    def motion(self) -> PrescribedMotion:
        """Equations of motor coordinates on the path for given p(t); in the plane where the robot allows that."""
        path = fastest_mechanism(self.model)
        if isinstance(path, _core.SpatialDriven):
            return self.equations()
        motion = _core.PlanarPrescribedMotion(path, self.near[0])
        if self.factor != 1.0 or self.offset:
            motion = _core.PlanarRedefinedMotion(path, path, self.near[0], self.factor, list(self.offset))
        return motion

    def equations(self) -> _core.SpatialPrescribedMotion:
        """New equations of motor coordinates on the path for given p(t), in 3D."""
        path = driven_mechanism(self.model)
        motion = _core.SpatialPrescribedMotion(path, self.near[0])
        if self.factor != 1.0 or self.offset:
            driven = driven_mechanism(following_motors(self.model)) if self.model.loop_rows.any() else path
            motion = _core.SpatialRedefinedMotion(driven, path, self.near[0], self.factor, list(self.offset))
        return motion

    def postures(self, times: Array) -> Array:
        """Postures (T, n_q), rad and m, of the path without deflections, nearest to `times` (T,), s."""
        return self.near[np.searchsorted((self.near_times[1:] + self.near_times[:-1]) / 2, times)]

    def residuals(self, times: Array, p: Array, v: Array, a: Array) -> Array:
        """Modal forces r (N, n), N/√kg, that motors do not supply at `times` (N,), s; NaN without a posture.

        p, ṗ = v and p̈ = a are (N, n), m·√kg and s. Raises `Stopped`.
        """
        r, near = np.zeros_like(p), self.postures(times)
        for part in in_parts(len(times), MOST_STATES):
            if not self.goes_on():
                raise Stopped
            r[part] = self.motion.left_on_modes(times[part].tolist(), p[part], v[part], a[part], near[part])[1]
        return r

    def forces(self, times: Array, p: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """Residual modal forces r (N, n), N/√kg, and motor torques τ (N, motors), N·m or N.

        At `times` (N,), s; p, ṗ = v and p̈ = a are (N, n), m·√kg and s.
        """
        states = self.motion.motion(times.tolist(), p, v, a, self.postures(times))
        return states.left[:, self.of_modes], states.tau

    def quasi_static(self, times: Array, p: Array) -> Array:
        """Motor torques (N, motors), N·m or N, at `times` (N,), s, for shapes p (N, n), m·√kg, that do not change."""
        return self.forces(times, p, 0 * p, 0 * p)[1]

    @cached_property
    def of_modes(self) -> Indices:
        """Indices (n,) in v of the modal coordinates of all links."""
        return np.flatnonzero(~self.model.tree.joint_columns)

    def slopes(self, times: Array, p: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Derivatives (N, n + motors, n), SI units, of residual modal forces and motor torques by p̈, ṗ and p.

        At `times` (N,), s; p, ṗ = v and p̈ = a are (N, n), m·√kg and s.
        """
        return left_slopes(self.model, self.motion, (p, v, a), times, self.postures(times))


def make_servo(model: Model, end: float, goes_on: Callable[[], bool], kind: str = "motors-only") -> Servo:
    """The robot under a path that rests before 0 and after `end` (s), whose own points are the output.

    `kind` is for messages; `Stopped` is raised when `goes_on` returns False. Raises `InputError` without
    modes, for a path that jumps or that the undeformed robot cannot follow, and unless motors and path components are
    as many as degrees of freedom.
    """
    rows = tuple(_with_functions(row, lambda function: function.held(0.0, end)) for row in model.rows)
    held = replace(model, rows=rows)
    start = undeformed_posture(held).q
    freedom = mobility(held, start).freedom
    for count, what in (
        (len(model.motor_columns), "motors"),
        (np.count_nonzero(~model.loop_rows), "trajectory components"),
    ):
        if count != freedom:
            raise InputError(
                f'expected for kind = "{kind}" as many {what} as the mechanism has degrees of freedom ({freedom})',
                count,
            )
    if model.tree.is_rigid:
        raise InputError(
            f'expected at least one flexible body for kind = "{kind}"', 'only rigid ones: use kind = "pcid"'
        )
    check_smooth(model, end)
    if not goes_on():
        raise Stopped
    times = np.linspace(0.0, end, POSTURES)
    servo = Servo(held, end, 1.0, times, start[None], goes_on=goes_on)
    modes = np.tile(np.concatenate([start[node.p_q] for node in model.tree.nodes]), (POSTURES, 1))
    rest = np.zeros_like(modes)
    near: Array = servo.motion.motion(times.tolist(), modes, rest, rest, start[None]).q
    for k in np.flatnonzero(~np.isfinite(near).all(axis=1)):  # where rates have no limits, as in singular postures
        q = held.constraints.posture(near[k - 1] if k else start, float(times[k]))
        if q is None:
            far = out_of_reach(held, times)
            raise InputError(
                f"trajectory: expected a path within reach, found no posture at t = {times[k]:.6g} s"
                + (f": {far}" if far else "")
            )
        near[k] = q
    return replace(servo, near=near)


def through(times: Array, values: Array) -> TimeFunction:
    """Quintic Hermite pieces by values, rates, accelerations (3, T), any unit, at `times` (T,), s; outside at rest."""
    curve = scipy.interpolate.PPoly.from_bernstein_basis(scipy.interpolate.BPoly.from_derivatives(times, values.T))
    pieces = TimeFunction.polynomial(curve.x, np.ascontiguousarray(curve.c.T))
    return pieces.held(float(times[0]), float(times[-1]))


def _with_functions(row: ConstraintRow, change: Callable[[TimeFunction], TimeFunction]) -> ConstraintRow:
    if row.target is not None:
        row = replace(row, target=change(row.target))
    if row.law is not None:
        row = replace(row, law=replace(row.law, functions=tuple(map(change, row.law.functions))))
    return row
