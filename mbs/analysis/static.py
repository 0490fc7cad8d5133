"""Equilibrium under gravity, loads and the trajectories at t = 0, with the moments that hold it."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Literal

import numpy as np

from .. import _core
from ..model.model import Model
from ..model.planar_tree import told_in_joints
from ..model.system import MechanismSystem
from ..scene.analysis import Analysis
from ..solve.initial_state import undeformed_state
from ..solve.integrators import METHODS, NOT_INTEGRATED
from ..solve.statics import static_equilibrium
from .context import AnyContext, Context
from .drive import motion_of, motors_fit, statistics_of
from .elastic_joints import add_transmission
from .outcome import AnyOutcome, Forces
from .planar_outcome import PlanarOutcome
from .spatial_static import run_spatial_static


class Static(Analysis):
    """The equilibrium at t = 0 with the torques, forces and voltages that it needs."""

    kind: Literal["static"]

    is_algebraic = True
    allocates_patches = True

    def run(self, context: AnyContext) -> AnyOutcome:
        """Motion and forces at t = 0."""
        if isinstance(context, Context):
            return run_spatial_static(context, self)
        return add_transmission(run_static(context.model, self))


def run_static(model: Model, analysis: Analysis) -> PlanarOutcome:
    """The equilibrium at the one time t = 0, whatever the `kind` that asks for it.

    The targets are frozen, so that the multipliers of the state at rest are those of the equilibrium. Raises
    `SolveError` where there is none.
    """
    held = [replace(c, target=_core.TimeFunction.constant(c.target(0.0)[0])) for c in model.trajectories]
    assembly = MechanismSystem(model, [*model.joints, *held], model.loads, list(model.motors.values()))
    state = static_equilibrium(assembly, undeformed_state(assembly))
    finds_forces, began = motors_fit(model), time.perf_counter()
    tree = told_in_joints(assembly, analysis.kind, model.motors.values() if finds_forces else ())
    q, v = tree.state(state.q, np.zeros_like(state.v))
    controls = _core.IntegrationControls(
        tolerance=analysis.tolerance, max_steps=1, methods=[(METHODS["dop853"], 1.0, 0.0)], spectral_radius=0.0
    )
    # no step is made: accelerations and multipliers of one state
    run = _core.run_tree(tree.both, times=[0.0], q=q, v=v, controls=controls, carry_on=lambda _: True)
    return PlanarOutcome(
        analysis=analysis,
        assembly=assembly,
        motion=motion_of(assembly, run, np.zeros(1)),
        forces=Forces(run.tau, run.F_p) if finds_forces else Forces(),
        statistics=statistics_of(assembly, run, NOT_INTEGRATED, time.perf_counter() - began),
    )
