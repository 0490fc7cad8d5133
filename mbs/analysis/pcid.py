"""Partially constrained inverse dynamics: joints and trajectories hold, p is free (Shabana 2022, sec. 5)."""

from typing import Literal

from ..linear.statics import hanging_joints, initial_state
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

    starts_on_path = True
    is_resumable = True
    allocates_patches = True
    applicable = ("joints", "joints+pzt", "trajectory", "points")

    def run(self, context: Context) -> Run:
        """Integrate under constraints of joints and trajectories; modes are free, and gears whose motors follow paths.

        Raises `SolveError` where there is no equilibrium to start from.
        """
        path = context.path
        assert path is not None
        model, start, warnings = path.model, initial_state(path.model, path.state), path.warnings
        if path.mobility.followed < path.mobility.freedom:
            warnings += tuple(hanging_joints(model, path.state, start))
        return drive_robot(
            model,
            self,
            start,
            context.progress,
            warnings=warnings,
            earlier=context.earlier,
            is_recorded=context.is_replayed,
            undeformed=path.state.q,
        )
