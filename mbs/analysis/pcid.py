"""Partially constrained inverse dynamics: joints and trajectories hold, p is free (Shabana 2022, sec. 5)."""

from __future__ import annotations

from typing import Literal

from ..linear.statics import hanging_joints, initial_state
from ..model.gears import with_prescribed_motors
from ..posture.posture import check_path, mobility
from ..posture.reach import check_reach
from ..posture.redundancy import resolved
from ..posture.start import displaced_joints, undeformed_posture
from ..run.context import Context
from ..run.drive import drive_robot
from ..run.record import Run
from ..scene.analysis import Check, IntegratedAnalysis


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

    def run(self, context: Context) -> Run:
        """C_m and C_s hold, p is free; and compliant gears, where motors follow the trajectories.

        Raises `InputError` where the trajectories cannot be followed, `SolveError` where there is no equilibrium to
        start from.
        """
        rigid = resolved(context.model, self.last_time)
        check_reach(rigid, self.last_time)
        posture = undeformed_posture(rigid).q
        warnings, way = tuple(check_path(rigid, posture, self.last_time)), mobility(rigid, posture)
        model = with_prescribed_motors(rigid)
        start = initial_state(model)
        warnings += tuple(displaced_joints(model, {gear.joint.joint.name for gear in model.tree.gears}))
        if way.followed < way.freedom:
            warnings += tuple(hanging_joints(model, start))
        return drive_robot(
            model,
            self,
            start,
            context.progress,
            warnings=warnings,
            earlier=context.earlier,
            is_recorded=context.is_replayed,
        )
