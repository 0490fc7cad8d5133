"""What an earlier run in space has computed, to be gone on with: the core looks at nothing that it is given."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .. import _core
from ..model.spatial_model import SpatialModel
from ..solve.integrators import Choice
from .outcome import METHOD_HISTORY, STEPS

ROWS = ("q", "v", "a", "multipliers")
"""Arrays of a run with one row per output."""

MEMORY = (
    "inertial_peak", "accepted", "least_ratio", "singular_at", "watched_at", "determinant",
)  # fmt: skip
"""Numbers of the core's `TreeCheckpoint` beside those of its steps and methods."""

VECTORS = ("state", "state_peaks", "force_peaks", "singular_posture")
"""Arrays of the core's `TreeCheckpoint`."""


@dataclass(frozen=True)
class EarlierSpatialRun:
    """An earlier run of an analysis, complete or not, as far as it got.

    Attributes:
        time: (T,) s.
        q, v, a: (T, n_q), (T, n_v), (T, n_v).
        multipliers: (T, rows).
        integrator: which, and why.
        status: how it ended.
        steps, evaluations: how many.
        wall_seconds: of all.
        checkpoint: where it goes on.
        where: what messages call the place that it was read from.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    integrator: Choice
    status: str
    steps: int
    evaluations: int
    wall_seconds: float
    checkpoint: _core.TreeCheckpoint
    where: str

    @contextmanager
    def checked(self, model: SpatialModel, times: Array) -> Iterator[None]:
        """For the run of `model` with outputs at `times` that goes on with this one.

        Raises `InputError` where sizes, times and numbers are not those of such a run.
        """
        self._check(model, times)
        try:
            yield
        except ValueError:  # by the core: what it remembers is that of another mechanism
            self._expect(False, "checkpoint", "what a run of this scene remembers")

    def _check(self, model: SpatialModel, times: Array) -> None:
        outputs, n_q, n_v = len(self.time), model.tree.n_q, model.tree.n_v
        fits = 0 < outputs <= len(times) and np.array_equal(self.time, times[:outputs])
        self._expect(fits, "time", "the times of the scene")
        self._expect(self.status != "completed" or outputs == len(times), "status", "a run up to its end")
        columns = dict(zip(ROWS, (n_q, n_v, n_v, len(model.rows)), strict=True))
        for name, count in columns.items():
            self._numbers(name, getattr(self, name), (outputs, count))
        self._checkpoint(times, n_q + n_v)

    def _checkpoint(self, times: Array, state_size: int) -> None:
        point, outputs = self.checkpoint, len(self.time)
        self._numbers("checkpoint/state", point.state, (state_size,))
        for name in VECTORS[1:]:
            self._numbers(f"checkpoint/{name}", getattr(point, name), getattr(point, name).shape)
        watched = len(point.singular_posture)
        self._expect(watched in (0, state_size - self.v.shape[1]), "checkpoint/singular_posture", "a posture or none")
        for record, names in ((point.steps, STEPS), (point.methods, METHOD_HISTORY), (point, MEMORY)):
            values = np.array([float(getattr(record, name)) for name in names])
            self._numbers("checkpoint", values, (len(names),))
        slack = 1e-9 * (times[-1] - times[0])  # for rounding, s
        until = times[min(outputs, len(times) - 1)]
        in_time = times[outputs - 1] - slack <= point.time <= until + slack
        self._expect(bool(in_time) and point.outputs == outputs, "checkpoint", f"a time after {outputs} outputs")
        self._expect(self.status == "completed" or point.steps.next_step > 0.0, "checkpoint", "a positive step")

    def _numbers(self, name: str, values: Array, shape: tuple[int, ...]) -> None:
        self._expect(values.shape == shape and bool(np.isfinite(values).all()), name, f"finite numbers {shape}")

    def _expect(self, holds: bool, name: str, expected: str) -> None:
        if not holds:
            raise InputError(f"{self.where}/{name}: expected {expected}, found otherwise: damaged or changed")
