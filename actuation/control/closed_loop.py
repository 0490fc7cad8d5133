"""Forward dynamics under sampled controllers: sensors, delay, saturation, feed-forward, disturbances."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout, suppress
from copy import copy
from dataclasses import replace
from functools import cache, partial
from io import StringIO

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, SolveError
from ...common.libraries import scipy
from ...mbs._core import TimeFunction
from ...mbs.analysis.forward import actuator_commands, command_ranges, largest_moments
from ...mbs.linear.linearisation import LinearEquations
from ...mbs.linear.statics import initial_state
from ...mbs.model.amplifiers import joined
from ...mbs.model.drives import Drives, PointDrive
from ...mbs.model.gears import with_compliance
from ...mbs.model.known_motion import State
from ...mbs.model.model import Model
from ...mbs.posture.start import undeformed_posture
from ...mbs.quantities.settling import commanded_rest
from ...mbs.run.context import amplifiers_on, place_of, strain_directions
from ...mbs.run.drive import Control, drive_robot
from ...mbs.run.gears import with_motor_coordinates
from ...mbs.run.record import Run
from ...mbs.run.replay import replay_times, supplied
from ..context import ActuatedContext
from .controllers import ComputedTorqueControl, Controller, PythonControl, make_controllers
from .linear import with_voltages
from .linear_model import LinearModel, state_space
from .loop import AmplifiedLoop, Loop, between, held_commands, loop_record, times_of_run
from .margins import MOST, Feedback, Loops, eigenvalue_count, lowest_frequency
from .metrics import LoopMotion, last_change
from .observer import Observed, make_observed
from .records import SampledAnalysis
from .robot import Setup, default_tip, estimated_sensors, input_names, needed_sensors, whole_robot
from .signals import Filter, Sensing, Signal, filters, make_signals, merged, readings_at

APART = 1e-6  # of a run, between two times of a spline
INSTANT = 1e-6  # of the sample time, before and after which commands are read where they change


class LoopTask:
    """What a closed loop is to do: the robot, the motion that it follows, signals of both, and limits. SI units."""

    def __init__(self, analysis: SampledAnalysis, context: ActuatedContext) -> None:
        assert analysis.actuation is not None
        self.analysis, self.context = analysis, context
        self.source = source = context.outcomes[analysis.actuation]  # the inverse analysis
        self.plant = plant = with_compliance(context.model.without_paths())
        self.moved = with_motor_coordinates(source, plant)  # motion of the source in coordinates of the plant
        self.robot = robot = whole_robot(context, source)
        self.tip = place_of(context.whole, analysis.tip) or default_tip(plant)
        signals = partial(make_signals, plant, context, whole=context.whole)
        read, estimated = tuple(signals(analysis.sensor)), tuple[Signal, ...]()
        if analysis.observer is None:
            needed = signals(needed_sensors(robot, analysis.controller))
            balanced = {signal.name for signal in needed if signal.sensor.pzt is not None}
            read = tuple(replace(of, by_volts=0.0) if of.name in balanced else of for of in merged(read, needed))
        else:
            tip = analysis.tip or default_tip(robot.model)
            found = merged(signals(estimated_sensors(robot, analysis.controller, tip)), ())
            estimated = tuple(replace(of, by_volts=0.0) for of in found)  # balanced patches
        self.sensing, self.ideal = Sensing(plant, read), Sensing(plant, estimated)  # ideal: what an observer estimates
        self.amplifiers = amplifiers_on(plant, context.patches)
        self.ranges = command_ranges(context.model, context.patches)
        if analysis.unlimited:
            self.amplifiers, self.ranges = self.amplifiers.unlimited(), np.inf * np.sign(self.ranges)


class ClosedLoop(SampledAnalysis):
    """Motion under sampled control; reference, feed-forward and start are those of the inverse analysis `actuation`.

    Samples are at 0, sample_time, …; a zero-order hold applies the command of each `delay` later. Torques and voltages
    are limited as in the scene unless `unlimited`; bandwidth and delay of amplifiers act in any case, also in margins.
    Hysteresis is not linear, and margins leave it out. An initial state of [initial] is on the trajectories.

    Sensors name patches by their layout. Joints with several coordinates have one signal per coordinate, "joint/NAME
    1", "joint/NAME 2", with the same gains.
    """

    def run(self, context: ActuatedContext) -> Run:
        """Run the closed loop about the motion of an inverse analysis, from its initial state.

        The run's details are a `LoopRecord`. A run that diverges ends there and is kept. Raises `InputError` for
        controllers that do not fit the robot, `SolveError` where a user's function fails.
        """
        task = LoopTask(self, context)
        outputs, place_at, models = replay_times(task.source, self), _place_of_tip(task), loop_models(task)
        lowest = lowest_frequency(models, self.controller, self.sample_time, self.delay)
        times, rows = times_of_run(outputs, place_at, lowest)
        setup, wanted = _setup(task, outputs)
        acting = _controllers(task, setup, wanted)
        observed = next((one for one in acting if isinstance(one, Observed)), None)
        begun = [of if isinstance(of, PythonControl) else copy(of) for of in acting]
        loop = Loop(setup, task.sensing.signals, acting, task.ranges, self.seed)
        states: list[Array] | None = None if observed is None else []
        control, held = _control(task, loop, setup.times, states)
        disturbing = ((place_of(context.whole, str(load.point)), load.components) for load in self.disturbance)
        drives = Drives(at_points=tuple(PointDrive(*load) for load in disturbing))
        run = drive_robot(task.plant, self, _start(task), context.progress, drives=drives, times=times, control=control)
        closer, run = run.closer, run.at([k for k in rows if k < len(run.time)])
        motion = _followed(task, closer, place_at, held, _last_change(task, outputs))
        readings = loop.readings if observed is None else np.hstack([loop.readings, observed.estimates])
        laws, along = loops_about(setup, begun, readings[: loop.taken], models)
        estimate = None
        if observed is not None and states is not None:
            estimate = observed.record(_true_values(task, states[: loop.taken]))
        with run.arithmetic:
            error = np.linalg.norm(position(run.model, run.q, task.tip) - place_at(run.time), axis=1)
            # not of slower sensors, whose loops are not the same from sample to sample
            loops = () if loop.is_slow else _loops_with_filters(task, laws)
            record = loop_record(self, setup, loop, acting, motion, loops=loops, lowest=lowest)
        record = replace(record, tip_error=error, feedback=along, estimate=estimate)

        def completed(of: Run) -> Run:
            return replace(of, commanded=context.model.by_motor(held(of.time)), details=record)

        return replace(completed(run), look_closer=lambda: completed(closer))


def _setup(task: LoopTask, outputs: Array) -> tuple[Setup, Array]:
    """Samples before the last of `outputs` (s), with what is read there on the reference; and what is estimated."""
    T, source, moved = task.analysis.sample_time, task.source, task.moved
    samples = outputs[0] + np.arange(int(np.ceil(np.ptp(outputs) / T * (1 - 1e-12)))) * T
    if not moved.gears:  # gears that give are known at outputs
        source = _resolved(source)
        moved = with_motor_coordinates(source, task.plant)
    V = _feed_forward(task, source.time - task.analysis.delay - T / 2, whole=True)[:, len(task.robot.motors) :]
    states = moved.q, moved.v, moved.a, V
    reference, wanted = (between(samples, source.time, of.read(*states)) for of in (task.sensing, task.ideal))
    filtered = Filter(task.sensing.signals, T)
    reference[:] = [filtered(y) for y in reference]
    setup = Setup(
        robot=task.robot,
        inputs=input_names(task.robot),
        outputs=tuple(signal.name for signal in task.sensing.signals),
        times=samples,
        sample_time=T,
        delay=task.analysis.delay,
        reference=reference,
        feed_forward=_feed_forward(task, samples),
    )
    return setup, wanted


def _controllers(task: LoopTask, setup: Setup, wanted: Array) -> Sequence[Controller]:
    """The controllers, or the observer that they ask, of values that are `wanted` (K, estimates) on the reference."""
    if task.analysis.observer is None:
        return make_controllers(task.analysis.controller, setup)
    nominal = _feed_forward(task, setup.times, whole=True)
    return [make_observed(task.analysis, task.context, setup, wanted, task.ranges, nominal)]


def _control(
    task: LoopTask, loop: Loop, samples: Array, states: list[Array] | None
) -> tuple[Control, Callable[[Array], Array]]:
    """The control of the plant by a loop, with states at samples added to `states`; and its commands at times (s)."""
    plant, patches, delay = task.plant, task.context.patches, task.analysis.delay
    n_q, rates = plant.tree.n_q, plant.tree.n_q + plant.tree.n_v

    def at_sample(k: int, t: float, state: Array) -> Array:
        q, v, a = (part[None] for part in (state[:n_q], state[n_q:rates], state[rates:]))
        V = held(np.array([t]), after=-instant)[:, len(loop.first) - len(task.amplifiers.slew) :]
        if states is not None:
            states.append(np.append(state, V))
        return loop(k, t, task.sensing.read(q, v, a, V)[0])

    T, controller = task.analysis.sample_time, at_sample
    arriving: Loop | AmplifiedLoop = loop
    if task.amplifiers.acts:
        directions = strain_directions(plant, patches)
        arriving = controller = AmplifiedLoop(
            loop, at_sample, samples, T, amplifiers=task.amplifiers, directions=directions
        )
        samples = arriving.times
    instant = INSTANT * T
    held = partial(held_commands, samples=samples, delay=delay, loop=arriving, after=instant)
    control = Control(
        commands=actuator_commands(plant, patches),
        first=arriving.first,
        times=samples,
        delay=delay,
        controller=controller,
        held=partial(held, after=-instant),
        instant=instant,
    )
    return control, held


def _true_values(task: LoopTask, states: Sequence[Array]) -> dict[str, Array]:
    """Return what an observer estimates, in the `states` of the plant with its voltages, by name."""
    n_q, n_v = task.plant.tree.n_q, task.plant.tree.n_v
    values = task.ideal.read(*np.split(np.array(states), [n_q, n_q + n_v, n_q + 2 * n_v], axis=1))
    return dict(zip([signal.name for signal in task.ideal.signals], values.T, strict=True))


def _loops_with_filters(task: LoopTask, laws: Sequence[tuple[LinearModel, Feedback]]) -> Loops:
    """Linear loops behind the filters of sensors, but for those of too many eigenvalues."""
    T, delay = task.analysis.sample_time, task.analysis.delay
    filtering = filters(task.sensing.signals, T)
    loops = [(model, feedback.behind(*filtering)) for model, feedback in laws]
    return [one for one in loops if eigenvalue_count(one, T, delay) <= MOST]


def _resolved(source: Run) -> Run:
    """The run with times between its outputs, but for those that are so near to others that a spline would swing."""
    run = source.closer
    apart = np.diff(run.time, prepend=-np.inf) > APART * np.ptp(source.time)
    return run.at([int(k) for k in np.flatnonzero(apart)])


def loop_models(task: LoopTask) -> tuple[LinearModel, ...]:
    """Linearize the robot at rest on its path: at start, middle and end, with readings of sensors as outputs.

    Empty where there is no linear model, as in singular postures.
    """
    model, time, q = task.plant, task.source.time, task.moved.q
    rest, rows = np.zeros(model.tree.n_v), sorted({0, len(time) // 2, len(time) - 1})
    with suppress(SolveError, InputError):
        linearisation, found = LinearEquations(model, q[0]), []
        for k in rows:
            at = linearisation.at(float(time[k]), q[k], rest, rest)
            readings = readings_at(model, at, task.sensing.signals)
            found.append(state_space(with_voltages(model, at, task.context.patches), readings))
        return tuple(found)
    return ()


def loops_about(
    setup: Setup, controllers: Sequence[Controller], readings: Array, models: Sequence[LinearModel]
) -> tuple[list[tuple[LinearModel, Feedback]], Mapping[float, Feedback]]:
    """The linear `models`, each with the linear controllers at its time; and controllers by time (s).

    The latter are at the start, or at each time of an observer's schedule. Both are empty where a controller is not
    linear at the time of a model. `readings` (K, outputs), in units of sensors, show how far a run deviates.
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
    of, motors = joined(of.amplifiers for of in setup.robot.of_links.values()), np.zeros((2, len(setup.robot.motors)))
    late = np.hstack([motors, np.stack([of.lag, of.delay])])
    known = [(model, replace(feedback, late=late)) for model, feedback in found if feedback is not None]
    if len(known) < len(found) or not known:
        return [], {}
    times = [float(setup.times[0])] if observed is None else observed.schedule.times.tolist()
    return known, {t: law for t in times if (law := at(t, 0)) is not None}


def _last_change(task: LoopTask, time: Array) -> float:
    """The time (s) from which paths and loads stay as they are at the end of `time` (T,)."""
    scene, analysis = task.plant.scene, task.analysis
    exciting = [target for path in scene.trajectory for _, target in path.targets]
    exciting += scene.load_functions
    exciting += [function for load in analysis.disturbance for function in load.components.values()]

    def values(of: TimeFunction, time: Array) -> Array:
        return of.sample(np.clip(time, 0.0, analysis.last_time))[0][:, None]

    return max((last_change(partial(values, of), time) for of in exciting), default=0.0)


def _feed_forward(task: LoopTask, times: Array, *, whole: bool = False) -> Array:
    """Torques and voltages (K, inputs) that are fed forward, in the middle of each command's time; `whole`: all."""
    analysis, context, source, moved = task.analysis, task.context, task.source, task.moved
    middle = np.minimum(times + analysis.delay + analysis.sample_time / 2, source.time[-1])
    most = largest_moments(context.model, limits=False)
    values = supplied(source, most, context.patches, limited=not analysis.unlimited).sample(middle.tolist())
    kind = "joints+pzt" if whole else analysis.feed_forward
    if kind == "none":
        values[:, : len(most)] = 0.0
    if kind != "joints+pzt":
        values[:, len(most) :] = 0.0
    column = 0
    for joint, columns in context.model.motors.items():  # with compliant gears: known at outputs
        if moved.gears and kind != "none":
            values[:, column : column + len(columns)] = between(middle, source.time, moved.moments[joint])
        column += len(columns)
    return values


def _start(task: LoopTask) -> State:
    """As the inverse analysis starts, or as the scene says, compliant gears with their twist there."""
    context, plant, moved = task.context, task.plant, task.moved
    if context.start is not None:
        return context.start
    q, v = moved.q[0].copy(), moved.v[0].copy()
    if task.analysis.start == "actuation":
        return State(q, v)
    first = initial_state(context.model, undeformed_posture(context.model))
    twists = [[part[0] for part in gear.twist(q[None], v[None])] for gear in plant.tree.gears]
    q[: len(first.q)], v[: len(first.v)] = first.q, first.v
    for gear, (way, rate) in zip(plant.tree.gears, twists, strict=True):
        q[gear.motor.q.start] = gear.sign * q[gear.joint.q.start] + way
        v[gear.motor.v.start] = gear.sign * v[gear.joint.v.start] + rate
    return State(q, v)


def _followed(
    task: LoopTask, run: Run, place_at: Callable[[Array], Array], held: Callable[[Array], Array], quiet: float
) -> LoopMotion:
    """The motion of the tip against the one wanted."""
    model = run.model
    signs = np.array([model.sign(joint) for joint, of in model.motors.items() for _ in of])
    rates = signs * run.v[:, model.motor_columns]
    error = position(model, run.q, task.tip) - place_at(run.time)
    return LoopMotion(
        time=run.time,
        error=error,
        place_at=place_at,
        rates=rates,
        held=held(run.time),
        completed=run.status == "completed",
        is_disturbed=bool(task.analysis.disturbance),
        quiet=quiet,
        length=model.size,
    )


def _place_of_tip(task: LoopTask) -> Callable[[Array], Array]:
    """Where the tip should be (T, d), m, at times (T,), s: on its paths, constant before 0 and after their end.

    Without a path, where it is in the inverse analysis until all paths end, then the final position.
    """
    tip, run, rest = task.tip, task.source.closer, commanded_rest(task.source)
    paths = [path.components for path in task.plant.scene.trajectory if path.point == tip]
    known = scipy.interpolate.CubicSpline(run.time, position(run.model, run.q, tip))

    def place_at(time: Array) -> Array:
        place: Array = known(time)
        for components in paths:
            for component, target in components.items():
                place[:, "xyz".index(component)] = target.sample(np.clip(time, 0.0, task.analysis.last_time))[0]
        if rest is not None:
            place[time >= rest.since] = position(rest.model, rest.q[None], tip)[0]
        return place

    return place_at


def position(model: Model, q: Array, point: str) -> Array:
    """Places (T, d), m, of a `point` at q (T, n_q), m and rad."""
    return model.tree.places(q).at(model.tree.section(point)).r


LONGEST, FEWEST = 64, 12  # samples that are looked at
AT, LATER = 1, 4  # sample at which readings are off: the first may be special; and that of all together
SIZES = 1e-4, 1e-7, 1e-10  # of how far readings are off in the run, until commands are linear in them
LINEAR = 0.02  # of the largest change of each command: error of the sum of changes, later and of twice the size
RANK = 1e-8  # of the largest singular value: less is round-off
SAME = 1e-3  # of the largest response: what the states found may leave of it


def find_feedback(setup: Setup, controllers: Sequence[Controller], readings: Array, first: int) -> Feedback | None:
    """Linearize controllers about the reference from sample `first` on; None if nonlinear, changing, or of many states.

    Each reading deviates at one sample, by much less than `readings` (K, outputs), in units of sensors, of a run. The
    Hankel matrix of the commands' response has the controllers' states as factors (B. L. Ho and R. E. Kalman,
    Regelungstechnik 14, 1966; S. Y. Kung, Asilomar Conf. 1978).
    """
    count = min(LONGEST, len(setup.times) - first)
    if count < FEWEST:
        return None
    reference, off = setup.reference[first : first + count], readings - setup.reference[: len(readings)]
    size = np.abs(off).max(axis=0, initial=0.0)
    size[size == 0.0] = 1.0

    def commands(changes: Array) -> Array:
        acting = [copy(controller) for controller in controllers]  # as they begin
        found = np.zeros((count, len(setup.inputs)))
        for k, y in enumerate(reference + changes):
            for controller in acting:
                found[k] += controller(first + k, y)
        return found

    with suppress(SolveError), np.errstate(all="ignore"), redirect_stdout(StringIO()):  # once more, of what it printed
        still = commands(np.zeros_like(reference))
        for share in SIZES:
            a, answers = share * size, np.zeros((len(size), *still[AT:].shape))
            for j, each in enumerate(np.diag(a)):
                change = np.zeros_like(reference)
                change[AT] = each
                answers[j] = (commands(change) - still)[AT:]
            signs = 2.0 * (-1.0) ** np.arange(len(a))
            together = np.zeros_like(reference)
            together[LATER] = signs * a
            seen, expected = commands(together) - still, np.zeros_like(still)
            expected[LATER:] = np.tensordot(signs, answers[:, : count - LATER], 1)
            if np.abs(seen - expected).max(initial=0.0) <= LINEAR * np.abs(expected).max(initial=0.0):
                return _realized(setup, np.moveaxis(answers, 0, 2), a)
    return None


def _realized(setup: Setup, answers: Array, a: Array) -> Feedback | None:
    """The least states whose commands are `answers` (samples, inputs, outputs) to readings that are off by `a`."""
    size = np.abs(answers).max(axis=(1, 2), initial=0.0)
    grown = float(np.abs(answers[len(answers) // 2 :]).max(initial=0.0)) / (float(size[: len(size) // 2].max()) or 1.0)
    growth = max(grown, 1.0) ** (2.0 / len(answers))  # a sample, of controllers that are unstable by themselves
    answers = answers / growth ** np.arange(len(answers))[:, None, None]
    size = np.abs(answers).max(axis=(0, 2), initial=0.0)
    size[size == 0.0] = 1.0
    scaled = answers / size[:, None]
    inputs, outputs, later = len(size), len(a), scaled[1:]
    half = len(later) // 2
    blocks = [np.concatenate(later[k : k + half]) for k in range(len(later) - half + 1)]
    U, values, V = np.linalg.svd(np.hstack(blocks[:-1]), full_matrices=False)
    largest = float(np.abs(scaled).max(initial=0.0))
    rank = int(np.count_nonzero(values > RANK * max(values.max(initial=0.0), largest)))
    root = np.sqrt(values[:rank])
    A = (U[:, :rank].T @ np.hstack(blocks[1:]) @ V[:rank].T) / root[:, None] / root
    B, C = root[:, None] * V[:rank, :outputs], U[:inputs, :rank] * root
    x = B
    for expected in later:
        if np.abs(C @ x - expected).max(initial=0.0) > SAME * largest:
            return None
        x = A @ x
    return Feedback(growth * A, growth * B / a, size[:, None] * C, answers[0] / a, setup.inputs, setup.outputs)
