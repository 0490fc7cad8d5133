"""Whether a planar run can be gone on with: the core looks at nothing that it is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..model.system import MechanismSystem
from .kept_check import Kept
from .outcome import BODY_PEAKS, METHOD_HISTORY, STEPS, EarlierRun


def check_earlier(
    earlier: EarlierRun,
    assembly: MechanismSystem,
    times: Array,
    motors: int | None,
    *,
    recorded: bool,
    tree_size: int | None = None,
) -> None:
    """Make sure that `earlier` is a run of `assembly` with outputs at `times`.

    `motors`: as many as the analysis finds forces of; None where it finds none. `recorded`: whether a later analysis
    replays it. `tree_size`: of q and of v of the tree; None where there is none.

    Raises `InputError` for sizes, times or numbers that are not those of such a run.
    """
    _Check(earlier, assembly, times, kept_of(earlier, times), tree_size).everything(motors, recorded=recorded)


def kept_of(earlier: EarlierRun, times: Array) -> Kept:
    """What was kept of it, for a run with outputs at `times`."""
    return Kept(earlier.where, times, len(earlier.motion.time))


@dataclass(frozen=True)
class _Check:
    earlier: EarlierRun
    assembly: MechanismSystem
    times: Array
    kept: Kept
    tree_size: int | None

    def everything(self, motors: int | None, *, recorded: bool) -> None:
        outputs = len(self.earlier.motion.time)
        fits = 0 < outputs <= len(self.times) and np.array_equal(self.earlier.motion.time, self.times[:outputs])
        self.kept.expect(fits, "time", "the times of the scene")
        self.kept.expect(not self._completed or outputs == len(self.times), "status", "a run up to its end")
        self._rows(outputs, motors)
        if not self._completed:
            self._checkpoint(motors)
        self._recording(recorded)

    @property
    def _completed(self) -> bool:
        return self.earlier.statistics.status == "completed"

    def _rows(self, outputs: int, motors: int | None) -> None:
        n, modes = self.assembly.system.coordinates, sum(body.n_modes for body in self.assembly.model.bodies)
        found = vars(self.earlier.motion) | vars(self.earlier.forces)
        columns = {"q": n, "v": n, "a": n, "lambda_": len(self.assembly.constraints), "residual": 3}
        for name, count in columns.items():
            self.kept.numbers(name, found[name], (outputs, count))
        for name, of_forces in (("tau", motors), ("F_p", None if motors is None else modes)):
            self.kept.expect(
                (found[name] is None) == (of_forces is None), name, "forces where motors fit the mechanism"
            )
            if of_forces is not None:
                self.kept.numbers(name, found[name], (outputs, of_forces))

    def _checkpoint(self, motors: int | None) -> None:
        point = self.earlier.continuation.checkpoint
        if isinstance(point, _core.Checkpoint):
            self._of_system(point, motors)
        else:
            self.kept.tree_checkpoint(point, self._size_of_tree, self._size_of_tree)
        self.kept.expect(point.steps.next_step > 0.0, "checkpoint", "a positive step")

    def _of_system(self, point: _core.Checkpoint, motors: int | None) -> None:
        self.kept.numbers("checkpoint/state", point.state, (self._state_size,))
        for name in BODY_PEAKS:
            values = getattr(point.peaks, name)
            self.kept.numbers(f"checkpoint/peaks/{name}", values, (len(self.assembly.model.bodies),))
        groups = max(self.assembly.groups, default=-1) + 1 + len(self.assembly.joint_measures)
        groups += motors or 0
        self.kept.numbers("checkpoint/peaks/groups", point.peaks.groups, (groups,))
        for record, names in ((point.steps, STEPS), (point.methods, METHOD_HISTORY)):
            self.kept.fields(record, names)
        self.kept.stands_after_outputs(point)

    def _recording(self, recorded: bool) -> None:
        recording = self.earlier.continuation.recording
        self.kept.expect(recorded == (recording is not None), "recording", "one where the run is replayed")
        if recording is None:
            return
        steps = recording.times
        self.kept.numbers("recording/times", steps, (len(steps),))
        in_tree = isinstance(self.earlier.continuation.checkpoint, _core.TreeCheckpoint)
        size = 2 * self._size_of_tree if in_tree else self._state_size
        self.kept.numbers("recording/states", recording.states, (size * len(steps),))
        last = self.times[-1] if self._completed else self.earlier.continuation.checkpoint.time
        fits = len(steps) > 0 and steps[0] == self.times[0] and bool(np.all(np.diff(steps) > 0.0))
        self.kept.expect(
            fits and abs(steps[-1] - last) <= self.kept.slack, "recording/times", f"steps up to t = {last:g} s"
        )

    @property
    def _size_of_tree(self) -> int:
        self.kept.expect(self.tree_size is not None, "checkpoint", "what a run of this scene remembers")
        return self.tree_size or 0

    @property
    def _state_size(self) -> int:
        return int(self.assembly.system.n_q + self.assembly.system.n_v)
