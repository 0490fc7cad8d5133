"""Fully constrained inverse dynamics (Shaban 2022, sec. 5.1): p(t) is prescribed too, and everything is algebraic."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, SolveError
from .. import _core
from .._core import TimeFunction
from ..fields.waypoints import spline
from ..model.model import ZERO, Model
from ..model.planar_body import PlanarBody
from ..model.system import MechanismSystem
from ..scene.analysis_records import Analysis
from ..solve.initial_state import undeformed_state
from ..solve.integrators import NOT_INTEGRATED
from ..solve.path_checks import check_smooth
from ..solve.reach import check_reach
from .analyses import Outcome, resolver_of

FEWEST_NODES = 201  # of the spline through a static shape; half as many as outputs where that is more

Shape = list[list[TimeFunction]]
"""p_k(t) of each body, in the coordinates of its `PlanarBody`."""


def run_fcid(model: Model, analysis: Analysis) -> Outcome:
    """Motion and forces for the trajectories and the shape that the analysis prescribes.

    Raises `InputError` where the trajectories do not fix the motion of the mechanism or cannot be followed,
    `SolveError` where no static shape is found.
    """
    assembly = MechanismSystem(model, [*model.joints, *model.trajectories], model.loads, list(model.motors.values()))
    frames = len(assembly.frame_coordinates)
    if len(assembly.constraints) != frames:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": kind: expected as many trajectory components as the'
            f" mechanism has degrees of freedom ({model.degrees_of_freedom}) for "
            f'"fcid", found {len(assembly.constraints) - len(model.joints)}'
        )
    start = undeformed_state(assembly)
    check_smooth(assembly, analysis.end)
    check_reach(assembly, start, analysis.times)
    resolver = resolver_of(assembly)
    if analysis.shape != "zero":
        import scipy.interpolate  # noqa: F401, loading takes longer than solving
    began = time.perf_counter()
    shape = prescribed_shape(assembly, analysis, start.q, resolver)
    run = _core.fully_constrained(assembly.system, analysis.times.tolist(), shape, start.q, resolver)
    seconds = time.perf_counter() - began
    if not run.completed:
        t = analysis.times[run.reached]
        raise SolveError(
            f'{model.scene.path}: analysis "{analysis.name}": no position was found at t = {t:g} s: the'
            " prescribed shape takes the trajectory out of reach"
        )
    return Outcome(
        analysis, assembly, analysis.times, run.q, run.v, run.a, run.multipliers[:, :frames],
        run.tau if resolver else None, run.F_p if resolver else None, run.residual,
        "completed", 0, 0, 0, seconds, NOT_INTEGRATED, shape_force=run.shape_force, shape=shape,
    )  # fmt: skip


def prescribed_shape(
    assembly: MechanismSystem, analysis: Analysis, guess: Array, resolver: _core.ActuatorForces | None
) -> Shape:
    """p(t) of every body, with its derivatives."""
    bodies = assembly.model.bodies
    if analysis.shape == "given":
        return _given(assembly.model.scene.path, bodies, analysis)
    if analysis.shape == "static":
        return _static(assembly, analysis, guess, resolver)
    return [[ZERO] * body.n_modes for body in bodies]


def _static(
    assembly: MechanismSystem, analysis: Analysis, guess: Array, resolver: _core.ActuatorForces | None
) -> Shape:
    """A spline through static shapes: p is prescribed, so p, ṗ and p̈ only have to go with each other exactly."""
    nodes = _nodes(analysis)
    p = _core.static_shape(assembly.system, nodes.tolist(), guess, resolver)
    if len(p) < len(nodes):
        raise SolveError(
            f'{assembly.model.scene.path}: analysis "{analysis.name}": no static shape was found at'
            f" t = {nodes[len(p)]:g} s: the links are too soft for their loads there"
        )
    return _by_body(assembly.model.bodies, spline(nodes, p))


def _nodes(analysis: Analysis) -> Array:
    return np.linspace(0.0, analysis.end, max(FEWEST_NODES, len(analysis.times) // 2 + 1))


def _given(scene_path: Path, bodies: Sequence[PlanarBody], analysis: Analysis) -> Shape:
    """The expressions of the scene; by way of a spline where the modes were made anew (payloads, patches)."""
    given: Mapping[str, tuple[TimeFunction, ...]] = analysis.modal or {}
    shape: Shape = []
    for body in bodies:
        functions = list(given.get(body.name, ()))
        in_file = len(body.modal_transform)
        if len(functions) > in_file:
            raise InputError(
                f'{scene_path}: analysis "{analysis.name}": modal.{body.name}: expected at most {in_file}'
                f" expressions, one for each mode, found {len(functions)}"
            )
        functions += [ZERO] * (in_file - len(functions))
        selected = np.argmax(body.modal_transform, axis=0) if body.n_modes else np.zeros(0, dtype=int)
        if np.array_equal(body.modal_transform, np.eye(in_file)[:, selected]):
            shape.append([functions[k] for k in selected])
        else:
            nodes = _nodes(analysis)
            p = np.column_stack([function.sample(nodes)[0] for function in functions])
            shape.append(spline(nodes, np.linalg.lstsq(body.modal_transform, p.T, rcond=None)[0].T))
    return shape


def _by_body(bodies: Sequence[PlanarBody], functions: list[TimeFunction]) -> Shape:
    remaining = iter(functions)
    return [[next(remaining) for _ in range(body.n_modes)] for body in bodies]
