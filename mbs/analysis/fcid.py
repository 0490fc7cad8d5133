"""Fully constrained inverse dynamics (Shabana 2022, sec. 5.1): p(t) is prescribed too, and everything is algebraic."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cache

from ...common.arrays import Array, as_list
from ...common.errors import InputError, SolveError
from .. import _core
from ..model.model import Model
from ..model.planar_tree import PlanarTree, told_in_joints
from ..model.system import MechanismSystem
from ..solve.initial_state import undeformed_state
from ..solve.path_checks import check_smooth
from ..solve.reach import check_reach
from .context import AnyContext, Context
from .drive import motion_of, motors_fit
from .elastic_joints import add_transmission
from .outcome import AnyOutcome, Details, Forces, Statistics
from .planar_outcome import PlanarOutcome
from .samples import path_times
from .shapes import FcidKeys, Shape, prescribed_shape, sampled
from .spatial_fcid import run_spatial_fcid


class Fcid(FcidKeys):
    """Forces that move the robot along its trajectories while the modal coordinates p(t) follow a prescribed shape.

    `shape` is zero, the static equilibrium at every instant, or given in `modal`: expressions for the first modes of a
    body, numbered as in its modal file; all others are 0. `check` as in `Pcid`.
    """

    def run(self, context: AnyContext) -> AnyOutcome:
        """Motion and forces."""
        if isinstance(context, Context):
            return run_spatial_fcid(context, self)
        return add_transmission(run_fcid(context.model, self))


@dataclass(frozen=True)
class PrescribedShape(Details):
    """`functions`: p_k(t) of each body; `shape_force` holds it."""

    functions: Shape
    shape_force: Array

    def actuation_source(self, outcome: PlanarOutcome) -> _core.ActuationSource:
        """Everything is algebraic: it is solved for again at any time."""
        tree = _tree(outcome.assembly, has_motors=outcome.tau is not None)
        posture = tree.motion(outcome.q[0], outcome.v[0], outcome.a[0])[0]
        motion = _core.PlanarPrescribedMotion(tree.both.driven, posture)
        return _core.PrescribedActuation(tree.both, motion, self.functions, posture)


def run_fcid(model: Model, analysis: Fcid) -> PlanarOutcome:
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
    paths = [(held.measure.label, held.target) for held in assembly.constraints if held.is_trajectory]
    check_smooth(model.scene.path, paths, analysis.end)
    check_reach(assembly, start, analysis.times)
    has_motors = motors_fit(model)
    tree = _tree(assembly, has_motors=has_motors)
    posture = tree.motion(start.q, start.v, 0 * start.v)[0]
    motion = _core.PlanarPrescribedMotion(tree.both.driven, posture)
    if analysis.shape != "zero":
        import scipy.interpolate  # noqa: F401, loading takes longer than solving
    began = time.perf_counter()
    shape = prescribed_shape(model.scene.path, model.bodies, analysis, motion, posture)
    found = _at(assembly, analysis, tree, motion, shape, posture, analysis.times, has_motors=has_motors)
    found = replace(found, statistics=Statistics(wall_seconds=time.perf_counter() - began))

    @cache
    def look_closer() -> PlanarOutcome:
        times = path_times(analysis.times, assembly.model.scene.trajectory, analysis.end)
        return _at(assembly, analysis, tree, motion, shape, posture, times, has_motors=has_motors)

    return replace(found, look_closer=look_closer)


def _at(
    assembly: MechanismSystem,
    analysis: Fcid,
    tree: PlanarTree,
    motion: _core.PlanarPrescribedMotion,
    shape: Shape,
    posture: Array,
    times: Array,
    *,
    has_motors: bool,
) -> PlanarOutcome:
    """The outcome at `times` (T,), s."""
    p, p_dot, p_ddot = sampled(shape, times)
    run = _core.prescribed_outputs(tree.both, motion, as_list(times), p, p_dot, p_ddot, posture)
    if len(run.q) < len(times):
        t = times[len(run.q)]
        raise SolveError(
            f'{assembly.model.scene.path}: analysis "{analysis.name}": no position was found at t = {t:g} s: the'
            " prescribed shape takes the trajectory out of reach"
        )
    return PlanarOutcome(
        analysis=analysis,
        assembly=assembly,
        motion=motion_of(assembly, run, times),
        forces=Forces(run.tau, run.F_p) if has_motors else Forces(),
        details=PrescribedShape(shape, run.shape_force),
    )


def _tree(assembly: MechanismSystem, *, has_motors: bool) -> PlanarTree:
    return told_in_joints(assembly, "fcid", assembly.model.motors.values() if has_motors else ())
