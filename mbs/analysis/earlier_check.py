"""Whether a planar run can be gone on with: the core looks at nothing that it is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ..model.system import MechanismSystem
from .kept_check import Kept
from .outcome import EarlierRun


def check_earlier(
    earlier: EarlierRun,
    assembly: MechanismSystem,
    times: Array,
    motors: int | None,
    *,
    recorded: bool,
    tree_size: int,
) -> None:
    """Make sure that `earlier` is a run of `assembly` with outputs at `times`.

    `motors`: as many as the analysis finds forces of; None where it finds none. `recorded`: whether a later analysis
    replays it. `tree_size`: of q and of v of the tree.

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
    tree_size: int

    def everything(self, motors: int | None, *, recorded: bool) -> None:
        outputs = len(self.earlier.motion.time)
        fits = 0 < outputs <= len(self.times) and np.array_equal(self.earlier.motion.time, self.times[:outputs])
        self.kept.expect(fits, "time", "the times of the scene")
        self.kept.expect(not self._completed or outputs == len(self.times), "status", "a run up to its end")
        self._rows(outputs, motors)
        if not self._completed:
            self._checkpoint()
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

    def _checkpoint(self) -> None:
        point = self.earlier.continuation.checkpoint
        self.kept.tree_checkpoint(point, self.tree_size, self.tree_size)
        self.kept.expect(point.steps.next_step > 0.0, "checkpoint", "a positive step")

    def _recording(self, recorded: bool) -> None:
        recording = self.earlier.continuation.recording
        self.kept.expect(recorded == (recording is not None), "recording", "one where the run is replayed")
        if recording is None:
            return
        steps = recording.times
        self.kept.numbers("recording/times", steps, (len(steps),))
        self.kept.numbers("recording/states", recording.states, (2 * self.tree_size * len(steps),))
        last = self.times[-1] if self._completed else self.earlier.continuation.checkpoint.time
        fits = len(steps) > 0 and steps[0] == self.times[0] and bool(np.all(np.diff(steps) > 0.0))
        self.kept.expect(
            fits and abs(steps[-1] - last) <= self.kept.slack, "recording/times", f"steps up to t = {last:g} s"
        )
