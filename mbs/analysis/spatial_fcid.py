"""Fully constrained inverse dynamics in 3D: p(t) is prescribed too, and all is algebraic (Shabana 2022, sec. 5.1)."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .. import _core
from ..model.spatial_gears import refuse_held_motors
from ..model.spatial_motors import driven_mechanism
from ..solve.spatial_posture import check_path, mobility
from ..solve.spatial_prescribed import prescribed_motion
from ..solve.spatial_redundancy import resolved
from ..solve.spatial_start import undeformed_posture
from .context import Context
from .outcome import Forces, Motion, Outcome, Prescription, Statistics
from .samples import path_times
from .shapes import FcidKeys, Shape, given_shape_of_pieces, prescribed_shape, sampled


def run_spatial_fcid(context: Context, analysis: FcidKeys) -> Outcome:
    """Motion and forces for the trajectories and the shape that the analysis prescribes.

    Raises `InputError` where the trajectories do not fix the motion of the mechanism or cannot be followed,
    `SolveError` where no posture, or no static shape, is found.
    """
    began = time.perf_counter()
    refuse_held_motors(context.model, analysis)
    model = resolved(context.model, analysis.last_time)
    q = undeformed_posture(model).q
    warnings = tuple(check_path(model, q, analysis.last_time))
    freedom, rows = mobility(model, q).freedom, int(np.count_nonzero(~model.loop_rows))
    if rows != freedom:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": kind: expected as many trajectory components as the'
            f' mechanism has degrees of freedom ({freedom}) for "fcid", found {rows}'
        )

    def equations(*, has_motors: bool = True) -> _core.SpatialPrescribedMotion:
        return _core.SpatialPrescribedMotion(driven_mechanism(model, has_motors=has_motors), q)

    motion = equations(has_motors=sum(len(columns) for columns in model.motors.values()) == freedom)
    shape = _shape(context, analysis, motion, q)

    def at(times: Array) -> Outcome:
        found = prescribed_motion(model, motion, sampled(shape, times), times, q[None])
        return Outcome(
            analysis=analysis, model=model, forces=Forces(required=found.required),
            motion=Motion(times, found.q, found.v, found.a, found.multipliers),
            statistics=Statistics(warnings=warnings), prescribed=Prescription(equations, shape, q),
        )  # fmt: skip

    run = at(analysis.times)
    run = replace(run, statistics=replace(run.statistics, wall_seconds=time.perf_counter() - began))

    @cache
    def look_closer() -> Outcome:
        return at(path_times(run.time, model.scene.trajectory, analysis.end))

    return replace(run, look_closer=look_closer)


def _shape(context: Context, analysis: FcidKeys, motion: _core.SpatialPrescribedMotion, q: Array) -> Shape:
    """P(t) of all bodies; expressions are those of whole links."""
    path, whole = context.model.scene.path, context.whole
    bodies = [node.body for node in context.model.tree.nodes]
    if analysis.shape == "given" and whole is not None:
        links = [node.body for node in whole.model.tree.nodes]
        return given_shape_of_pieces(path, bodies, analysis, links, whole.divided)
    return prescribed_shape(path, bodies, analysis, motion, q)
