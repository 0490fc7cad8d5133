"""Forward dynamics under sampled controllers: their choice, sensors, delay, saturation, feed-forward, disturbances."""

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
from ...mbs.model.model import Model, without_paths
from ...mbs.quantities.settling import commanded_rest
from ...mbs.run.context import place_of
from ...mbs.run.drive import Control, drive_robot
from ...mbs.run.gears import MotorCoordinates, with_motor_coordinates
from ...mbs.run.outcome import Outcome
from ...mbs.run.replay import replay_times, supplied
from ..context import ActuatedContext
from ..patches.link_patches import LinkPatches
from .amplified_loop import AmplifiedLoop
from .controllers import (
    ComputedTorqueControl,
    Controller,
    LinearFeedback,
    Loop,
    PythonControl,
    Setup,
    joint_pid,
    load_function,
    modal_velocity,
    state_feedback,
)
from .linear import voltages_at
from .linear_model import LinearModel, kept_modes, state_space
from .loop_record import between, held_commands, held_until, loop_record, sample_times, times_of_run
from .margins import Feedback, lowest_frequency
from .metrics import Followed, last_change, place_of_tip
from .observer import Observed, Schedule, given, kalman, unseen
from .probing import LONGEST, find_feedback
from .records import (
    ComputedTorque,
    GainsObserver,
    JointPid,
    KalmanObserver,
    KalmanRecord,
    Lqr,
    ModalVelocity,
    PythonController,
    SampledAnalysis,
    Sensor,
    StateFeedback,
)
from .records import Controller as Record
from .robot import Robot, input_names
from .signals import Filter, Sensing, Signal, filters, make_signals, merged

APART = 1e-6  # of a run, between two times of a spline


def needed_sensors(robot: Robot, controllers: Sequence[Record]) -> Iterator[Sensor]:
    """Sensors without which the `controllers` of an analysis could not act; ideal unless the scene gives them."""
    for record in controllers:
        if isinstance(record, JointPid):
            for joint in record.joints:
                yield Sensor.model_validate({record.side: joint})
                if joint in record.derivative and record.rate == "measured":
                    yield Sensor.model_validate({record.side: joint, "measure": "rate"})
        elif not isinstance(record, PythonController | ModalVelocity):
            for joint in robot.motor_joints:
                yield Sensor(joint=joint)
                yield Sensor(joint=joint, measure="rate")
        if isinstance(record, Lqr):
            for joint in robot.elastic_joints:
                yield Sensor(motor=joint)
                yield Sensor(motor=joint, measure="rate")
        if isinstance(record, ModalVelocity | Lqr):
            bending = robot.patches if record.sensor == "pzt" else robot.links
            bodies = record.bodies if isinstance(record, ModalVelocity) else tuple(bending)
            for body in bodies:
                if record.sensor == "pzt":
                    yield from (Sensor(pzt=layout) for layout in robot.patches[body].layouts)
                else:
                    yield Sensor(modal=body)
                    yield Sensor(modal=body, measure="rate")


def estimated_sensors(robot: Robot, controllers: Sequence[Record], tip: str) -> Iterator[Sensor]:
    """Ideal ones of what an observer estimates: the tip, all coordinates and rates, and what `controllers` need."""
    model = robot.model
    subjects = [{"joint": one.name} for one in model.scene.joint if one.units and one.name in model.tree.carried]
    subjects += [{"motor": name} for name in robot.elastic_joints] + [{"modal": name} for name in robot.links]
    yield Sensor(point=tip)
    for subject in subjects:
        yield Sensor.model_validate(subject)
        yield Sensor.model_validate(subject | {"measure": "rate"})
    yield from needed_sensors(robot, controllers)


def make_observed(
    analysis: ClosedLoop, context: ActuatedContext, setup: Setup, reference: Array, ranges: Array, nominal: Array
) -> Observed:
    """The observer with the controllers that act on its estimates.

    `reference` (K, estimates) as of `Setup`, `ranges` and `nominal` as of `Observed`. Raises `InputError` where the
    observer does not fit the robot.
    """
    record, robot, T = analysis.observer, setup.robot, setup.sample_time
    tip, origin = analysis.tip or default_tip(robot.model), setup.reference
    warnings: list[str] = []
    try:
        if isinstance(record, KalmanRecord):
            plant = with_compliance(robot.model)
            read, more = (
                [s for sensor in sensors for s in make_signals(plant, context, sensor)]
                for sensors in (analysis.sensor, estimated_sensors(robot, analysis.controller, tip))
            )
            whole = merged(more, ())
            names = [signal.name for signal in whole]
            source, found = setup.source, []
            at = [record.time] if isinstance(record, KalmanObserver) else np.linspace(0, source.time[-1], record.count)
            instants = sorted({int(np.abs(source.time - t).argmin()) for t in at})
            pushed = (name.split("/") for name in (*record.process, *record.disturbance))
            points = {parts[1]: parts[1] for parts in pushed if parts[0] == "force"}
            for row in instants:
                mechanism, voltages = kept_modes(*robot.linear(row, points), record.modes)
                rows = zip(*Sensing(plant, (*read, *whole)).rows(mechanism), strict=True)
                readings = dict(zip([s.name for s in (*read, *whole)], rows, strict=True))
                model = state_space(mechanism, voltages, readings)
                found.append(kalman(record, model, read, names, (setup.inputs, T, setup.delay)))
                warnings += unseen(model, read)
            schedule = Schedule(source.time[instants], tuple(found))
        else:
            assert isinstance(record, GainsObserver)
            one = given(record, setup)
            schedule = Schedule(np.zeros(1), (one,))
            if record.about == "zero":
                origin, nominal = np.zeros_like(origin), np.zeros_like(nominal)
            reference = origin[:, setup.columns(*record.outputs)]
        if (radius := schedule.radius) >= 1.0:
            raise InputError(f"expected errors that die out along the path, found |eigenvalue| = {radius:.6g}")
    except InputError as error:
        raise InputError(f"{robot.path}: observer: {error}") from None
    every = schedule.observers[0].estimates
    still = np.zeros((len(reference), len(every) - reference.shape[1]))
    inner = replace(
        setup,
        outputs=(*setup.outputs, *(f"estimate/{name}" for name in every)),
        reference=np.hstack([setup.reference, reference, still]),
    )
    acting = make_controllers(analysis.controller, inner)
    if isinstance(record, KalmanRecord) and record.reject:
        own = [name for name in record.disturbance if name in setup.inputs]
        P = np.zeros((len(inner.inputs), len(inner.outputs)))
        P[inner.places(*own), inner.columns(*(f"estimate/disturbance/{name}" for name in own))] = 1.0
        acting.append(LinearFeedback(inner, P))
    seen_badly = list(dict.fromkeys(warnings))
    return Observed(schedule, inner, acting, ranges, (origin, nominal), record.settle, tip, seen_badly)


def make_controllers(records: Sequence[Record], setup: Setup) -> list[Controller]:
    """All controllers of an analysis."""
    return [make_controller(record, setup, records) for record in records]


def make_controller(record: Record, setup: Setup, beside: Sequence[Record]) -> Controller:
    """The controller of one table of the scene, acting with those `beside`.

    Raises `InputError` where it does not fit the robot.
    """
    if isinstance(record, JointPid):
        return joint_pid(record, setup, joint_mobility(setup))
    if isinstance(record, ModalVelocity):
        return modal_velocity(record, setup)
    if isinstance(record, StateFeedback):
        return state_feedback(record, setup)
    if isinstance(record, ComputedTorque):
        return ComputedTorqueControl(record, setup, setup.robot.rigid())
    if isinstance(record, Lqr):
        from .lqr import LqrControl

        return LqrControl(record, setup, [other for other in beside if isinstance(other, JointPid)])
    label = f"{setup.robot.path}: controller: {record.python}"
    folder = setup.robot.path.parent
    function = load_function(record.python, folder) if isinstance(record.python, str) else record.python
    return PythonControl(function, setup, label)


def joint_mobility(setup: Setup) -> Array:
    """(motors,) acceleration of each joint per moment on it at the start, links rigid, the other joints free."""
    rest = np.zeros(len(setup.robot.motors))
    if not setup.robot.motors_fit:
        return rest
    arm = setup.robot.rigid()
    M, _ = arm.terms(arm.angles(), rest)
    return np.diag(np.linalg.inv(M))


class ClosedLoop(SampledAnalysis):
    """Motion under sampled control; reference, feed-forward and start are those of the inverse analysis `actuation`.

    Samples are at 0, sample_time, …; a zero-order hold applies the command of each `delay` later. Torques and voltages
    are limited as in the scene unless `unlimited`; bandwidth and delay of amplifiers act in any case, but the linear
    model of the loop leaves them out. The initial state is that of the inverse analysis, or [initial] of
    the scene, on the trajectories. `seed` initializes the noise. `tip` is the point whose position error is computed.

    Sensors name patches by their layout. Joints with several coordinates have one signal per coordinate, "joint/NAME
    1", "joint/NAME 2", with the same gains.
    """

    def run(self, context: ActuatedContext) -> Outcome:
        """The closed loop about the motion of an inverse analysis, from its initial state.

        The run's details are a `LoopRecord`. One that diverges ends there and is kept. Raises `InputError` for
        controllers that do not fit the robot, `SolveError` where a user's function fails.
        """
        assert self.actuation is not None
        source = context.outcomes[self.actuation]
        plant = with_compliance(without_paths(context.model))
        moved, robot, whole = with_motor_coordinates(source, plant), _robot(context, source), context.whole
        own = [s for sensor in self.sensor for s in make_signals(plant, context, sensor, whole)]
        more = [s for sensor in self._ideal(robot) for s in make_signals(plant, context, sensor, whole)]
        read, estimated = (merged(own, more), ()) if self.observer is None else (tuple(own), merged(more, ()))
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
            robot, robot.model, context.patches, input_names(robot), tuple(signal.name for signal in read), samples,
            self.sample_time, self.delay, reference, _feed_forward(context, self, source, moved, samples),
            robot.source,
        )  # fmt: skip
        amplifiers = joined(context.patches.values())
        ranges = command_ranges(context.model, context.patches)
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
            arriving = AmplifiedLoop(loop, at_sample, samples, self.sample_time, amplifiers, directions, splits)
            samples, at_sample = arriving.times, arriving
        held = partial(held_commands, samples=samples, delay=self.delay, loop=arriving)
        before, inputs = partial(held, after=-1e-9), actuator_commands(plant, context.patches)
        control = Control(inputs, arriving.first, samples, self.delay, at_sample, before)
        disturbing = ((place_of(whole, str(load.point)), load.components) for load in self.disturbance)
        drives = Drives(at_points=tuple(PointDrive(*load) for load in disturbing))
        run = drive_robot(
            plant, self, _start(context, self, plant, moved), context.progress, drives=drives, times=times,
            control=control,
        )  # fmt: skip
        closer, run = run.closer, run.at([k for k in rows if k < len(run.time)])
        quiet = max((last_change(partial(_values, of, self), outputs) for of in _exciting(plant, self)), default=0.0)
        runs = _followed(run, place_at, held, tip, quiet), _followed(closer, place_at, held, tip, quiet)
        readings = loop.readings if observed is None else observed.seen
        loops = loops_about(setup, begun, readings[: loop.taken], models, filters(read, self.sample_time))
        record = loop_record(self, setup, loop, acting, runs, loops, lowest, gears=bool(plant.tree.gears))
        if observed is not None:
            true = ideal.read(*np.split(np.array(states[: loop.taken]), [n_q, rates], axis=1)).T
            names = [each.name for each in estimated]
            record = replace(record, estimate=observed.record(dict(zip(names, true, strict=True))))

        def completed(of: Outcome) -> Outcome:
            commanded = context.model.by_motor(held(of.time))
            return replace(of, forces=replace(of.forces, commanded=commanded), details=record)

        return replace(completed(run), look_closer=lambda: completed(closer))

    def _ideal(self, robot: Robot) -> Iterator[Sensor]:
        """What controllers need; what an observer estimates."""
        if self.observer is None:
            return needed_sensors(robot, self.controller)
        return estimated_sensors(robot, self.controller, self.tip or default_tip(robot.model))


def _resolved(source: Outcome) -> Outcome:
    """The run with times between its outputs, but for those that are so near to others that a spline would swing."""
    run = source.closer
    apart = np.diff(run.time, prepend=-np.inf) > APART * np.ptp(source.time)
    return run.at([int(k) for k in np.flatnonzero(apart)])


def _robot(context: ActuatedContext, source: Outcome) -> Robot:
    """What controllers know of: whole links also where the plant has their pieces."""
    if context.whole is None:
        return Robot(without_paths(context.model), context.patches, source)
    return Robot(without_paths(context.whole.model), context.patches, context.whole.as_links(source))


def loop_models(
    model: Model, time: Array, reference: MotorCoordinates, patches: Mapping[str, LinkPatches], read: Sequence[Signal]
) -> tuple[LinearModel, ...]:
    """The robot at rest on its reference at start, middle and end, with what signals read among its outputs.

    None where it is singular, or has none yet.
    """
    rest, rows = np.zeros(model.tree.n_v), sorted({0, len(time) // 2, len(time) - 1})
    names, sensing = [signal.name for signal in read], Sensing(model, read)
    with suppress(SolveError, InputError):
        linearisation, found = LinearEquations(model, reference.q[0]), []
        for k in rows:
            at = linearisation.at(float(time[k]), reference.q[k], rest, rest)
            readings = dict(zip(names, zip(*sensing.rows(at), strict=True), strict=True))
            found.append(state_space(at, voltages_at(model, at, patches), readings))
        return tuple(found)
    return ()


def loops_about(
    setup: Setup,
    controllers: Sequence[Controller],
    readings: Array,
    models: Sequence[LinearModel],
    filtering: tuple[Array, Array, Array, Array],
) -> list[tuple[LinearModel, Feedback]]:
    """The linear `models` with the controllers, as they begin, that act there; none where they are not linear there.

    `filtering`: of readings before controllers get them.
    """
    is_asked_in_order = any(isinstance(controller, PythonControl) for controller in controllers)
    latest = 0 if is_asked_in_order else max(len(setup.times) - LONGEST, 0)
    observed = controllers[0] if controllers and isinstance(controllers[0], Observed) else None

    @cache
    def at(first: int) -> Feedback | None:
        if observed is None:
            return find_feedback(setup, controllers, readings, first)
        inner = find_feedback(observed.setup, observed.controllers, readings, first)
        return None if inner is None else observed.schedule.at(float(setup.times[first])).closed(inner)

    found = [(model, at(min(int(np.searchsorted(setup.times, model.time)), latest))) for model in models]
    known = [(model, feedback.behind(*filtering)) for model, feedback in found if feedback is not None]
    return known if len(known) == len(found) else []


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
    source: Outcome,
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
    first = initial_state(context.model)
    twists = [[part[0] for part in gear.twist(q[None], v[None])] for gear in plant.tree.gears]
    q[: len(first.q)], v[: len(first.v)] = first.q, first.v
    for gear, (way, rate) in zip(plant.tree.gears, twists, strict=True):
        q[gear.motor.q.start] = gear.sign * q[gear.joint.q.start] + way
        v[gear.motor.v.start] = gear.sign * v[gear.joint.v.start] + rate
    return State(q, v)


def _followed(
    run: Outcome, place_at: Callable[[Array], Array], held: Callable[[Array], Array], tip: str, quiet: float
) -> Followed:
    """Where the tip went against where it should be; `quiet` as there."""
    assert isinstance(run.analysis, ClosedLoop)
    model = run.model
    columns = np.concatenate([*model.motors.values(), np.zeros(0, dtype=int)]).astype(int)
    rates = np.array([model.sign(joint) for joint, of in model.motors.items() for _ in of]) * run.v[:, columns]
    error = _position(model, run.q, tip) - place_at(run.time)
    completed, is_disturbed = run.status == "completed", bool(run.analysis.disturbance)
    return Followed(run.time, error, place_at, rates, held(run.time), completed, is_disturbed, quiet)


def _place_of_tip(analysis: ClosedLoop, model: Model, source: Outcome, tip: str) -> Callable[[Array], Array]:
    paths, run = [path.components for path in model.scene.trajectory if path.point == tip], source.closer
    known, rest = (run.time, _position(run.model, run.q, tip)), commanded_rest(source)
    last = None if rest is None else (rest.since, _position(rest.model, rest.q[None], tip)[0])
    return partial(place_of_tip, end=analysis.last_time, known=known, paths=paths, last=last)


def _position(model: Model, q: Array, point: str) -> Array:
    return model.tree.places(q).at(model.tree.section(point)).r


def default_tip(model: Model) -> str:
    """The tool of the scene, or the tip of the last link."""
    if (tool := model.scene.tool_point) is not None:
        return tool
    body = next(node.body for node in reversed(model.tree.nodes) if node.body.points)
    return f"{body.name}.{'tip' if 'tip' in body.points else next(iter(body.points))}"
