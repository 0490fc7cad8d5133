"""Equilibrium; and states about which a robot is linear: it, or instants of an earlier analysis. SI units."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from ...common.arrays import Array
from ...common.errors import InputError, SolveError, did_you_mean, quoted
from ...common.structs import struct
from ..fields.field_types import NotNegative, PointReference
from ..linear.joint_conditions import JointCondition, joint_conditions, robot_modes
from ..linear.linearisation import LinearEquations
from ..linear.statics import Statics, hanging_joints
from ..model.gears import with_compliance, with_prescribed_motors
from ..model.known_motion import State
from ..model.model import Model
from ..posture.prescribed import following_motors
from ..posture.redundancy import resolved
from ..posture.start import undeformed_posture
from ..run.context import Context, place_of
from ..run.gears import with_motor_coordinates
from ..run.record import Details, Run, Statistics
from ..scene.analysis import Analysis, Surroundings, TimedAnalysis


def run_static(context: Context, analysis: Analysis) -> Run:
    """The equilibrium at t = 0, with v = a = 0 even where trajectories move then.

    Raises `SolveError` where there is none.
    """
    began = time.perf_counter()
    model = with_prescribed_motors(resolved(context.model, analysis.last_time))
    undeformed = undeformed_posture(model)
    statics = Statics(model)
    q = statics.equilibrium(undeformed.q)
    at_rest, times = np.zeros((1, model.tree.n_v)), np.zeros(1)
    warnings = tuple(hanging_joints(model, undeformed, State(q, at_rest[0]), model.motors))
    return Run(
        analysis=analysis,
        model=model,
        time=times,
        q=q[None],
        v=at_rest,
        a=at_rest,
        multipliers=statics.holding_multipliers(q)[None],
        is_at_rest=True,
        statistics=Statistics(wall_seconds=time.perf_counter() - began, warnings=warnings),
    )


STATIC = "static"  # instead of an analysis' name: about the static equilibrium
INSTANTS = 9  # of a run, at which it is linearized for its growth
NEAR = 1e-9  # of the end of an analysis: how far from an output a time may be for round-off


class InstantAnalysis(Analysis):
    """Analysis `about` the static equilibrium (not given, or "static") or an earlier analysis at `times`."""

    about: str | None = None
    """Earlier analysis of a motion, or "static" (the default): the equilibrium at t = 0."""
    instants: tuple[NotNegative, ...] | None = Field(default=None, alias="times", min_length=1)
    """Instants of that analysis, s."""

    is_motion = False

    @property
    def times(self) -> Array:
        """The instants (T,), s; [0] where none are given."""
        return np.zeros(1) if self.instants is None else np.array(self.instants)

    @property
    def source(self) -> str | None:
        """Name of the earlier analysis; None for the equilibrium."""
        return None if self.about == STATIC else self.about

    @property
    def needs_times(self) -> bool:
        """Whether `times` have to be given with an earlier analysis."""
        return True

    def problems(self, among: Surroundings) -> Iterator[str]:
        """Yield a message if there is no such earlier motion, or `times` do not fit it."""
        if self.source is None:
            if self.instants is not None:
                yield f'times: expected none about "{STATIC}", found {quoted(f"{t:g}" for t in self.instants)}'
            return
        sources = {other.name: other for other in among.earlier if other.is_motion}
        source = sources.get(self.source)
        if source is None:
            known, hint = quoted((STATIC, *sources)), did_you_mean(self.source, sources)
            yield f'about: expected an earlier analysis of a motion, {known}, found "{self.source}"{hint}'
            return
        if self.instants is None and self.needs_times:
            yield f'times: expected the times of "{source.name}" at which to linearize, found none'
        for t in self.instants or ():
            if t - source.last_time > NEAR * source.last_time:
                yield f'times: expected at most {source.last_time!r}, where "{source.name}" ends, found {t!r}'


class OperatingPoints(NamedTuple):
    """States about which a robot's equations are linearized.

    Attributes:
        model: without trajectories, with compliant gears where the scene has them.
        time: (T,) s.
        q, v, a: (T, n_q), (T, n_v), (T, n_v), SI units.
    """

    model: Model
    time: Array
    q: Array
    v: Array
    a: Array


def find_operating_points(context: Context, analysis: InstantAnalysis) -> tuple[Run, OperatingPoints]:
    """The run, equilibrium or earlier motion, that `analysis` linearizes about, and the states at its instants.

    In the equilibrium of a scene without trajectories motors keep the initial posture.
    """
    if analysis.source is None:
        model = context.model
        if not any(row.is_trajectory for row in model.rows):
            context = replace(context, model=following_motors(model, undeformed_posture(model).q))
        run = run_static(context, analysis)
        return run, linear_states(model, run, [0])
    source = context.outcomes[analysis.source]
    at = [row_at(context.model.scene.path, analysis, source, float(t)) for t in analysis.times]
    return of_earlier(source, analysis).at(at), linear_states(context.model, source, at)


def linear_states(model: Model, source: Run, rows: Sequence[int]) -> OperatingPoints:
    """States at outputs `rows` of an earlier motion, for a robot without trajectories and with compliant gears."""
    model = with_compliance(model.without_paths())
    q, v, a = with_motor_coordinates(source, model)[:3]
    at = list(rows)
    return OperatingPoints(model, source.time[at], q[at], v[at], a[at])


def open_loop_growth(run: Run) -> float:
    """Mean over a run of the fastest growth, 1/s, of small deviations where its torques act open loop.

    By linear models about `INSTANTS` of the run; 0 where none has an unstable pole; nan where there is no linear model.
    """
    first, last = run.time[[0, -1]]
    rows = [int(np.abs(run.time - t).argmin()) for t in np.linspace(first, last, INSTANTS)]
    try:
        model, *states = linear_states(run.model, run, rows)
        equations, growth = LinearEquations(model, states[1][0]), list[float]()
        for t, q, v, a in zip(*states, strict=True):
            at = equations.at(float(t), q, v, a)
            back = np.linalg.inv(np.linalg.cholesky(at.M)).T
            growth.append(robot_modes(back.T @ at.K @ back, back.T @ at.D @ back, back, at.transformation).growth)
    except (InputError, SolveError):
        return np.nan
    return float(np.mean([*growth[:-1], *growth[1:]]))  # the trapezoidal rule


def places_of(context: Context, points: Sequence[str] | None, *, loaded: bool = False) -> dict[str, str]:
    """Map points of the scene to points of the model, which may contain links in pieces.

    Where no `points` are given: those of trajectories, or else the tips of all bodies; also tools, and if `loaded` the
    points of payloads and loads.
    """
    whole = context.whole
    if points is None:
        model = context.model if whole is None else whole.model
        tips = [f"{node.body.name}.tip" for node in model.tree.nodes if "tip" in node.body.points]
        scene = model.scene
        carrying = [*(one.point for one in scene.payload), *(load.point for load in scene.load if load.point)]
        tools = [tool.reference for tool in scene.tool]
        points = tuple(dict.fromkeys([*(scene.path_points or tips), *tools, *(carrying if loaded else ())]))
    return {point: place_of(whole, point) or point for point in points}


def of_earlier(source: Run, analysis: Analysis) -> Run:
    """The motion of `source` as a run of `analysis`, with statistics of no steps."""
    statistics = replace(source.statistics, steps=0, evaluations=0, wall_seconds=0.0, warnings=())
    return replace(source, analysis=analysis, statistics=statistics, prescribed=None, look_closer=None)


def row_at(path: Path, analysis: Analysis, source: Run, t: float) -> int:
    """Number of the output of an earlier analysis at t, s. Raises `InputError` where there is none."""
    row = int(np.abs(source.time - t).argmin())
    if abs(source.time[row] - t) > NEAR * source.analysis.last_time:
        every = f"every {source.analysis.output_step:g} s " if isinstance(source.analysis, TimedAnalysis) else ""
        raise InputError(
            f'{path}: analysis "{analysis.name}": times: expected output times of "{source.analysis.name}", {every}up'
            f" to {source.time[-1]:g} s",
            f"{t:g}",
        )
    return row


@struct
class RobotAtRest(Details):
    """Natural frequencies and compliance in equilibrium: by `times` (0 alone), by joints "locked" or "compliant"."""

    conditions: tuple[Mapping[str, JointCondition], ...]
    times = (0.0,)


class Static(Analysis):
    """The equilibrium at t = 0 with the torques, forces and voltages that it needs.

    With it come natural frequencies and the compliance at points, with joints locked and behind compliant gears.
    """

    kind: Literal["static"]
    points: tuple[PointReference, ...] | None = None
    """Points whose compliance is computed; by default those of trajectories, or all tips; tools, payloads and loads."""

    is_algebraic = True
    allocates_patches = True
    refers_to = (("points", "body"),)

    def run(self, context: Context) -> Run:
        """Posture and forces at t = 0, with frequencies and compliance; raises `SolveError` without an equilibrium."""
        run = run_static(context, self)
        try:
            model, _, (q,), (v,), (a,) = linear_states(context.model, run, [0])
            mechanism = LinearEquations(model, q, places_of(context, self.points, loaded=True)).at(0.0, q, v, a)
        except (InputError, SolveError) as error:
            text = f"no natural frequencies and no compliance: {error}"
            statistics = replace(run.statistics, warnings=(*run.statistics.warnings, text))
            return replace(run, statistics=statistics)
        return replace(run, details=RobotAtRest((joint_conditions(mechanism),)))
