"""A model under some of its constraints and drives in absolute coordinates, as the core describes it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ...common.arrays import Array, Indices
from .. import _core
from .._core import TimeFunction
from ..joints.measure import FRAME, Marker, Measure
from .model import Constraint, Model
from .planar_body import PlanarBody, PlanarPoint, core_arguments


class MechanismSystem:
    """A core `System` with the numbering that leads back from its measures to the scene.

    q, v and a are (…, coordinates): (R, θ, p) of each body, one body after the other, from `first` on; m, rad, √kg·m.
    Motions are found in joint coordinates (`planar_tree`); in these they are told, measured, and their forces found.
    """

    def __init__(
        self,
        model: Model,
        constraints: Sequence[Constraint],
        drives: Sequence[tuple[Measure, TimeFunction]] = (),
        motors: Sequence[Measure] = (),
    ) -> None:
        self.model = model
        self.index = {body.name: i for i, body in enumerate(model.bodies)}
        self._markers: list[list[str]] = [[] for _ in model.bodies]
        self.constraints = tuple(constraints)
        self.drives = tuple(drives)
        core = self.core_measure
        self.constraint_measures = [core(c.measure) for c in self.constraints]
        driven = [(core(measure), magnitude) for measure, magnitude in drives]
        self.rotors = [(core(measure), inertia) for measure, inertia in model.rotors]
        frictions = [(core(measure), friction) for measure, friction in model.frictions]
        state_forces = [(self._marker(marker), function) for marker, function in model.state_forces]
        self.motor_measures = [core(measure) for measure in motors]
        coordinates = [joint.coordinate("section") for joint in model.scene.joint]
        self.joint_measures = [core(measure) for measure in coordinates if measure is not None]
        self.gear_measures = [core(gear.motor) for gear in model.gears]
        springs = [(motor, core(gear.coordinate)) for motor, gear in zip(self.gear_measures, model.gears, strict=True)]
        self.system = _core.System(np.array(model.scene.gravity))
        for body, markers in zip(model.bodies, self._markers, strict=True):
            self.system.add_body(**core_arguments(body, [_point(body, name) for name in markers], markers))
        for constraint, measure in zip(self.constraints, self.constraint_measures, strict=True):
            self.system.add_constraint(measure, constraint.target)
        for measure, inertia in self.rotors:
            self.system.add_rotor(measure, inertia)
        for measure, magnitude in driven:
            self.system.add_drive(measure, magnitude)
        for measure, friction in frictions:
            self.system.add_friction(measure, friction.viscous, friction.coulomb, friction.speed)
        for marker, function in state_forces:
            self.system.add_state_force(marker, function)
        for gear, (motor, joint) in zip(model.gears, springs, strict=True):
            self.system.add_spring(motor, joint, gear.stiffness, gear.damping)
        for load in model.modal_loads:
            self.system.add_modal_drive(self.index[load.body], load.vector, load.magnitude)
        self.system.finish()
        self.first = np.array(self.system.first_coordinate, dtype=int)

    @cached_property
    def frame_coordinates(self) -> Indices:
        """Indices of (R, θ) of all bodies in q (3 bodies,)."""
        indices: Indices = (self.first[:, None] + np.arange(3)).ravel()
        return indices

    @cached_property
    def scales(self) -> Array:
        """Natural size of each coordinate (coordinates,): a length for R, 1 rad for θ, √I for p.

        √I is the size of p where a link is bent by about its length.

        What is small, or a step that is long, is judged by them: units of length and mass are the user's.
        """
        scales = np.empty(self.system.coordinates)
        for first, body in zip(self.first, self.model.bodies, strict=True):
            scales[first : first + 3] = self.system.length, self.system.length, 1.0
            scales[first + 3 : first + 3 + body.n_modes] = np.sqrt(body.inertia)
        return scales

    @cached_property
    def measure_scales(self) -> Array:
        """Natural size of each constraint's value (constraints,): a length, or 1 rad."""
        return np.where(self.moments, 1.0, self.system.length)

    @property
    def is_trajectory(self) -> list[bool]:
        """For each constraint, whether it belongs to C_s."""
        return [c.is_trajectory for c in self.constraints]

    @property
    def moments(self) -> list[bool]:
        """For each constraint, whether its multiplier is a moment."""
        return [c.measure.carries_moment for c in self.constraints]

    @property
    def groups(self) -> list[int]:
        """For each constraint, the number of the force or moment it is a component of."""
        keys = [(c.is_trajectory, c.owner, c.measure.carries_moment) for c in self.constraints]
        numbers = {key: i for i, key in enumerate(dict.fromkeys(keys))}
        return [numbers[key] for key in keys]

    def section_angle(self, marker: Marker, x: Array) -> Array:
        """Angle (…) of the section at a marker for coordinates x = q (…, coordinates), rad; its rate for x = v."""
        if marker.body is None:
            return np.zeros(x.shape[:-1])
        i = self.index[marker.body]
        body, first = self.model.bodies[i], int(self.first[i])
        angle: Array = x[..., first + 2]
        if marker.point == FRAME:
            return angle
        return angle + x[..., first + 3 : first + 3 + body.n_modes] @ body.points[marker.point].rotation

    def force_direction(self, measure: Measure, q: Array) -> Array:
        """Unit force on the second marker along a measure, in global axes (T, 2); q (T, coordinates)."""
        return measure.force_direction(self.section_angle(measure.a, q))

    def constraint_wrenches(self, q: Array, lambda_: Array) -> dict[str, dict[str, Array]]:
        """Force (N, global axes) and moment (N·m) of the constraints, (T, 3), on every point of every body.

        For q (T, coordinates) and multipliers (T, constraints). Moments of slides about their markers are left out.
        """
        wrenches: dict[str, dict[str, Array]] = {}
        for constraint, multiplier in zip(self.constraints, lambda_.T, strict=True):
            measure = constraint.measure
            for marker, sign in ((measure.b, -1.0), (measure.a, 1.0)):
                if marker.body is None or marker.point == FRAME:
                    continue
                wrench = wrenches.setdefault(marker.body, {}).setdefault(marker.point, np.zeros((len(lambda_), 3)))
                if measure.carries_moment:
                    wrench[:, 2] += sign * multiplier
                else:
                    wrench[:, :2] += (sign * multiplier)[:, None] * self.force_direction(measure, q)
        return wrenches

    def marker_wrenches(
        self, time: Array, q: Array, v: Array, a: Array, multipliers: Array
    ) -> dict[str, dict[str, Array]]:
        """Force (N, global axes) and moment (N·m), (T, 3), on points of bodies, of all that acts there.

        Constraints with `multipliers` (T, constraints), drives, friction, springs and the inertia of rotors, in a
        motion q, v, a (T, coordinates). A load on a body's frame has the point FRAME.
        """
        x = (np.ascontiguousarray(values) for values in (q, v, a, multipliers))
        columns = self.system.marker_wrenches(time, *x)
        wrenches: dict[str, dict[str, Array]] = {}
        first = 0
        for body, points in zip(self.model.bodies, self._markers, strict=True):
            wrenches[body.name] = {name: columns[:, first + 3 * k :][:, :3] for k, name in enumerate(points)}
            first += 3 * len(points)
        return wrenches

    def core_measure(self, measure: Measure) -> _core.Measure:
        """For the core; of markers that the system has."""
        a, b = self._marker(measure.a), self._marker(measure.b)
        direction, ratios = np.array(measure.direction), np.array(measure.gear_ratios)
        return _core.Measure(measure.kind, a, b, direction, ratios, measure.offset)

    def _marker(self, marker: Marker) -> _core.Marker:
        if marker.body is None:
            return _core.Marker(-1, 0, np.array(marker.position))
        body = self.index[marker.body]
        markers = self._markers[body]
        if marker.point not in markers:
            markers.append(marker.point)
        return _core.Marker(body, markers.index(marker.point), np.zeros(2))


def _point(body: PlanarBody, name: str) -> PlanarPoint:
    if name != FRAME:
        return body.points[name]
    return PlanarPoint(np.zeros(2), np.zeros((2, body.n_modes)), np.zeros(body.n_modes))
