"""Forward dynamics under a sampled controller: sensors, delay, saturation, feed-forward, disturbances."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from ...common.arrays import Array, as_list
from ...common.errors import SolveError
from ...mbs.analysis.drive import Progress, SampledControl, drive, initial_state
from ...mbs.analysis.elastic_joints import rotors_like, with_compliance, with_rotors
from ...mbs.analysis.outcome import Forces
from ...mbs.analysis.planar_outcome import PlanarOutcome
from ...mbs.analysis.replay import motor_limits, replay_times
from ...mbs.model.model import ZERO, Model, load_measures
from ...mbs.model.raised_mass import coordinate_factors, factors_of, integrated, modal_factors
from ...mbs.model.system import MechanismSystem
from ...mbs.quantities.joint_space import motor_rates
from ...mbs.quantities.observation import point_motion
from ...mbs.scene.loads import Load
from ...mbs.solve.linearisation import Linearisation
from ...mbs.solve.state import State
from ..context import PlanarActuatedContext, PlanarWholeLinks, place_of
from ..patches.patches import PatchArray, with_factors
from ..patches.voltages import allocation
from .choice import make_controller, needed_sensors
from .controllers import Setup
from .linear_model import LinearModel, linear_model
from .loop import Loop
from .loop_keys import SampledAnalysis
from .loop_record import between, held_commands, held_until, loop_record, sample_times, times_of_run
from .margins import lowest_frequency
from .metrics import Followed, place_of_tip
from .planar_robot import PlanarRobot
from .robot import Robot, input_names
from .signals import Signal, merged, rows_first, sensing, signals


class ClosedLoop(SampledAnalysis):
    """Motion under sampled control; reference, feed-forward and start are those of the inverse analysis `actuation`.

    Samples are at 0, sample_time, …; a zero-order hold applies the command of each `delay` later. Torques and voltages
    are limited as in the scene unless `unlimited`. The initial state is that of the inverse analysis, or [initial] of
    the scene, on the trajectories. `seed` initializes the noise. `tip` is the point of the reported error.
    """

    disturbance: tuple[Load, ...] = ()
    """Loads at points, unknown to `actuation`."""

    def run(self, context: PlanarActuatedContext) -> PlanarOutcome:
        """Motion and commands."""
        source = context.source(self.actuation)
        assert source is not None
        return run_closed_loop(context.model, self, source, context.patches, context.progress, context.whole)


def run_closed_loop(
    model: Model,
    analysis: ClosedLoop,
    source: PlanarOutcome,
    patches: Mapping[str, PatchArray],
    progress: Progress,
    whole: PlanarWholeLinks | None = None,
) -> PlanarOutcome:
    """The closed loop of `analysis` about the motion of the inverse analysis `source`, from its initial state.

    Controllers know the `whole` links of a robot in which some are in pieces, sensors and patches act on the pieces.

    The outcome's details are a `LoopRecord`. A run that diverges ends there and is kept. Raises `InputError` for
    controllers that do not fit the robot, `SolveError` where a user's function fails.
    """
    built = with_compliance(model)
    moved = with_rotors(source, built)
    robot = PlanarRobot(model, patches, source)
    if whole is not None:
        robot = PlanarRobot(whole.model, whole.patches, whole.told(source))
    read = _read(robot, built, analysis, patches, whole)
    assembly = _assembly(model, built, analysis, source, read, whole)
    sensor, outputs = sensing(assembly, read), replay_times(source, analysis)
    tip = place_of(whole, analysis.tip) or _default_tip(assembly)
    place_at, models = _place_of_tip(analysis, assembly, source, tip), loop_models(built, moved)
    lowest = lowest_frequency(models, analysis.controller, analysis.sample_time, analysis.delay)
    times, rows = times_of_run(outputs, place_at, lowest)
    setup = _setup(robot, model, analysis, source, patches, read, outputs, sensor.read(*_states(moved)))
    acting = [make_controller(record, setup, analysis.controller) for record in analysis.controller]
    limit = np.concatenate([motor_limits(model), *(array.limit for array in patches.values())])
    limit = np.full_like(limit, np.inf) if analysis.unlimited else limit
    loop = Loop(setup, read, acting, limit, analysis.seed)
    start, driven = _start(assembly, analysis, moved, model), assembly
    if (raised := integrated(built)) is not built:  # the same in other coordinates
        all_factors = coordinate_factors(built)
        patches = {body: with_factors(array, factors_of(built, array.carriers)) for body, array in patches.items()}
        read = tuple(s if s.row else replace(s, vector=s.vector / factors_of(built, s.bodies)) for s in read)
        start = State(start.q * all_factors, start.v * all_factors)
        driven = _assembly(model, raised, analysis, source, read, whole)
        sensor = sensing(driven, read)
    voltages = [(driven.index[array.carriers[0]], array.Phi_V) for array in patches.values()]
    held = partial(held_commands, setup=setup, loop=loop)
    before = partial(held, after=-1e-9)  # of accelerations
    control = SampledControl(len(model.motors), voltages, loop.first, sensor, setup.times, analysis.delay, loop, before)
    outcome = drive(driven, analysis, start, progress, reported=assembly, times=times, control=control)
    closer, outcome = outcome.closer, outcome.at([k for k in rows if k < len(outcome.time)])
    runs = _followed(outcome, place_at, held, tip), _followed(closer, place_at, held, tip)
    record = loop_record(analysis, setup, loop, acting, runs, models, lowest, gears=bool(built.gears))

    def told(of: PlanarOutcome) -> PlanarOutcome:
        return replace(of, forces=Forces(tau=held(of.time)[:, : len(model.motors)]), details=record)

    return replace(told(outcome), look_closer=lambda: told(closer))


def loop_models(model: Model, reference: PlanarOutcome) -> tuple[LinearModel, ...]:
    """The robot at rest on its reference at start, middle and end; none where it is singular."""
    rows = sorted({0, len(reference.time) // 2, len(reference.time) - 1})
    linearisation, rest = Linearisation(model, reference.q[0]), np.zeros_like(reference.v[0])
    with suppress(SolveError):
        return tuple(
            linear_model(linearisation.at(float(reference.time[k]), reference.q[k], rest, rest), {}) for k in rows
        )
    return ()


def _read(
    robot: Robot, built: Model, analysis: ClosedLoop, patches: Mapping[str, PatchArray], whole: PlanarWholeLinks | None
) -> tuple[Signal, ...]:
    """The readings that the scene asks for, and those that its controllers need."""
    needed = needed_sensors(robot, analysis.controller)
    given, more = (
        [s for sensor in sensors for s in signals(built, patches, sensor, whole)]
        for sensors in (analysis.sensor, needed)
    )
    return rows_first(merged(given, more))


def _assembly(
    model: Model,
    built: Model,
    analysis: ClosedLoop,
    source: PlanarOutcome,
    read: Sequence[Signal],
    whole: PlanarWholeLinks | None,
) -> MechanismSystem:
    """The robot with its motors, loads and disturbances, and the rows along which sensors read."""
    loads = model.loads if source.details.loads is None else source.details.loads
    drives = [*((row, ZERO) for row in built.motors.values()), *loads]
    placed = [load.model_copy(update={"point": place_of(whole, load.point)}) for load in analysis.disturbance]
    drives += load_measures(built.scene, placed)
    return MechanismSystem(built, built.joints, drives, [signal.row for signal in read if signal.row is not None])


def _setup(
    robot: PlanarRobot,
    model: Model,
    analysis: ClosedLoop,
    source: PlanarOutcome,
    patches: Mapping[str, PatchArray],
    read: Sequence[Signal],
    outputs: Array,
    readings: Array,
) -> Setup:
    """What controllers may know; `readings` (T, sensors) are those of the motion of `source` at its outputs."""
    T = analysis.sample_time
    times = sample_times(outputs, T)
    return Setup(
        robot, robot.model, robot.arrays, input_names(robot), tuple(s.name for s in read), times, T, analysis.delay,
        between(times, source.time, readings), _feed_forward(model, analysis, source, patches, times), robot.source,
    )  # fmt: skip


def _states(outcome: PlanarOutcome) -> tuple[Array, ...]:
    return tuple(np.ascontiguousarray(x) for x in (outcome.q, outcome.v, outcome.a))


def _start(assembly: MechanismSystem, analysis: ClosedLoop, source: PlanarOutcome, rigid: Model) -> State:
    """As `source` starts, or as the scene says, with the rotors of elastic gears wound as in `source`."""
    if analysis.start == "actuation":
        return State(source.q[0].copy(), source.v[0].copy())
    start = initial_state(MechanismSystem(rigid, [*rigid.joints, *rigid.trajectories], rigid.loads))
    return rotors_like(assembly.model, start, source)


def _followed(
    outcome: PlanarOutcome, place_at: Callable[[Array], Array], held: Callable[[Array], Array], tip: str
) -> Followed:
    """Where the tip went against where it should be."""
    assert isinstance(outcome.analysis, ClosedLoop)
    error = point_motion(outcome, tip).position - place_at(outcome.time)
    completed, is_disturbed = outcome.status == "completed", bool(outcome.analysis.disturbance)
    return Followed(outcome.time, error, place_at, motor_rates(outcome), held(outcome.time), completed, is_disturbed)


def _place_of_tip(
    analysis: ClosedLoop, assembly: MechanismSystem, source: PlanarOutcome, tip: str
) -> Callable[[Array], Array]:
    paths = [path.components for path in assembly.model.scene.trajectory if path.point == tip]
    run = source.closer if source.in_pieces is None else source
    known = run.time, point_motion(run, tip).position
    return partial(place_of_tip, end=analysis.last_time, known=known, paths=paths)


def _default_tip(assembly: MechanismSystem) -> str:
    """The point whose error is measured: that of the first trajectory of a point, or the last tip."""
    driven = [trajectory.point for trajectory in assembly.model.scene.trajectory if trajectory.point is not None]
    if driven:
        return driven[0]
    body = assembly.model.links[-1]
    return f"{body.name}.{'tip' if 'tip' in body.points else next(iter(body.points))}"


def _feed_forward(
    model: Model, analysis: ClosedLoop, source: PlanarOutcome, patches: Mapping[str, PatchArray], times: Array
) -> Array:
    """(K, inputs) moments and voltages of the inverse analysis, in the middle of the time for which each is held."""
    voltages: list[Array] = [np.zeros((len(times), len(array.edges))) for array in patches.values()]
    moments: Array = np.zeros((len(times), len(model.motors)))
    middle = held_until(times, analysis, source.time[-1])
    if analysis.feed_forward != "none" and source.tau is not None:
        moments, F_p = _found(source, middle)
        if analysis.feed_forward == "joints+pzt" and F_p is not None:
            voltages = [
                allocation(array, limited=not analysis.unlimited).solve(
                    np.ascontiguousarray(F_p[:, source.modal_columns(*array.carriers)])
                )
                for array in patches.values()
            ]
    return np.hstack([moments, *voltages])


def _found(source: PlanarOutcome, times: Array) -> tuple[Array, Array | None]:
    """τ and F_p that an inverse analysis found, at any time where it was recorded or is algebraic, else by a spline."""
    moments, F_p = source.motor_moments, source.F_p
    assert moments is not None
    anytime = source.details.actuation_source(source) if F_p is not None else None
    if anytime is None:
        return between(times, source.time, moments), None if F_p is None else between(times, source.time, F_p)
    tau, F_p = anytime.sample(as_list(times))
    if source.integrated is not None and F_p is not None:
        F_p = F_p * modal_factors(source.assembly.model)
    return between(times, source.time, moments) if source.gears else tau, F_p
