"""Running the integrators of the core from an initial state in space to a run: all kinds that integrate do it here."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, as_list
from .. import _core
from ..model.spatial_drives import NO_DRIVES, Command, Drives
from ..model.spatial_model import SpatialModel
from ..model.spatial_system import SpatialSystem
from ..scene.analysis import IntegratedAnalysis
from ..solve.integrators import METHODS
from ..solve.spatial_limits import left_ranges
from ..solve.spatial_posture import NEARLY_SINGULAR, SINGULAR, robot_size, told_posture
from ..solve.state import State
from .drive import STATUS, Progress
from .spatial_run import SpatialRun


@dataclass(frozen=True)
class SpatialControl:
    """What acts on motors and patches from sample to sample.

    Attributes:
        commands: what a unit of each does.
        first: (inputs,) before those of the first sample act.
        times: (K,) s, of the samples; the commands of each act `delay` (s) later.
        controller: commands (inputs,) from sample number, time and what was read: q (n_q,), v (n_v,), a (n_v,) in one.
    """

    commands: tuple[Command, ...]
    first: Array
    times: Array
    delay: float
    controller: Callable[[int, float, Array], Array]


def integrator_of(model: SpatialModel, name: str) -> str:
    """The method that stands behind a name in scenes.

    "auto" is Radau where dry friction acts on links with modes: near rest it is a damper so stiff for the light ends of
    links that explicit steps take nanoseconds; else DOP853.
    """
    if name != "auto":
        return name
    nodes = model.tree.nodes
    sticks = any(friction.coulomb > 0 for node in nodes for friction in node.joint.frictions)
    return "radau" if sticks and any(node.body.n_modes for node in nodes) else "dop853"


def spatial_drive(
    model: SpatialModel,
    analysis: IntegratedAnalysis,
    start: State,
    progress: Progress,
    *,
    drives: Drives = NO_DRIVES,
    warnings: tuple[str, ...] = (),
    times: Array | None = None,
    control: SpatialControl | None = None,
) -> SpatialRun:
    """The run of an integration from `start`, with outputs at `times`, those of the analysis where not given.

    Sampled `control` and `drives` act beside the loads of the scene. The rows of `model` hold. It ends early where
    `progress` says so, and in a posture in which the joints cannot follow the path, with a warning.
    """
    times = analysis.times if times is None else times
    system, began = SpatialSystem(model, drives), time.perf_counter()
    integrator = integrator_of(model, analysis.integrator)
    controls = _core.IntegrationControls(
        tolerance=analysis.tolerance,
        max_steps=analysis.max_steps,
        methods=[(METHODS[integrator], 1.0, 0.0)],
        spectral_radius=analysis.spectral_radius,
    )
    system.scene.watch_posture([row.is_trajectory for row in model.rows], robot_size(model))
    run = _integrated(system, times, start, controls, control, progress)
    q, v = (np.ascontiguousarray(part) for part in np.split(run.states, [model.tree.n_q], axis=1))
    multipliers = run.multipliers * system.row_signs
    in_posture = _ends_in_posture(run)
    posture = told_posture(model, run.least_ratio, run.singular_at, run.singular_posture, is_end=in_posture)
    cause = f"{posture}: move the path, or start in another posture" if in_posture else ""
    told = (*warnings, *([posture] if posture else []), *left_ranges(model, times[: len(q)], q))

    def again(others: Array) -> SpatialRun:
        return spatial_drive(model, analysis, start, progress, drives=drives, times=others)

    return SpatialRun(
        analysis, model, times[: len(q)], q, v, run.accelerations, multipliers, applied=drives.at_points,
        status="diverged" if in_posture else STATUS[run.status], integrator=integrator, steps=run.steps,
        evaluations=run.evaluations, wall_seconds=time.perf_counter() - began, warnings=told, cause=cause,
        again=again if control is None else None,
    )  # fmt: skip


def _ends_in_posture(run: _core.TreeRun) -> bool:
    """Whether a posture ended the run: joints cannot follow there, or steps vanish next to it as none leads across."""
    if STATUS[run.status] == "step underflow" and run.singular_at == run.time_reached:
        return run.least_ratio < NEARLY_SINGULAR
    return STATUS[run.status] == "diverged" and run.least_ratio < SINGULAR


def _integrated(
    system: SpatialSystem,
    times: Array,
    start: State,
    controls: _core.IntegrationControls,
    control: SpatialControl | None,
    progress: Progress,
) -> _core.TreeRun:
    if control is None:
        return _core.tree_motion(system.core, system.scene, as_list(times), start.q, start.v, controls, progress)
    return _core.tree_sampled(
        model=system.core, scene=system.scene, times=as_list(times), q=start.q, v=start.v, controls=controls,
        carry_on=progress, held=system.held_forces(control.commands), first_command=control.first,
        samples=as_list(control.times), delay=control.delay, controller=control.controller,
    )  # fmt: skip
