"""Partially constrained inverse dynamics (Shabana 2022, sec. 5): joints and trajectories hold, p is free."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from .. import _core
from ..model.model import Model
from ..model.raised_mass import integrated
from ..model.system import MechanismSystem
from ..scene.analysis import Check, IntegratedAnalysis, Need
from ..solve.initial_state import undeformed_state
from ..solve.path_checks import check_smooth
from ..solve.reach import check_reach
from .context import AnyContext, Context
from .drive import Progress, drive, initial_state, motors_fit
from .elastic_joints import add_transmission
from .outcome import AnyOutcome, EarlierRun
from .planar_outcome import PlanarOutcome
from .spatial_pcid import run_spatial_pcid


class Pcid(IntegratedAnalysis):
    """Forces that move the robot along its trajectories while the links vibrate freely (Shabana 2022).

    `check` "finer" applies them to links with twice the modes and reports the deviation of the end effector.
    """

    kind: Literal["pcid"]
    check: Check = None
    """Forward simulation under the result with twice the modes ("finer")."""

    is_resumable = True
    allocates_patches = True
    applicable = ("joints", "joints+pzt", "trajectory", "points")

    def needs(self) -> Iterator[Need]:
        """Something to follow."""
        yield Need("kind", self.kind, "trajectory")

    def run(self, context: AnyContext) -> AnyOutcome:
        """Motion and forces."""
        if isinstance(context, Context):
            return run_spatial_pcid(context, self)
        found = run_pcid(context.model, self, context.is_replayed, context.progress, context.earlier)
        return add_transmission(found)


def run_pcid(
    model: Model,
    analysis: IntegratedAnalysis,
    keep_recording: bool,
    progress: Progress,
    earlier: EarlierRun | None = None,
) -> PlanarOutcome:
    """C_m and C_s hold, p is free. It goes on with an `earlier` run of the same analysis.

    Raises `InputError` where the trajectories cannot be followed.
    """
    raised = integrated(model)
    assembly = _system(raised)
    start = initial_state(assembly)
    if not analysis.is_repeated:
        paths = [(held.measure.label, held.target) for held in assembly.constraints if held.is_trajectory]
        check_smooth(model.scene.path, paths, analysis.end)
        check_reach(assembly, undeformed_state(assembly), analysis.times)
    recording = _core.Recording() if keep_recording else None
    return drive(
        assembly,
        analysis,
        start,
        progress,
        reported=None if raised is model else _system(model),
        finds_forces=motors_fit(model),
        recording=recording,
        earlier=earlier,
    )


def _system(model: Model) -> MechanismSystem:
    return MechanismSystem(model, [*model.joints, *model.trajectories], model.loads, list(model.motors.values()))
