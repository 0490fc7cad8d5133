"""Equilibrium under gravity, loads and the trajectories at t = 0, with the moments that hold it."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Literal

import numpy as np

from .. import _core
from ..model.model import Model
from ..model.system import MechanismSystem
from ..scene.analysis import Analysis
from ..solve.initial_state import undeformed_state
from ..solve.integrators import METHODS, NOT_INTEGRATED
from ..solve.statics import static_equilibrium
from .context import Context
from .drive import motion_of, resolver_of, statistics_of
from .elastic_joints import add_transmission
from .outcome import Forces, Outcome


class Static(Analysis):
    """The equilibrium at t = 0, and the moments, forces and voltages that hold it."""

    kind: Literal["static"]

    is_algebraic = True
    allocates_patches = True

    def run(self, context: Context) -> Outcome:
        """Motion and forces at t = 0."""
        return add_transmission(run_static(context.model, self))


def run_static(model: Model, analysis: Analysis) -> Outcome:
    """The equilibrium at the one time t = 0, whatever the `kind` that asks for it.

    The targets are frozen, so that the multipliers of the state at rest are those of the equilibrium. Raises
    `SolveError` where there is none.
    """
    held = [replace(c, target=_core.TimeFunction.constant(c.target(0.0)[0])) for c in model.trajectories]
    assembly = MechanismSystem(model, [*model.joints, *held], model.loads, list(model.motors.values()))
    state = static_equilibrium(assembly, undeformed_state(assembly))
    at_rest, resolver, began = np.zeros_like(state.v), resolver_of(assembly), time.perf_counter()
    controls = _core.IntegrationControls(
        tolerance=analysis.tolerance, max_steps=1, methods=[(METHODS["dop853"], 1.0, 0.0)], spectral_radius=0.0
    )
    run = _core.run(  # no step is made: accelerations and multipliers of one state
        system=assembly.system, groups=assembly.groups, moments=assembly.moments, joints=[], times=[0.0],
        q=state.q, v=at_rest,
        controls=controls, carry_on=lambda _: True, actuator_forces=resolver,
    )  # fmt: skip
    return Outcome(
        analysis=analysis,
        assembly=assembly,
        motion=motion_of(assembly, run, np.zeros(1)),
        forces=Forces(run.tau, run.F_p) if resolver else Forces(),
        statistics=statistics_of(assembly, run, NOT_INTEGRATED, time.perf_counter() - began),
    )
