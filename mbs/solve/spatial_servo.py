"""A path in space whose force enters through the joint motors alone, as `servo` in the plane: `internal_dynamics`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import InputError
from .._core import TimeFunction
from ..model.spatial_known_motion import KnownStates, required_forces
from ..model.spatial_model import SpatialModel, row_values
from ..model.spatial_motors import SplitForces, split_forces
from ..model.spatial_rows import SpatialRow
from .internal_dynamics import Stopped, Target
from .spatial_posture import BoolArray, mobility, solve_posture, told_posture, undeformed_posture
from .spatial_prescribed import modal_places, motion_near

POSTURES = 201  # along the path, from which others are looked for
EVERY = 10  # of these is looked at for singular ones
MOST_STATES = 1000  # that are evaluated at once, a fraction of a second


class ServoMotion(NamedTuple):
    """States q (T, n_q), v and a (T, n_v) with p(t) given, and M v̇ − Q split into motors, modes and loops."""

    q: Array
    v: Array
    a: Array
    required: Array
    split: SplitForces


@dataclass(frozen=True)
class SpatialServo:
    """The robot under its path, held before 0 and after `end`; `factor` and `offset` as in `servo.Servo`.

    `near` (N, n_q): postures along the path without deflections, at `near_times`. `where` are scene and analysis, for
    messages; `goes_on` is asked again and again whether to go on.
    """

    model: SpatialModel
    end: float
    factor: float
    near_times: Array
    near: Array
    where: str
    goes_on: Callable[[], bool]
    offset: tuple[TimeFunction, ...] = ()

    @cached_property
    def scale(self) -> Array:
        """Frequencies ω of all modes (n,), rad/s."""
        omega: Array = np.sqrt(np.concatenate([node.body.stiffness for node in self.model.tree.nodes]))
        return omega

    @property
    def mode_sizes(self) -> Array:
        """√J of the bodies of all modes (n,), m·√kg."""
        nodes = self.model.tree.nodes
        largest = [np.linalg.eigvalsh(node.body.inertia)[-1] for node in nodes]
        return np.concatenate([np.full(node.body.n_modes, J**0.5) for node, J in zip(nodes, largest, strict=True)])

    @property
    def mode_counts(self) -> list[int]:
        """By body of the tree."""
        return [node.body.n_modes for node in self.model.tree.nodes]

    @cached_property
    def doubt(self) -> str:
        """What to say of the worst posture along the path; "" where all are fine."""
        ratios = [mobility(self.model, q).ratio for q in self.near[::EVERY]]
        worst = EVERY * int(np.argmin(ratios))
        return told_posture(self.model, min(ratios), float(self.near_times[worst]), self.near[worst], is_end=False)

    def targets(self) -> Iterator[Target]:
        """What the path follows."""
        for path in self.model.scene.trajectory:
            for component, function in path.components.items():
                yield Target(path.name, component, function)
            if path.orientation is not None:
                for function in path.orientation.functions:
                    yield Target(path.name, path.orientation.kind, function)

    def with_factor(self, factor: float) -> SpatialServo:
        """The same with another factor."""
        return replace(self, factor=factor)

    def with_offset(self, offset: tuple[TimeFunction, ...]) -> SpatialServo:
        """The same with what is expected of the deflections that the output leaves out."""
        return replace(self, offset=offset)

    def motion(self, times: Array, modes: Array) -> tuple[ServoMotion, BoolArray]:
        """With `modes` (3, T, n), p, ṗ and p̈, at `times` (T,); and where a posture was found (T,)."""
        model, tree = self.model, self.model.tree
        guess = self.near[np.abs(times[:, None] - self.near_times).argmin(axis=1)]
        seen = self.factor * modes
        if self.offset:
            seen = seen + np.array([f.sample(times) for f in self.offset]).transpose(1, 2, 0)
        q, v, a, is_met = motion_near(model, seen, times, guess)
        modes = np.where(is_met[:, None], modes, 0.0)
        q[:, modal_places(model)], v[:, ~tree.joint_columns], a[:, ~tree.joint_columns] = modes
        frames = tree.frames(q)
        required = required_forces(model, KnownStates(q, v, a), np.clip(times, 0.0, self.end))
        split = split_forces(model, q, frames, row_values(model, q, times, frames)[1], required)
        return ServoMotion(q, v, a, required, split), is_met

    def residuals(self, times: Array, p: Array, v: Array, a: Array) -> Array:
        """Modal forces r (N, n) that motors do not supply; NaN where no posture is found. Raises `Stopped`."""
        modes = np.array([p, v, a])
        parts = range(0, len(times), MOST_STATES)
        return np.concatenate([self._left(times[k : k + MOST_STATES], modes[:, k : k + MOST_STATES]) for k in parts])

    def _left(self, times: Array, modes: Array) -> Array:
        if not self.goes_on():
            raise Stopped
        with np.errstate(over="ignore", invalid="ignore"):  # of an iteration that leaves the numbers r is none
            found, is_met = self.motion(times, modes)
        left: Array = np.where(is_met[:, None], found.split.left[:, ~self.model.tree.joint_columns], np.nan)
        return left


def make_spatial_servo(
    model: SpatialModel, end: float, where: str, goes_on: Callable[[], bool], factor: float
) -> SpatialServo:
    """The equations for a path that is held before 0 and after `end`.

    Raises `InputError` unless there are as many motors and specified components as degrees of freedom, and modes, and
    for a path that the undeformed robot cannot follow; `Stopped`.
    """
    held = replace(model, rows=tuple(_held(row, end) for row in model.rows))
    start = undeformed_posture(held).q
    freedom = mobility(held, start).freedom
    motors = sum(len(columns) for columns in model.motors.values())
    for found, what in ((motors, "motors"), (np.count_nonzero(~model.loop_rows), "trajectory components")):
        if found != freedom:
            raise InputError(
                f'{where}: expected for kind = "motors-only" as many {what} as the mechanism has degrees of freedom'
                f" ({freedom}), found {found}"
            )
    if not any(node.body.n_modes for node in model.tree.nodes):
        raise InputError(
            f'{where}: expected at least one flexible body for kind = "motors-only", found only rigid ones: use kind'
            ' = "pcid"'
        )
    if factor != 1.0 and model.loop_rows.any():
        raise InputError(
            f'{where}: expected an open chain for output = "redefined" in space = "spatial", found a kinematic loop:'
            ' use output = "tip"'
        )
    times = as_floats(np.linspace(0.0, end, POSTURES))
    near = [start]
    for t in times[1:]:
        if not goes_on():
            raise Stopped
        q = solve_posture(held, float(t), near[-1])
        if q is None:
            raise InputError(f"{where}: trajectory: expected a path within reach, found no posture at t = {t:.6g} s")
        near.append(q)
    return SpatialServo(held, end, factor, times, np.array(near), where, goes_on)


def _held(row: SpatialRow, end: float) -> SpatialRow:
    target = None if row.target is None else row.target.held(0.0, end)
    law = row.law
    if law is not None:
        law = replace(law, functions=tuple(function.held(0.0, end) for function in law.functions))
    return replace(row, target=target, law=law)
