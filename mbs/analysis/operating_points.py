"""About what a robot is linearised: an equilibrium, or instants of an earlier analysis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...common.errors import InputError
from ..model.model import Model
from ..model.system import MechanismSystem
from ..scene.analysis_records import Analysis
from ..solve.initial_state import undeformed_state
from ..solve.linearisation import held_by_motors
from .analyses import Outcome, run_static
from .elastic_joints import add_transmission, with_compliance, with_rotors

NEAR = 1e-9  # of the end of an analysis: how far from an output a time may be for rounding


def operating_points(model: Model, analysis: Analysis, source: Outcome | None) -> Outcome:
    """The motion at the times of `analysis`: rows of the earlier analysis `source`, or the static equilibrium.

    At the equilibrium trajectories are held at t = 0, and where there are none motors keep the initial configuration.
    Raises `InputError` for times that are no outputs of the source, `SolveError` where there is no equilibrium.
    """
    if source is None:
        held = model
        if not model.trajectories and model.motors:
            start = undeformed_state(MechanismSystem(model, model.joints))
            held = replace(model, trajectories=tuple(held_by_motors(model, start.q)))
        outcome = with_rotors(add_transmission(run_static(held, analysis)), with_compliance(model))
        return replace(outcome, tau=None, F_p=None)
    source = with_rotors(source, with_compliance(model))
    rows = [_row(model, analysis, source, t) for t in analysis.times]
    return replace(
        source, analysis=analysis, time=source.time[rows], q=source.q[rows], v=source.v[rows], a=source.a[rows],
        lambda_=source.lambda_[rows], residual=source.residual[rows], tau=None, F_p=None, recording=None, shape=None,
        shape_force=None, steps=0, rejected=0, evaluations=0, wall_seconds=0.0,
    )  # fmt: skip


def _row(model: Model, analysis: Analysis, source: Outcome, t: float) -> int:
    row = int(np.abs(source.time - t).argmin())
    if abs(source.time[row] - t) > NEAR * max(1.0, source.analysis.end):
        step = source.analysis.output_step
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": times: expected output times of "{source.analysis.name}",'
            f" every {step:g} s up to {source.time[-1]:g} s, found {t:g}"
        )
    return row
