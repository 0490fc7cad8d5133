"""Forward dynamics under sampled controllers: sensors, delay, saturation, feed-forward, disturbances."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import replace
from functools import cache, partial

import numpy as np

from ...common.arrays import Array, as_list
from ...common.errors import InputError, SolveError
from ...mbs._core import TimeFunction
from ...mbs.analysis.forward import actuator_commands, command_ranges, largest_moments, strain_directions
from ...mbs.linear.linearisation import LinearEquations
from ...mbs.linear.statics import initial_state
from ...mbs.model.amplifiers import joined
from ...mbs.model.drives import Drives, PointDrive
from ...mbs.model.gears import with_compliance
from ...mbs.model.known_motion import State
from ...mbs.model.model import Model
from ...mbs.posture.start import undeformed_posture
from ...mbs.quantities.settling import commanded_rest
from ...mbs.run.context import place_of
from ...mbs.run.drive import Control, drive_robot
from ...mbs.run.gears import MotorCoordinates, with_motor_coordinates
from ...mbs.run.record import Run
from ...mbs.run.replay import replay_times, supplied
from ..context import ActuatedContext
from ..patches.link_patches import LinkPatches
from .controllers import ComputedTorqueControl, Controller, PythonControl, make_controllers
from .linear import voltages_at
from .linear_model import LinearModel, state_space
from .loop import (
    AmplifiedLoop,
    Loop,
    between,
    held_commands,
    held_until,
    loop_record,
    sample_times,
    times_of_run,
)
from .margins import MOST, Feedback, eigenvalue_count, lowest_frequency
from .metrics import LoopMotion, last_change, place_of_tip
from .observer import Observed, make_observed
from .probing import LONGEST, find_feedback
from .records import SampledAnalysis
from .robot import (
    ControlledRobot,
    Setup,
    default_tip,
    estimated_sensors,
    input_names,
    needed_sensors,
    whole_robot,
)
from .signals import Filter, Sensing, Signal, filters, make_signals, merged, readings_at

APART = 1e-6  # of a run, between two times of a spline
INSTANT = 1e-6  # of the sample time, before and after which commands are read where they change


class ClosedLoop(SampledAnalysis):
    """Motion under sampled control; reference, feed-forward and start are those of the inverse analysis `actuation`.

    Samples are at 0, sample_time, …; a zero-order hold applies the command of each `delay` later. Torques and voltages
    are limited as in the scene unless `unlimited`; bandwidth and delay of amplifiers act in any case, also in margins.
    Hysteresis is not linear, and margins leave it out. An initial state of [initial] is on the trajectories.

    Sensors name patches by their layout. Joints with several coordinates have one signal per coordinate, "joint/NAME
    1", "joint/NAME 2", with the same gains.
    """

    def run(self, context: ActuatedContext) -> Run:
        """The closed loop about the motion of an inverse analysis, from its initial state.

        The run's details are a `LoopRecord`. One that diverges ends there and is kept. Raises `InputError` for
        controllers that do not fit the robot, `SolveError` where a user's function fails.
        """
        assert self.actuation is not None
        source = context.outcomes[self.actuation]
        plant = with_compliance(context.model.without_paths())
        moved, robot, whole = with_motor_coordinates(source, plant), whole_robot(context, source), context.whole
        read, estimated = self._signals(context, plant, robot)
        sensing, ideal = Sensing(plant, read), Sensing(plant, estimated)
        outputs, tip = replay_times(source, self), place_of(whole, self.tip) or default_tip(plant)
        models = loop_models(plant, source.time, moved, context.patches, read)
        place_at = _place_of_tip(self, plant, source, tip)
        lowest = lowest_frequency(models, self.controller, self.sample_time, self.delay)
        times, rows = times_of_run(outputs, place_at, lowest)
        samples = sample_times(outputs, self.sample_time)
        seen = source if moved.gears else _resolved(source)  # gears that give are known at outputs
        of_seen = moved if moved.gears else with_motor_coordinates(seen, plant)
        reference, wanted = (
            between(samples, seen.time, of.read(of_seen.q, of_seen.v, of_seen.a)) for of in (sensing, ideal)
        )
        filtered = Filter(read, self.sample_time)
        reference[:] = [filtered(y) for y in reference]
        setup = Setup(
            robot=robot,
            model=robot.model,
            patches=context.patches,
            inputs=input_names(robot),
            outputs=tuple(signal.name for signal in read),
            times=samples,
            sample_time=self.sample_time,
            delay=self.delay,
            reference=reference,
            feed_forward=_feed_forward(context, self, source, moved, samples),
            source=robot.source,
        )
        amplifiers, ranges = joined(context.patches.values()), command_ranges(context.model, context.patches)
        if self.unlimited:
            amplifiers, ranges = amplifiers.unlimited(), np.inf * np.sign(ranges)
        observed = None
        if self.observer is None:
            acting = make_controllers(self.controller, setup)
        else:
            nominal = _feed_forward(context, self, source, moved, samples, whole=True)
            observed = make_observed(self, context, setup, wanted, ranges, nominal)
            acting = [observed]
        begun = [of if isinstance(of, PythonControl) else copy(of) for of in acting]
        loop = Loop(setup, read, acting, ranges, self.seed)
        splits = n_q, rates = plant.tree.n_q, plant.tree.n_q + plant.tree.n_v
        states: list[Array] = []

        def at_sample(k: int, t: float, state: Array) -> Array:
            q, v, a = (part[None] for part in (state[:n_q], state[n_q:rates], state[rates:]))
            if observed is not None:
                states.append(state.copy())
            return loop(k, t, sensing.read(q, v, a)[0])

        arriving: Loop | AmplifiedLoop = loop
        if amplifiers.acts:
            directions = strain_directions(plant, context.patches)
            arriving = AmplifiedLoop(
                loop,
                at_sample,
                samples,
                self.sample_time,
                amplifiers=amplifiers,
                directions=directions,
                splits=splits,
            )
            samples, at_sample = arriving.times, arriving
        instant, inputs = INSTANT * self.sample_time, actuator_commands(plant, context.patches)
        held = partial(held_commands, samples=samples, delay=self.delay, loop=arriving, after=instant)
        before = partial(held, after=-instant)
        control = Control(
            commands=inputs,
            first=arriving.first,
            times=samples,
            delay=self.delay,
            controller=at_sample,
            held=before,
            instant=instant,
        )
        disturbing = ((place_of(whole, str(load.point)), load.components) for load in self.disturbance)
        drives = Drives(at_points=tuple(PointDrive(*load) for load in disturbing))
        run = drive_robot(
            plant, self, _start(context, self, plant, moved), context.progress, drives=drives, times=times,
            control=control,
        )  # fmt: skip
        closer, run = run.closer, run.at([k for k in rows if k < len(run.time)])
        quiet = max((last_change(partial(_values, of, self), outputs) for of in _exciting(plant, self)), default=0.0)
        runs = _followed(run, place_at, held, tip, quiet), _followed(closer, place_at, held, tip, quiet)
        readings = loop.readings if observed is None else np.hstack([loop.readings, observed.estimates])
        found, along = loops_about(setup, begun, readings[: loop.taken], models)
        filtering = filters(read, self.sample_time)
        every = ((model, feedback.behind(*filtering)) for model, feedback in found)
        loops = [loop for loop in every if eigenvalue_count(loop, self.sample_time, self.delay) <= MOST]
        gears = bool(plant.tree.gears)
        with run.arithmetic:
            record = loop_record(self, setup, loop, acting, runs, loops=loops, lowest=lowest, gears=gears)
        record = replace(record, feedback=along)
        if observed is not None:
            true = ideal.read(*np.split(np.array(states[: loop.taken]), [n_q, rates], axis=1)).T
            names = [each.name for each in estimated]
            record = replace(record, estimate=observed.record(dict(zip(names, true, strict=True))))

        def completed(of: Run) -> Run:
            commanded = context.model.by_motor(held(of.time))
            return replace(of, commanded=commanded, details=record)

        return replace(completed(run), look_closer=lambda: completed(closer))

    def _signals(
        self, context: ActuatedContext, plant: Model, robot: ControlledRobot
    ) -> tuple[tuple[Signal, ...], tuple[Signal, ...]]:
        """What sensors read, those that controllers need included, and what an observer estimates instead of these."""
        signals = partial(make_signals, plant, context, whole=context.whole)
        own = signals(self.sensor)
        if self.observer is None:
            return merged(own, signals(needed_sensors(robot, self.controller))), ()
        tip = self.tip or default_tip(robot.model)
        return tuple(own), merged(signals(estimated_sensors(robot, self.controller, tip)), ())


def _resolved(source: Run) -> Run:
    """The run with times between its outputs, but for those that are so near to others that a spline would swing."""
    run = source.closer
    apart = np.diff(run.time, prepend=-np.inf) > APART * np.ptp(source.time)
    return run.at([int(k) for k in np.flatnonzero(apart)])


def loop_models(
    model: Model, time: Array, reference: MotorCoordinates, patches: Mapping[str, LinkPatches], read: Sequence[Signal]
) -> tuple[LinearModel, ...]:
    """Linearize the robot at rest on its reference at start, middle and end; the signals `read` are outputs.

    None where it is singular, or has none yet.
    """
    rest, rows = np.zeros(model.tree.n_v), sorted({0, len(time) // 2, len(time) - 1})
    with suppress(SolveError, InputError):
        linearisation, found = LinearEquations(model, reference.q[0]), []
        for k in rows:
            at = linearisation.at(float(time[k]), reference.q[k], rest, rest)
            found.append(state_space(at, voltages_at(model, at, patches), readings_at(model, at, read)))
        return tuple(found)
    return ()


def loops_about(
    setup: Setup,
    controllers: Sequence[Controller],
    readings: Array,
    models: Sequence[LinearModel],
) -> tuple[list[tuple[LinearModel, Feedback]], Mapping[float, Feedback]]:
    """The linear `models`, each with the linear controllers at its time; and controllers by time (s).

    The latter are those at the start, or at each time of an observer's schedule. Both are empty where a controller is
    not linear at the time of a model.
    """
    observed = controllers[0] if controllers and isinstance(controllers[0], Observed) else None
    acting, asked = (setup, controllers) if observed is None else (observed.setup, observed.controllers)
    inner = cache(partial(find_feedback, acting, asked, readings))
    # Computed torque alone changes along the path; a user's function is asked in order
    kinds = {type(controller) for controller in asked}
    changes = ComputedTorqueControl in kinds and PythonControl not in kinds
    latest = max(len(setup.times) - LONGEST, 0) if changes else 0

    def at(t: float, first: int) -> Feedback | None:
        law = inner(first)
        return law if law is None or observed is None else observed.schedule.at(t).closed(law)

    found = [(model, at(model.time, min(int(np.searchsorted(setup.times, model.time)), latest))) for model in models]
    of, motors = joined(setup.patches.values()), np.zeros((2, len(setup.robot.motors)))
    late = np.hstack([motors, np.stack([of.lag, of.delay])])
    known = [(model, replace(feedback, late=late)) for model, feedback in found if feedback is not None]
    if len(known) < len(found) or not known:
        return [], {}
    times = [float(setup.times[0])] if observed is None else observed.schedule.times.tolist()
    return known, {t: law for t in times if (law := at(t, 0)) is not None}


def _exciting(model: Model, analysis: ClosedLoop) -> Iterator[TimeFunction]:
    for path in model.scene.trajectory:
        yield from (target for _, target in path.targets)
    yield from model.scene.load_functions
    for load in analysis.disturbance:
        yield from load.components.values()


def _values(of: TimeFunction, analysis: ClosedLoop, time: Array) -> Array:
    """(T, 1) at `time` (T,), s, held outside the run."""
    return of.sample(np.clip(time, 0.0, analysis.last_time))[0][:, None]


def _feed_forward(
    context: ActuatedContext,
    analysis: ClosedLoop,
    source: Run,
    moved: MotorCoordinates,
    times: Array,
    *,
    whole: bool = False,
) -> Array:
    """(K, inputs) moments and voltages of the inverse analysis, in the middle of the time for which each is held.

    Those that are fed forward, or, `whole`, all.
    """
    middle = held_until(times, analysis, source.time[-1])

    most = largest_moments(context.model, limits=False)
    values = supplied(source, most, context.patches, limited=not analysis.unlimited).sample(as_list(middle))
    kind = "joints+pzt" if whole else analysis.feed_forward
    if kind == "none":
        values[:, : len(most)] = 0.0
    if kind != "joints+pzt":
        values[:, len(most) :] = 0.0
    column = 0
    for joint, columns in context.model.motors.items():  # with compliant gears: known at outputs
        if moved.gears and kind != "none":
            moments = moved.moments[joint]
            values[:, column : column + len(columns)] = between(middle, source.time, moments)
        column += len(columns)
    return values


def _start(context: ActuatedContext, analysis: ClosedLoop, plant: Model, moved: MotorCoordinates) -> State:
    """As the inverse analysis starts, or as the scene says, compliant gears with their twist there."""
    if context.start is not None:
        return context.start
    q, v = moved.q[0].copy(), moved.v[0].copy()
    if analysis.start == "actuation":
        return State(q, v)
    first = initial_state(context.model, undeformed_posture(context.model))
    twists = [[part[0] for part in gear.twist(q[None], v[None])] for gear in plant.tree.gears]
    q[: len(first.q)], v[: len(first.v)] = first.q, first.v
    for gear, (way, rate) in zip(plant.tree.gears, twists, strict=True):
        q[gear.motor.q.start] = gear.sign * q[gear.joint.q.start] + way
        v[gear.motor.v.start] = gear.sign * v[gear.joint.v.start] + rate
    return State(q, v)


def _followed(
    run: Run, place_at: Callable[[Array], Array], held: Callable[[Array], Array], tip: str, quiet: float
) -> LoopMotion:
    """Where the tip went against where it should be; `quiet` as there."""
    assert isinstance(run.analysis, ClosedLoop)
    model = run.model
    signs = np.array([model.sign(joint) for joint, of in model.motors.items() for _ in of])
    rates = signs * run.v[:, model.motor_columns]
    error = _position(model, run.q, tip) - place_at(run.time)
    completed, is_disturbed = run.status == "completed", bool(run.analysis.disturbance)
    motion = run.time, error, place_at, rates, held(run.time)
    return LoopMotion(*motion, completed, is_disturbed, quiet, model.size)


def _place_of_tip(analysis: ClosedLoop, model: Model, source: Run, tip: str) -> Callable[[Array], Array]:
    paths, run = [path.components for path in model.scene.trajectory if path.point == tip], source.closer
    known, rest = (run.time, _position(run.model, run.q, tip)), commanded_rest(source)
    last = None if rest is None else (rest.since, _position(rest.model, rest.q[None], tip)[0])
    return partial(place_of_tip, end=analysis.last_time, known=known, paths=paths, last=last)


def _position(model: Model, q: Array, point: str) -> Array:
    return model.tree.places(q).at(model.tree.section(point)).r
