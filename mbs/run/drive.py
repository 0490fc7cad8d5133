"""Running the integrators of the core from an initial state to an outcome: all kinds that integrate do it here."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from ...common.arrays import Array, Indices, in_parts
from ...common.errors import InputError
from ...common.structs import struct
from .. import _core
from .._core import TimeFunction
from ..fields.waypoints import spline
from ..model.drives import NO_DRIVES, Command, Drives, PointDrive
from ..model.known_motion import State
from ..model.model import Model
from ..model.system import MultibodySystem, integrated_mechanism, zero_order_hold
from ..posture.limits import left_ranges, watch_limits
from ..posture.posture import (
    JUMP,
    NEARLY_SINGULAR,
    SINGULAR,
    describe_branches,
    describe_loops,
    describe_posture,
    rank_of_redundant_loops,
    worst_posture,
)
from ..posture.reach import out_of_reach
from ..scene.analysis import IntegratedAnalysis
from .integrators import (
    EXPLICIT,
    METHODS,
    REPEATED,
    Choice,
    Contender,
    Stiffness,
    beyond_round_off,
    choose_integrator,
    stiffness_of,
    unmet,
)
from .record import Continuation, Run, Statistics
from .samples import LOOKS, about_highest, in_order, new_samples, reached_samples, some_of, telling
from .stops import ENDS, stops

Progress = Callable[[float], bool]
"""Called now and then with the time reached; False stops the run."""

POSTURES = 2001  # outputs whose postures are looked at where the core does not watch them


@struct
class Control:
    """Sampled commands of a controller to motors, N·m or N, and patches, V."""

    commands: tuple[Command, ...]  # generalized forces of a unit of each command
    first: Array  # (inputs,) commands before those of the first sample act
    times: Array  # (K,) s, of the samples; the commands of each act `delay` (s) later
    delay: float
    # commands (inputs,) by sample number, time (s) and state: q (n_q,), v, a (n_v,) in one array, SI
    controller: Callable[[int, float, Array], Array]
    held: Callable[[Array], Array]  # after a run, the commands (T, inputs) that act at times (T,), s
    instant: float  # s, before and after a change of commands at which they are recorded


def drive_robot(
    model: Model,
    analysis: IntegratedAnalysis,
    start: State,
    progress: Progress,
    *,
    drives: Drives = NO_DRIVES,
    warnings: tuple[str, ...] = (),
    times: Array | None = None,
    control: Control | None = None,
    earlier: Run | None = None,
    is_recorded: bool = False,
    undeformed: Array | None = None,
) -> Run:
    """Integrate from `start` and return the run, with outputs at `times` (T,), s; by default those of the analysis.

    Sampled `control` and `drives` act beside the loads of the scene, under the constraint equations of `model`. The run
    ends early where `progress` returns False, or, with a warning, where the joints cannot follow the path. It goes on
    with an `earlier` run of the same analysis. `is_recorded`: steps are kept for a replay.
    `undeformed` (n_q,), rad and m: posture with straight links where a path begins.
    """
    this = _Integration(model, analysis, analysis.times if times is None else times, drives, control)
    this.begin(start, earlier, undeformed, is_recorded=is_recorded)
    run = this.run(start, progress)
    motion = this.motion(run, this.times)
    motion = motion if earlier is None else motion.after(earlier)
    statistics = this.statistics(run, motion, warnings)
    motion = replace(
        motion,
        applied=drives.at_points,
        statistics=statistics if earlier is None else statistics.added_to(earlier.statistics),
        continuation=this.continuation if control is None else None,
    )
    replayed = this.replayed(run, motion, 0 if earlier is None else len(earlier.time))
    acting = this.under(motion, replayed)
    if (reached := reached_samples(this.continuation.samples, motion.time)) is None:
        return acting
    return replace(acting, look_closer=cache(partial(this.closer, motion, replayed, *reached, progress)))


class _Integration:
    """What moves in an integration, what acts on it, the times at which it is told, and how far it has come."""

    integrator: Choice
    stiffness: Stiffness  # at the start
    continuation: Continuation
    loop_rank: int | None  # of loops whose postures the core cannot watch

    def __init__(
        self, model: Model, analysis: IntegratedAnalysis, times: Array, drives: Drives, control: Control | None
    ) -> None:
        self.began = time.perf_counter()
        self.analysis, self.times, self.drives, self.control = analysis, times, drives, control
        self.system = MultibodySystem(model, drives, control.commands if control is not None else ())
        self.is_followed = any(row.is_trajectory for row in model.rows)
        self.is_rigid = model.tree.is_rigid

    def begin(self, start: State, earlier: Run | None, undeformed: Array | None, *, is_recorded: bool) -> None:
        """Choose the integrator, go on from an `earlier` run, and have the core watch limits and postures."""
        analysis, times, is_sampled, continuation = self.analysis, self.times, self.control is not None, None
        self.stiffness = stiffness_of(self.system, start)
        if (steps := analysis.repeat_steps) is not None:
            if steps.ends[-1] != times[-1]:
                raise InputError(
                    f'{steps.path}: analysis "{analysis.name}": repeat_steps: expected steps up to {times[-1]:.9g} s,'
                    " where the run ends",
                    f"them up to {steps.ends[-1]:.9g} s",
                )
            self.integrator = Choice(steps.method, REPEATED)
        else:
            self.integrator = choose_integrator(
                self.system, analysis, start, times, self.stiffness, is_sampled=is_sampled
            )
            if analysis.keep_steps and self.integrator.name in EXPLICIT:
                self.integrator = self.integrator._replace(candidates=())
        if earlier is not None:  # with the same candidates, and what they have become since
            known, continuation = earlier.statistics.integrator, earlier.continuation
            self.integrator = self.integrator._replace(name=known.name, reason=known.reason)
        if continuation is None:
            samples = new_samples(times, analysis, len(start.q) + len(start.v))
            continuation = Continuation(_core.TreeCheckpoint(), _core.Recording() if is_recorded else None, samples)
        model, (_, scene, rows) = self.system.model, self.system.integrated
        self.continuation, self.loop_rank = continuation, None
        if undeformed is not None and not self.is_rigid:
            self.loop_rank = rank_of_redundant_loops(model, undeformed, rows)
        if self.loop_rank is None:
            scene.watch_posture([model.rows[k].is_trajectory for k in rows], model.size)
        watch_limits(scene, model.tree)

    @cached_property
    def ends(self) -> Array:
        """Times (n,), s, at which steps end: see `stops`."""
        scene, is_replay = self.system.model.scene, self.drives.replayed is not None
        paths = scene.trajectory if self.is_followed or is_replay else ()
        at_points = (size for drive in self.drives.at_points for size in drive.components.values())
        is_driven, is_replay = self.is_rigid and self.is_followed, self.is_rigid and is_replay
        ends = stops(self.times, paths, (*scene.load_functions, *at_points), is_driven=is_driven, is_replay=is_replay)
        return ends if self.integrator.name not in EXPLICIT else np.union1d(ends, self.jumps)

    @property
    def jumps(self) -> Array:
        """Times (n,), s, before and behind jumps of replayed forces, over which implicit methods step better."""
        if self.drives.replayed is None:
            return self.times[:0]
        breaks, (begin, end) = np.array(self.drives.replayed.breaks), self.times[[0, -1]]
        instant = ENDS.shortest * (end - begin)
        inside = breaks[(breaks > begin + 2 * instant) & (breaks < end - 2 * instant)]
        return np.concatenate([inside - instant, inside + instant])

    @property
    def controls(self) -> _core.IntegrationControls:
        """The core's settings of the integration."""
        analysis, candidates = self.analysis, self.integrator.candidates or (Contender(self.integrator.name),)
        controls = _core.IntegrationControls(
            tolerance=analysis.tolerance,
            max_steps=analysis.max_steps,
            methods=[(METHODS[one.name], one.cost, one.pace) for one in candidates],
            spectral_radius=analysis.spectral_radius,
        )
        controls.keep_steps, controls.stops = analysis.keep_steps, self.ends.tolist()
        if analysis.repeat_steps is not None:
            controls.repeated_steps = analysis.repeat_steps.ends.tolist()
        return controls

    def run(self, start: State, progress: Progress) -> _core.TreeRun:
        """Integrate in the core from `start`, or from where an earlier run has stopped."""
        (core, scene, _), control, continuation = self.system.integrated, self.control, self.continuation
        common: dict[str, Any] = dict(model=core, scene=scene, times=self.times.tolist(), q=start.q, v=start.v)
        common.update(controls=self.controls, carry_on=progress)
        if control is None:
            # Where motors take the place of forces on a path their errors count, too
            is_judged = self.is_followed and self.system.model.motors
            return _core.tree_motion(
                **common,
                checkpoint=continuation.checkpoint,
                samples=continuation.samples,
                recording=continuation.recording,
                replay=self.system.replay,
                judged=integrated_mechanism(self.system) if is_judged else None,
            )
        return _core.tree_sampled(
            **common,
            held=zero_order_hold(self.system.model, control.commands),
            first_command=control.first,
            samples=control.times.tolist(),
            delay=control.delay,
            controller=control.controller,
            between=continuation.samples,
        )

    def motion(self, run: _core.TreeRun, times: Array) -> Run:
        """The motion in a run of the core at `times` (T,), s, as far as it got."""
        model = self.system.model
        q, v = np.split(run.states, [model.tree.n_q], axis=1)
        return Run(
            analysis=self.analysis,
            model=model,
            time=times[: len(q)],
            q=q,
            v=v,
            a=run.accelerations,
            multipliers=self.system.multipliers(run.multipliers),
        )

    def statistics(self, run: _core.TreeRun, motion: Run, warnings: tuple[str, ...]) -> Statistics:
        """How it went, with these `warnings` and its own."""
        is_end, posture = _ends_in_posture(run), self.posture(run, motion)
        status, cause = run.status.name.replace("_", " "), ""
        if is_end:
            advice = out_of_reach(motion.model, self.times) or "move the path, or start in another posture"
            status, cause = "diverged", f"{posture}: {advice}"
        elif status not in ("completed", "interrupted"):
            cause = find_cause(self.system, self.analysis, self.integrator, self.stiffness, run)
        of_gears = max((gear.round_off(motion.q) for gear in motion.model.tree.gears), default=0.0)
        texts = [posture, beyond_round_off(self.analysis.tolerance, run, of_gears)]
        texts += left_ranges(motion.model, run.ranges, motion.time, motion.q, motion.v)
        if (samples := self.continuation.samples) is not None and samples.every > 1:
            texts.append(f"peaks and means are of one in {samples.every} steps: memory holds no more; shorten the run")
        return Statistics(
            status=status,
            integrator=self.integrator.changed_in(run),
            steps=run.steps,
            rejected=run.rejected,
            evaluations=run.evaluations,
            wall_seconds=time.perf_counter() - self.began,
            time_reached=self.continuation.checkpoint.time if self.control is None else None,
            cause=cause,
            step_ends=np.array(run.step_ends),
            warnings=(*warnings, *filter(None, texts)),
        )

    def posture(self, run: _core.TreeRun, motion: Run) -> str:
        """A remark on the posture nearest to a singular one; "" if all are far from it."""
        model, size, loop_rank = motion.model, len(motion.time), self.loop_rank
        if loop_rank is None or not size:
            is_end = _ends_in_posture(run)
            return describe_posture(model, run.least_ratio, run.singular_at, run.singular_posture, is_end=is_end)
        some = motion.at(np.unique(np.linspace(0, size - 1, POSTURES).astype(int)))
        ratio, worst = worst_posture(model, some.time, some.q, loop_rank)
        at = float(some.time[worst]), some.q[worst]
        posture = describe_posture(model, ratio, *at, is_end=False, loop_rank=loop_rank)
        return posture or describe_branches(model, some.time, some.q, loop_rank)

    def replayed(self, run: _core.TreeRun, motion: Run, known: int) -> Array:
        """Numbers that a replay applies (T, numbers) at the times of `motion`; `run` lacks the `known` first ones."""
        if self.drives.replayed is None:
            return np.zeros((len(motion.time), 0))
        before, after = self.drives.replayed.source.sample(motion.time[:known].tolist()), run.replayed[known:]
        return np.concatenate([before, after] if len(after) else [before]) if known else run.replayed

    def under(self, motion: Run, replayed: Array) -> Run:
        """The motion with what a replay does (T, numbers) on joints and points."""
        if (drives := self.drives.replayed) is None or not len(motion.time):
            return motion
        acting = spline(motion.time, replayed, 1) if drives.at_points else []
        applied = (
            PointDrive(point, {component: acting[number] for component, number in of_point.items()})
            for point, of_point in drives.at_points.items()
        )
        commanded = {joint: replayed[:, list(columns)] for joint, columns in drives.moments.items()}
        return replace(motion, commanded=commanded, applied=(*self.drives.at_points, *applied))

    def closer(self, motion: Run, replayed: Array, times: Array, states: Array, progress: Progress) -> Run:
        """The motion with the replay's (T, numbers), and between its outputs, of whose `times` (k,) `states` (k, n)."""
        between, more = self.between(times, states, progress)
        order = in_order(motion.time, between.time)
        return self.under(motion.with_rows_of(between, order), np.concatenate([replayed, more])[order])

    def between(self, times: Array, states: Array, progress: Progress) -> tuple[Run, Array]:
        """The motion at some of `times` (k,), s, with `states` (k, n), and what a replay does there (T, numbers).

        Of long loops the rest is left out once `progress` says so.
        """
        (core, scene, _), control, ends = self.system.integrated, self.control, self.ends
        if control is not None:
            times, states, both = _with_both_sides(times, states, control.times + control.delay, control.instant)
            ends = np.append(ends, both)

        def at(rows: Indices) -> _core.TreeRun:
            chosen, of_rows = times[rows].tolist(), states if len(rows) == len(times) else states[rows]
            if control is None:
                return _core.tree_outputs(core, scene, chosen, of_rows, self.system.replay)
            held = zero_order_hold(self.system.model, control.commands)
            return _core.tree_outputs_under(core, scene, chosen, of_rows, held, control.held(times[rows]))

        # what rings between samples of a controller has peaks and means of its own there
        joints = self.system.model.tree.joint_columns
        rates = states[:, -len(joints) :][:, joints]
        is_long = len(times) > LOOKS.all_up_to and not self.analysis.is_repeated
        if control is not None and is_long:
            motion = self.telling(at, times, progress)
            return motion, np.zeros((len(motion.time), 0))
        some = some_of(times, rates, ends, LOOKS.evenly if control is None else LOOKS.parts_of_step * LOOKS.all_up_to)
        if is_long:
            some = np.union1d(some, telling(times, states, np.abs(states).max(axis=0)))
        run = at(some)
        motion, replayed = self.motion(run, times[some]), run.replayed
        more = np.setdiff1d(about_highest(some, np.hstack([motion.multipliers, motion.a[:, joints]])), some)
        if more.size:
            others, order = at(more), np.argsort(np.concatenate([some, more]))
            motion = motion.with_rows_of(self.motion(others, times[more]), order)
            replayed = np.concatenate([replayed, others.replayed])[order]
        return motion, replayed

    def telling(self, at: Callable[[Indices], _core.TreeRun], times: Array, progress: Progress) -> Run:
        """The motion at those of `times` (k,), s, from which it follows at the others; `at` has it at rows."""
        sizes = np.zeros(1)  # of each column, so far

        def thinned(motion: Run) -> Run:
            nonlocal sizes
            values = np.hstack([motion.q, motion.v, motion.a, motion.multipliers])
            sizes = np.maximum(sizes, np.abs(values).max(axis=0))
            return motion.at(telling(motion.time, values, sizes))

        parts = []
        for part in in_parts(len(times), LOOKS.all_up_to):
            rows = np.arange(len(times))[part]
            parts.append(thinned(self.motion(at(rows), times[rows])))
            if not progress(float(times[-1])):
                break
        names = ("time", "q", "v", "a", "multipliers")
        states = {name: np.concatenate([getattr(of, name) for of in parts]) for name in names}
        return thinned(replace(parts[0], **states))


def _with_both_sides(times: Array, states: Array, changes: Array, instant: float) -> tuple[Array, Array, Array]:
    """Times (k,), s, and states (k, n), with those before commands change, at `changes` (m,), s, after the start.

    And those on both sides of changes, by which means over time are, where they are not too many.
    """
    near = np.clip(np.searchsorted(times, changes - instant), 0, len(times) - 1)
    near = near[(near > 0) & (np.abs(times[near] - changes) < instant)]
    before = times[near] - 2.0 * instant
    every = np.append(times, before)
    order = np.argsort(every, kind="stable")
    both = np.append(before, times[near]) if len(near) < LOOKS.evenly else before[:0]
    return every[order], np.concatenate([states, states[near]])[order], both


def _ends_in_posture(run: _core.TreeRun) -> bool:
    """Whether a posture ended the run: joints cannot follow there, or steps vanish next to it as none leads across."""
    if run.status == _core.IntegrationStatus.step_underflow and run.singular_at == run.time_reached:
        return run.least_ratio < NEARLY_SINGULAR
    return run.status == _core.IntegrationStatus.diverged and run.least_ratio < SINGULAR


FAR_BENT = 0.5  # of a link's radius of gyration, in the mean


def find_cause(
    system: MultibodySystem, analysis: IntegratedAnalysis, choice: Choice, stiffness: Stiffness, run: _core.TreeRun
) -> str:
    """A sentence with the likely cause of a failed `run`, and advice; "" where none is found.

    Looked for, in this order: a target that is not a number, a link bent too far, a load that jumps, a singular
    posture of loops, friction, gears; where steps became too short, the integrator.
    """
    t, at = run.time_reached, State(*np.split(np.array(run.last), [system.model.tree.n_q]))

    def accelerations() -> Array:
        return _core.tree_outputs(system.core, system.scene, [t], np.array(run.last)[None]).accelerations

    causes = (
        not_a_number(_targets(system), accelerations, t)
        or _too_far_bent(system, at)
        or load_jump(_loads(system), t)
        or describe_loops(system.model, t, at.q, at.v)
        or stiffness.describe(analysis.end, choice.name)
    )
    if causes or run.status != _core.IntegrationStatus.step_underflow:
        return causes
    if choice.name == "generalized-alpha":
        return (
            f"a tolerance of {analysis.tolerance:g} is below what generalized-alpha reaches here: at order 2 it takes"
            ' steps too short to advance, down to round-off; loosen the tolerance, or use integrator = "radau" or'
            ' "dop853"'
        )
    return unmet(choice, run)


def _targets(system: MultibodySystem) -> Iterator[tuple[str, TimeFunction]]:
    for row in system.model.rows:
        functions = row.law.functions if row.law is not None else () if row.target is None else (row.target,)
        yield from ((f'trajectory "{row.owner}"', function) for function in functions)


def not_a_number(targets: Iterable[tuple[str, TimeFunction]], accelerations: Callable[[], Array], t: float) -> str:
    """Return which labelled target is not finite at t (s), or that accelerations are not finite; else ""."""
    for label, target in targets:
        if not np.isfinite(target(t)).all():
            return f"{label} has no finite value, velocity or acceleration there"
    if not np.isfinite(accelerations()).all():
        return "the accelerations there are no finite numbers: a load or a target grows without bound"
    return ""


def _too_far_bent(system: MultibodySystem, at: State) -> str:
    """The link that is bent most: |p|/√J is the mean of its deflection against its radius of gyration."""
    nodes = [node for node in system.model.tree.nodes if node.body.n_modes]
    bent = [(float(np.linalg.norm(at.q[of.p_q]) / np.sqrt(of.body.largest_moment)), of.body.name) for of in nodes]
    most, name = max(bent, default=(0.0, ""))
    if not most > FAR_BENT:
        return ""
    return (
        f'"{name}" is bent by {100 * most:.0f} % of its length, which violates small deformations. Possible causes: a'
        " path too fast, a load beyond buckling, a spin that needs geometric_stiffening = true, a link too soft,"
        " or an arm without motors that falls apart"
    )


def _loads(system: MultibodySystem) -> Iterator[tuple[str, TimeFunction]]:
    for load in system.model.scene.load:
        for component, size in load.components.items():
            yield f'load on "{load.point or load.joint or load.pzt}", {component},', size


def load_jump(loads: Iterable[tuple[str, TimeFunction]], t: float) -> str:
    """Return which labelled load jumps at t (s), or has no finite value from there on; else ""."""
    dt = 1e-9 * max(t, 1e-9)
    for label, size in loads:
        # Values alone: functions of Python may have no derivatives
        values = [size(t + k * dt) for k in (-3, -1, 1, 3)]
        if not (np.isfinite(values[2]) | ~np.isfinite(values[1])).all():
            return f"{label} has no finite value, slope or curvature after that time"
        first, before, after, last = (value[0] for value in values)
        change = abs(after - before) - abs(before - first) - abs(last - after)
        if change > JUMP * max(abs(before), abs(after)):
            return f"{label} jumps from {before:.6g} to {after:.6g} there: round it off, or loosen the tolerance"
    return ""
