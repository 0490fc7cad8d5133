"""Forces that answer to the motion along measures: friction, springs of gears that give, forces of the user's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, as_list
from .. import _core
from .._core import StateFunction
from ..joints.measure import GROUND_FRAME, Marker, Measure
from ..joints.transmission import ElasticGear, Friction
from ..model.model import Model
from ..model.system import MechanismSystem

DIFFERENCE = 1e-6  # of sizes of the robot, rad: central differences of forces of the user's


class Answer(NamedTuple):
    """Forces along m measures in one motion (m,), and their derivatives by values and rates of these (m, m)."""

    force: Array
    by_value: Array
    by_rate: Array


Law = Callable[[float, Array, Array], Answer]  # of time, values and rates


class AnsweringForces:
    """Of a model; `measures` are those along which they act."""

    def __init__(self, model: Model) -> None:
        laws = [*_friction(model), *_springs(model), *_of_the_user(model)]
        self.measures = [measure for measures, _ in laws for measure in measures]
        self._laws = [(len(measures), law) for measures, law in laws]
        self._assembly = MechanismSystem(model, (), (), self.measures)

    def at(self, t: float, q: Array, v: Array) -> Answer:
        """In a motion through q with v (coordinates,)."""
        along = [(measure, order) for order in (0, 1) for measure in self._assembly.motor_measures]
        readings = _core.Sensing(self._assembly.system, along, []).read(q[None], v[None], np.zeros_like(v)[None])
        value, rate = readings[0].reshape(2, -1)
        m, first = len(value), 0
        found = Answer(np.zeros(m), np.zeros((m, m)), np.zeros((m, m)))
        for count, law in self._laws:
            here = slice(first, first + count)
            for whole, part in zip(found, law(t, value[here], rate[here]), strict=True):
                whole[(here,) * whole.ndim] = part
            first += count
        return found


def _friction(model: Model) -> Iterator[tuple[list[Measure], Law]]:
    for measure, friction in model.frictions:
        yield [measure], _resisting(friction)


def _resisting(friction: Friction) -> Law:
    def law(t: float, value: Array, rate: Array) -> Answer:
        return Answer(-friction.resistance(rate), np.zeros((1, 1)), -friction.slope(rate)[None])

    return law


def _springs(model: Model) -> Iterator[tuple[list[Measure], Law]]:
    for gear in model.gears:
        yield [gear.motor, gear.coordinate], _spring(gear)


def _spring(gear: ElasticGear) -> Law:
    twist = np.array([1.0, -1.0])
    both = np.outer(twist, twist)

    def law(t: float, value: Array, rate: Array) -> Answer:
        moment = gear.stiffness * (twist @ value) + gear.damping * (twist @ rate)
        return Answer(-moment * twist, -gear.stiffness * both, -gear.damping * both)

    return law


def _of_the_user(model: Model) -> Iterator[tuple[list[Measure], Law]]:
    length = MechanismSystem(model, model.joints).system.length if model.state_forces else 1.0
    for marker, function in model.state_forces:
        yield _motion_of(marker), _given(function, np.array([length, length, 1.0]))


def _motion_of(marker: Marker) -> list[Measure]:
    kinds = _core.MeasureKind
    return [Measure("force of the user's", kind, GROUND_FRAME, marker) for kind in (kinds.x, kinds.y, kinds.angle)]


def _given(function: StateFunction, sizes: Array) -> Law:
    """How a function is made is not known: its derivatives are differences."""

    def law(t: float, value: Array, rate: Array) -> Answer:
        def force(dx: Array, dv: Array) -> Array:
            return np.array(function(t, as_list(value + dx), as_list(rate + dv)))

        none, steps = np.zeros(3), DIFFERENCE * np.diag(sizes)
        by_value = [(force(h, none) - force(-h, none)) / (2 * h.max()) for h in steps]
        by_rate = [(force(none, h) - force(none, -h)) / (2 * h.max()) for h in steps]
        return Answer(force(none, none), np.array(by_value).T, np.array(by_rate).T)

    return law
