"""What an earlier run of an analysis has computed, complete or not: it is taken over, or gone on with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .. import _core
from ..solve.integrators import Choice

if TYPE_CHECKING:
    from ..model.system import MechanismSystem
    from ..scene.analysis_records import Analysis
    from .analyses import Outcome

ROWS = ("time", "q", "v", "a", "lambda_", "tau", "F_p", "residual")
"""Of an `Outcome`, what has one row per output time."""

COUNTS = ("steps", "rejected", "evaluations", "wall_seconds")
"""Of an `Outcome`, what adds up."""

STEPPING = 6
"""Numbers of a checkpoint that control the step size."""


@dataclass(frozen=True)
class EarlierRun:
    """Fields of the `Outcome` by name: `rows` (tau and F_p only where there are any) and `counts`."""

    status: str
    rows: Mapping[str, Array]
    counts: Mapping[str, Any]
    integrator: Choice
    checkpoint: _core.Checkpoint
    recording: _core.Recording | None
    where: str  # in which file

    def check(self, assembly: MechanismSystem, analysis: Analysis, motors: int | None, recorded: bool) -> None:
        """Make sure that the core can go on: the core itself looks at nothing.

        `motors`: as many as the analysis has forces of; None where it has none. `recorded`: whether it is replayed.
        Raises `InputError` for sizes, times or numbers that are not those of such a run.
        """
        n, T = assembly.system.coordinates, len(self.rows["time"])
        modes = sum(body.n_modes for body in assembly.model.bodies)
        columns = {"q": n, "v": n, "a": n, "lambda_": len(assembly.constraints), "residual": 3}
        if motors is not None:
            columns |= {"tau": motors, "F_p": modes}
        self._expect(set(self.rows) == {"time", *columns}, "rows", f"{', '.join(columns)}")
        for name, count in columns.items():
            self._numbers(name, self.rows[name], (T, count))
        times = analysis.times
        self._expect(0 < T <= len(times) and np.array_equal(self.rows["time"], times[:T]), "time", "those of the scene")
        self._expect(self.status != "completed" or len(times) == T, "status", f"a run up to t = {times[-1]:g}")
        point = self.checkpoint
        slack = 1e-9 * (times[-1] - times[0])
        if self.status != "completed":
            peaks = 7 * len(assembly.model.bodies) + max(assembly.groups, default=-1) + 1
            self._numbers("checkpoint/state", point.state, (2 * n,))
            self._numbers("checkpoint/stepping", point.stepping, (STEPPING,))
            self._numbers("checkpoint/gathered", point.gathered, (peaks,))
            until = times[T] if len(times) > T else times[-1]
            in_time = np.isfinite(point.time) and times[T - 1] - slack <= point.time <= until + slack
            self._expect(bool(in_time) and point.outputs == T, "checkpoint", f"a time after {T} outputs")
            self._expect(bool(point.stepping[0] > 0.0), "checkpoint/stepping", "a positive step")
        self._expect(recorded == (self.recording is not None), "recording", "one where the run is replayed")
        if self.recording is not None:
            steps = self.recording.times
            self._numbers("recording/states", self.recording.states, (2 * n * len(steps),))
            self._numbers("recording/times", steps, (len(steps),))
            fits = len(steps) > 0 and steps[0] == times[0] and np.all(np.diff(steps) > 0.0)
            last = times[-1] if self.status == "completed" else point.time
            self._expect(bool(fits) and abs(steps[-1] - last) <= slack, "recording/times", f"steps up to t = {last:g}")

    def _numbers(self, name: str, values: Array, shape: tuple[int, ...]) -> None:
        self._expect(values.shape == shape and bool(np.isfinite(values).all()), name, f"finite numbers {shape}")

    def _expect(self, holds: bool, name: str, expected: str) -> None:
        if not holds:
            raise InputError(
                f"{self.where}/{name}: expected {expected}, found otherwise: the file was damaged or changed"
            )

    def followed_by(self, outcome: Outcome) -> Outcome:
        """`outcome` of a run that went on from the checkpoint, whose rows before that mean nothing."""
        first = len(self.rows["time"])
        rows = {name: np.concatenate([rows, getattr(outcome, name)[first:]]) for name, rows in self.rows.items()}
        counts = {name: count + getattr(outcome, name) for name, count in self.counts.items()}
        return replace(outcome, **rows, **counts)
