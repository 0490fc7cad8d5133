"""Forward dynamics under given loads, and under the actuation that an inverse analysis found."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import count
from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ...common.arrays import Array
from ...common.errors import InputError, either
from .. import _core
from ..fields.waypoints import spline
from ..linear.statics import hanging_joints, initial_state
from ..model.amplifiers import joined
from ..model.drives import Command, Drives, Replayed
from ..model.gears import with_compliance
from ..model.known_motion import State
from ..model.model import Model
from ..model.system import motor_commands
from ..posture.posture import mobility
from ..posture.start import displaced_joints, undeformed_posture
from ..run.context import Context, PatchedLink, amplifiers_on, strain_directions
from ..run.drive import drive_robot
from ..run.gears import DEGREE, with_motor_coordinates
from ..run.record import Run
from ..run.replay import functions_within, left_paths, path_numbers, point_numbers, replay_times, supplied
from ..scene.analysis import ActuatedAnalysis, Analysis, Need

STEPS = 20  # of the shortest lag or delay of amplifiers, and of outputs, between which voltages are linear
MOST_STEPS = 100_000
OF_RECORD, OF_PRESCRIBED = 1.0, 10.0  # evaluations in the time of finding forces: of a step made again, of a posture
SEEN = 1e3  # times the tolerance of a motion, which p̈ jumps by: looser steps do not see that


class Forward(ActuatedAnalysis):
    """Motion under the loads of the scene and the inputs computed by the inverse analysis `actuation`.

    Limits of amplifiers are those of current and slew rate, too. Their bandwidth and delay always act.
    """

    kind: Literal["forward"]
    apply: Literal["joints", "joints+pzt", "trajectory", "points"] | None = None
    """Inputs taken from `actuation`: motor torques, torques and voltages, forces along the trajectories, or at the
    actuation points."""
    limits: bool = False
    """Saturation of motors and patches at their limits."""

    follows_trajectories = False
    is_resumable = True

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.actuation is None) != (self.apply is None):
            raise ValueError(
                'expected the keys "actuation" and "apply" together, found only '
                + ('"apply"' if self.actuation is None else '"actuation"')
            )
        if self.limits and self.apply not in ("joints", "joints+pzt"):
            raise ValueError(
                f'expected limits = true only with apply = "joints" or "joints+pzt", found apply = "{self.apply}"'
            )
        return self

    def run(self, context: Context) -> Run:
        """Motion under loads and `actuation`, without trajectories; with an actuation, from the start of that analysis.

        Raises `InputError` where forces to apply do not fit the robot, `SolveError` where there is no equilibrium to
        start from.
        """
        model, progress = with_compliance(context.model.without_paths()), context.progress
        if self.actuation is None:
            undeformed = undeformed_posture(model)
            start = initial_state(model, undeformed)
            texts = (*displaced_joints(model, undeformed), *hanging_joints(model, undeformed, start))
            return drive_robot(model, self, start, progress, warnings=texts, earlier=context.earlier)
        source = context.outcomes[self.actuation]
        if model.tree.gears and not source.model.tree.gears:
            replayed, start = _behind_gears(source, model, self, context)
        else:
            replayed, start = _replayed(context, model, source, self), State(source.q[0], source.v[0])
            replayed = replayed._replace(evaluations=OF_RECORD)
            if source.prescribed is not None:
                is_seen = self.tolerance < SEEN * source.analysis.tolerance
                breaks = source.prescribed.breaks if is_seen else ()
                replayed = replayed._replace(evaluations=OF_PRESCRIBED, breaks=breaks)
        if self.apply == "trajectory" and source.recording is not None:  # others may ring where `source` did not
            replayed = replayed._replace(integrator=source.statistics.integrator.name)
        run = drive_robot(
            model,
            self,
            context.start or start,
            progress,
            drives=Drives(replayed=replayed),
            times=replay_times(source, self),
            earlier=context.earlier,
        )
        if self.apply == "trajectory":  # others act without what makes up for vibrations
            statistics = run.statistics
            warnings = (*statistics.warnings, *left_paths(source, run))
            run = replace(run, statistics=replace(statistics, warnings=warnings))
        return run

    def needs(self) -> Iterator[Need]:
        """Yield the scene's tables that the analysis requires: of patches or actuation points, by `apply`."""
        table = {"joints+pzt": "pzt", "points": "actuation_points"}.get(self.apply or "")
        if self.apply is not None and table is not None:
            yield Need("apply", self.apply, table)

    def replay_problems(self, source: Analysis) -> Iterator[str]:
        """Yield a message if `source` does not compute the forces to apply."""
        if source.applicable and self.apply not in source.applicable:
            more = f': "{source.name}" takes more than the forces on its trajectories'
            why = more if self.apply == "trajectory" else ""
            yield (
                f'apply: expected {either(source.applicable)} with an analysis of kind "{source.kind}", found'
                f' "{self.apply}"{why}'
            )


def _replayed(context: Context, model: Model, source: Run, analysis: Forward) -> Replayed:
    """What `source` found, as it acts on `model`, whose links may be other ones."""
    nothing = Command(np.zeros(model.tree.n_v))
    if analysis.apply == "trajectory":
        forces, joints, at_points, count = path_numbers(source)
        rows = [row for row in source.model.rows if row.is_trajectory and row.kind == "coordinate"]
        along = [Command(row.sign * np.eye(model.tree.n_v)[row.coordinate]) for row in rows]
        return Replayed(forces, (*along, *[nothing] * (count - len(along))), at_points, joints)
    if analysis.apply == "points":
        chosen = list(context.at_points(source))
        at_points = {point: dict(zip("xyz", range(3 * k, 3 * k + 3), strict=True)) for k, point in enumerate(chosen)}
        return Replayed(point_numbers(source, context.points), (nothing,) * (3 * len(chosen)), at_points)
    _check_motors(source.model, analysis, source.q[0])
    patches = context.patches if analysis.apply == "joints+pzt" else {}
    forces = _supplied(source, largest_moments(model, limits=analysis.limits), patches, analysis)
    return Replayed(forces, actuator_commands(model, patches), moments=numbers_of_motors(model))


def actuator_commands(model: Model, patches: Mapping[str, PatchedLink]) -> tuple[Command, ...]:
    """Generalized forces of unit commands: of motors, N·m or N, on sections or frames; of patches, V, on link modes."""
    return (*motor_commands(model), *map(Command, strain_directions(model, patches)))


def numbers_of_motors(model: Model) -> dict[str, list[int]]:
    """Numbers of motor commands by joint, one joint after the other."""
    numbers = count()
    return {joint: [next(numbers) for _ in columns] for joint, columns in model.motors.items()}


def _behind_gears(source: Run, model: Model, analysis: Forward, context: Context) -> tuple[Replayed, State]:
    """Where gears of `model` give: moments at the outputs of `source` and splines between these, and its voltages.

    And where their motors begin.
    """
    if analysis.apply not in ("joints", "joints+pzt"):
        raise InputError(
            'apply: expected "joints" or "joints+pzt" for joints with stiffness',
            f'"{analysis.apply}"',
        )
    _check_motors(source.model, analysis, source.q[0])
    in_motors = with_motor_coordinates(source, model)
    most = largest_moments(source.model, limits=analysis.limits)
    wanted = np.hstack([in_motors.moments[joint] for joint in model.motors])
    given = np.clip(wanted, -most, most)
    sizes = spline(source.time, given, 1 if np.any(given != wanted) else DEGREE)
    for joint, of_gear in source.twists.items():
        for number in numbers_of_motors(model)[joint] if of_gear.torque is not None else ():
            (sizes[number],) = functions_within(of_gear.torque, -most[number], most[number])
    forces: _core.ForceSource = _core.ForcesOfTime(sizes)
    commands = actuator_commands(model, context.patches)
    motors, patches = commands[: len(most)], commands[len(most) :]
    if analysis.apply == "joints+pzt":  # moments of rigid gears come with the voltages, and do nothing
        forces = _core.ForcesOfBoth(forces, _supplied(source, most, context.patches, analysis))
        motors = (*motors, *[Command(np.zeros(model.tree.n_v))] * len(most), *patches)
    replayed = Replayed(forces, motors, moments=numbers_of_motors(model))
    return replayed, State(in_motors.q[0], in_motors.v[0])


def command_ranges(model: Model, patches: Mapping[str, PatchedLink]) -> Array:
    """Limits (2, inputs) of commands, lowest and highest: of motors, N·m or N, then of patches, V; infinite if none."""
    most = largest_moments(model, limits=True)
    return np.hstack([np.stack([-most, most]), joined(of.amplifiers for of in patches.values()).range])


def _supplied(source: Run, most: Array, patches: Mapping[str, PatchedLink], analysis: Forward) -> _core.ForceSource:
    """What motors and amplifiers make of what `source` found: its charges are those of its own motion."""
    forces, amplifiers = supplied(source, most, patches, limited=analysis.limits), amplifiers_on(source.model, patches)
    amplifiers = amplifiers if analysis.limits else amplifiers.unlimited()
    if not amplifiers.acts:
        return forces
    times, late = replay_times(source, analysis), np.append(amplifiers.lag, amplifiers.delay)
    step = min(float(late[late > 0.0].min(initial=np.inf)), analysis.output_step) / STEPS
    count = int(np.clip(np.ceil(np.ptp(times) / step), 1, MOST_STEPS))
    grid, closer = np.linspace(times[0], times[-1], count + 1), source.closer
    current = closer.v @ strain_directions(source.model, patches).T
    strain = np.stack([np.interp(grid, closer.time, of) for of in current.T], axis=1)
    V = amplifiers.output(grid, forces.sample(grid.tolist())[:, len(most) :], strain)
    return _core.ForcesOfBoth(
        supplied(source, most, {}, limited=analysis.limits), _core.ForcesOfTime(spline(grid, V, 1))
    )


def largest_moments(model: Model, *, limits: bool) -> Array:
    """Torque limits (motors,), N·m or N; infinite if `limits` is False."""
    joints = {joint.name: joint for joint in model.scene.joint}
    most = np.array([of.moment for name in model.motors for of in joints[name].motor_limits])
    return most if limits else np.full_like(most, np.inf)


def _check_motors(model: Model, analysis: Forward, q: Array) -> None:
    """Raise `InputError` where motors are missing at q (n_q,), or in the plane do not fit the mechanism."""
    count, freedom = len(model.motor_columns), mobility(model, q).freedom
    if (model.scene.is_planar or not count) and count != freedom:
        raise InputError(
            f'apply: expected motors that fit the mechanism ({freedom} of them) for "{analysis.apply}"',
            f'{count}; name them with motor = true, or use apply = "trajectory"',
        )
