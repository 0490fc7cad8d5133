"""Fully constrained inverse dynamics in 3D: p(t) is prescribed too, and all is algebraic (Shabana 2022, sec. 5.1)."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..fields.waypoints import spline
from ..model.model import ZERO
from ..model.spatial_gears import refuse_held_motors
from ..model.spatial_model import SpatialModel
from ..solve.spatial_posture import check_path, mobility, undeformed_posture
from ..solve.spatial_prescribed import prescribed_motion, spatial_quasi_static_shape
from ..solve.spatial_redundancy import resolved
from ..solve.state import State
from .context import Context
from .outcome import Forces, Motion, Outcome, Statistics
from .samples import path_times
from .shapes import FcidKeys, Shape, given_shape, sampled, shape_nodes


def run_spatial_fcid(context: Context, analysis: FcidKeys) -> Outcome:
    """Motion and forces for the trajectories and the shape that the analysis prescribes.

    Raises `InputError` where the trajectories do not fix the motion of the mechanism or cannot be followed,
    `SolveError` where no posture, or no static shape, is found.
    """
    began = time.perf_counter()
    refuse_held_motors(context.model, analysis)
    model = resolved(context.model, analysis.last_time)
    start = undeformed_posture(model)
    warnings = tuple(check_path(model, start.q))
    found, rows = mobility(model, start.q), int(np.count_nonzero(~model.loop_rows))
    if rows != found.freedom:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": kind: expected as many trajectory components as the'
            f' mechanism has degrees of freedom ({found.freedom}) for "fcid", found {rows}'
        )
    fits = sum(len(columns) for columns in model.motors.values()) == found.freedom
    shape = _shape(model, analysis, start, by_motors=fits)
    run = _run(model, analysis, shape, start, analysis.times, warnings)
    run = replace(run, statistics=replace(run.statistics, wall_seconds=time.perf_counter() - began))

    @cache
    def look_closer() -> Outcome:
        return _run(model, analysis, shape, start, path_times(run.time, model.scene.trajectory, analysis.end), warnings)

    return replace(run, look_closer=look_closer)


def _run(
    model: SpatialModel, analysis: FcidKeys, shape: Shape, start: State, times: Array, warnings: tuple[str, ...] = ()
) -> Outcome:
    found = prescribed_motion(model, sampled(shape, times), times, start)

    def again(others: Array) -> Outcome:
        return _run(model, analysis, shape, start, others)

    return Outcome(
        analysis=analysis,
        model=model,
        motion=Motion(times, found.q, found.v, found.a, found.multipliers),
        forces=Forces(required=found.required),
        statistics=Statistics(warnings=warnings),
        again=again,
    )


def _shape(model: SpatialModel, analysis: FcidKeys, start: State, *, by_motors: bool) -> Shape:
    """p(t) of every body of the tree, with its derivatives: of static ones a spline, as in the plane."""
    bodies = [node.body for node in model.tree.nodes]
    if analysis.shape == "given":
        return given_shape(model.scene.path, bodies, analysis)
    if analysis.shape == "static":
        nodes = shape_nodes(analysis)
        functions = iter(spline(nodes, spatial_quasi_static_shape(model, nodes, start, by_motors=by_motors)))
        return [[next(functions) for _ in range(body.n_modes)] for body in bodies]
    return [[ZERO] * body.n_modes for body in bodies]
