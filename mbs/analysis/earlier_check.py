"""Whether a run can be gone on with: the core looks at nothing that it is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..model.system import MechanismSystem
from .outcome import BODY_PEAKS, METHOD_HISTORY, STEPS, EarlierRun


def check_earlier(
    earlier: EarlierRun,
    assembly: MechanismSystem,
    times: Array,
    motors: int | None,
    *,
    recorded: bool,
    state_size: int = 0,
) -> None:
    """Make sure that `earlier` is a run of `assembly` with outputs at `times`.

    `motors`: as many as the analysis finds forces of; None where it finds none. `recorded`: whether a later analysis
    replays it. `state_size`: of the state that it goes on from, where it is not complete.

    Raises `InputError` for sizes, times or numbers that are not those of such a run.
    """
    _Check(earlier, assembly, times, state_size).everything(motors, recorded=recorded)


@dataclass(frozen=True)
class _Check:
    earlier: EarlierRun
    assembly: MechanismSystem
    times: Array
    state_size: int

    def everything(self, motors: int | None, *, recorded: bool) -> None:
        outputs = len(self.earlier.motion.time)
        fits = 0 < outputs <= len(self.times) and np.array_equal(self.earlier.motion.time, self.times[:outputs])
        self._expect(fits, "time", "the times of the scene")
        self._expect(not self._completed or outputs == len(self.times), "status", "a run up to its end")
        self._rows(outputs, motors)
        if not self._completed:
            self._checkpoint(outputs, motors)
        self._recording(recorded)

    @property
    def _completed(self) -> bool:
        return self.earlier.statistics.status == "completed"

    def _rows(self, outputs: int, motors: int | None) -> None:
        n, modes = self.assembly.system.coordinates, sum(body.n_modes for body in self.assembly.model.bodies)
        found = vars(self.earlier.motion) | vars(self.earlier.forces)
        columns = {"q": n, "v": n, "a": n, "lambda_": len(self.assembly.constraints), "residual": 3}
        for name, count in columns.items():
            self._numbers(name, found[name], (outputs, count))
        for name, of_forces in (("tau", motors), ("F_p", None if motors is None else modes)):
            self._expect((found[name] is None) == (of_forces is None), name, "forces where motors fit the mechanism")
            if of_forces is not None:
                self._numbers(name, found[name], (outputs, of_forces))

    def _checkpoint(self, outputs: int, motors: int | None) -> None:
        point, times = self.earlier.continuation.checkpoint, self.times
        self._numbers("checkpoint/state", point.state, (self.state_size,))
        for name in BODY_PEAKS:
            self._numbers(f"checkpoint/peaks/{name}", getattr(point.peaks, name), (len(self.assembly.model.bodies),))
        groups = max(self.assembly.groups, default=-1) + 1 + len(self.assembly.joint_measures)
        groups += motors or 0
        self._numbers("checkpoint/peaks/groups", point.peaks.groups, (groups,))
        for record, names in ((point.steps, STEPS), (point.methods, METHOD_HISTORY)):
            values = np.array([float(getattr(record, name)) for name in names])
            self._numbers("checkpoint", values, (len(names),))
        until = times[outputs] if outputs < len(times) else times[-1]
        in_time = times[outputs - 1] - self._slack <= point.time <= until + self._slack  # False of NaN
        self._expect(bool(in_time) and point.outputs == outputs, "checkpoint", f"a time after {outputs} outputs")
        self._expect(point.steps.next_step > 0.0, "checkpoint", "a positive step")

    def _recording(self, recorded: bool) -> None:
        recording = self.earlier.continuation.recording
        self._expect(recorded == (recording is not None), "recording", "one where the run is replayed")
        if recording is None:
            return
        steps = recording.times
        self._numbers("recording/times", steps, (len(steps),))
        system = self.assembly.system
        self._numbers("recording/states", recording.states, ((system.n_q + system.n_v) * len(steps),))
        last = self.times[-1] if self._completed else self.earlier.continuation.checkpoint.time
        fits = len(steps) > 0 and steps[0] == self.times[0] and bool(np.all(np.diff(steps) > 0.0))
        self._expect(fits and abs(steps[-1] - last) <= self._slack, "recording/times", f"steps up to t = {last:g} s")

    @property
    def _slack(self) -> float:
        """Of times, for rounding, s."""
        return float(1e-9 * (self.times[-1] - self.times[0]))

    def _numbers(self, name: str, values: Array, shape: tuple[int, ...]) -> None:
        self._expect(values.shape == shape and bool(np.isfinite(values).all()), name, f"finite numbers {shape}")

    def _expect(self, holds: bool, name: str, expected: str) -> None:
        if not holds:
            raise InputError(f"{self.earlier.where}/{name}: expected {expected}, found otherwise: damaged or changed")
