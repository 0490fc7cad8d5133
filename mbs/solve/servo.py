"""A planar path as a servo constraint whose force enters through the joint motors alone: see `internal_dynamics`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...common.arrays import Array, as_floats, as_list
from ...common.errors import InputError
from .. import _core
from .._core import TimeFunction
from ..joints.measure import Measure
from ..model.model import ZERO, Constraint, Model
from ..model.planar_tree import PlanarTree, told_in_joints
from ..model.system import MechanismSystem
from .initial_state import undeformed_state
from .internal_dynamics import Target, by_differences
from .reach import REACH_CHECKS, check_reach


@dataclass(frozen=True)
class Servo:
    """The robot under its path, and under its motors; `factor` 1 takes the path's own points as output.

    A smaller factor takes where they would be with the same motor coordinates and the deflections `factor` p +
    `offset`, which is what is expected of the rest (Wang and Vidyasagar 1991; De Luca and Siciliano 1993).

    Attributes:
        path, driven: the mechanism under its joints and the path, and under its joints and the motors' coordinates.
        path_tree, driven_tree: both in joint coordinates, with what motors do.
        near_times, near: along the path, (N,) s, postures of the trees without deflections (N, n_q).
        loads: of the scene, held before and after the path as it is.
        where: scene and analysis, for messages.
        offset: one for each mode of all bodies, or none.
    """

    path: MechanismSystem
    driven: MechanismSystem
    path_tree: PlanarTree
    driven_tree: PlanarTree
    factor: float
    near_times: Array
    near: Array
    loads: tuple[tuple[Measure, TimeFunction], ...]
    where: str
    offset: tuple[TimeFunction, ...] = ()

    @cached_property
    def motion(self) -> _core.PlanarPrescribedMotion:
        """Of the driven robot, with p(t) given."""
        trees = self.driven_tree.both.driven, self.path_tree.both.driven
        return _core.PlanarRedefinedMotion(*trees, self.near[0], self.factor, list(self.offset))

    @cached_property
    def _output(self) -> _core.PlanarPrescribedMotion:
        """What leaves r on the modes: that of the path where it is the output itself, at half the work."""
        if self.factor != 1.0 or self.offset:
            return self.motion
        return _core.PlanarPrescribedMotion(self.path_tree.both.driven, self.near[0])

    def residuals(self, times: Array, p: Array, v: Array, a: Array) -> Array:
        """Modal forces r (N, n) that motors do not supply; NaN where no posture is found."""
        near = self.near[np.abs(times[:, None] - self.near_times).argmin(axis=1)]
        found: Array = self._output.left_on_modes(as_list(times), p, v, a, near)[1]
        return found

    def derivatives(self, times: Array, p: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """M, D and K (N, n, n) of these by p̈, ṗ and p."""
        return by_differences(self, times, p, v, a)

    def source(self, shape: list[list[TimeFunction]]) -> _core.ActuationSource:
        """The motors' forces for p(t), at any time."""
        return _core.PrescribedActuation(self.driven_tree.both, self.motion, shape, self.near[0])

    @property
    def scale(self) -> Array:
        """Frequencies ω of all modes (n,), rad/s."""
        omega: Array = np.sqrt(np.concatenate([body.stiffness for body in self.path.model.bodies]))
        return omega

    @property
    def doubt(self) -> str:
        """Of postures: none, as reach is known when the path is read."""
        return ""

    @property
    def mode_sizes(self) -> Array:
        """√J of the bodies of all modes (n,), m·√kg."""
        return np.concatenate([np.full(body.n_modes, np.sqrt(body.inertia)) for body in self.path.model.bodies])

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


def make_servo(model: Model, end: float, where: str, factor: float) -> Servo:
    """The equations for a path that is held before 0 and after `end`.

    Raises `InputError` unless there are as many motors and specified components as degrees of freedom, and modes, and
    for a path that the undeformed robot cannot follow.
    """
    for found, what in ((len(model.motors), "motors"), (len(model.trajectories), "trajectory components")):
        if found != model.degrees_of_freedom:
            raise InputError(
                f'{where}: expected for kind = "motors-only" as many {what} as the mechanism has degrees of'
                f" freedom ({model.degrees_of_freedom}), found {found}"
            )
    if not any(body.n_modes for body in model.bodies):
        raise InputError(
            f'{where}: expected at least one flexible body for kind = "motors-only", found only rigid ones: use kind'
            ' = "pcid"'
        )
    rows = list(model.motors.values())
    held = [Constraint(c.measure, c.target.held(0.0, end), c.owner, c.component, True) for c in model.trajectories]
    motors = [Constraint(row, ZERO, f'motor of joint "{name}"', "value", True) for name, row in model.motors.items()]
    loads = tuple((row, size.held(0.0, end)) for row, size in model.loads)
    path = MechanismSystem(model, [*model.joints, *held], loads, rows)
    driven = MechanismSystem(model, [*model.joints, *motors], loads, rows)
    path_tree, driven_tree = (told_in_joints(system, "motors-only", rows) for system in (path, driven))
    near = check_reach(path, undeformed_state(path), as_floats(np.linspace(0.0, end, REACH_CHECKS)))
    postures = np.array([path_tree.motion(q, 0 * q, 0 * q)[0] for q in near.q])
    return Servo(path, driven, path_tree, driven_tree, factor, near.times, postures, loads, where)
