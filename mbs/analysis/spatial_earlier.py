"""What an earlier run in space has computed, to be gone on with: the core looks at nothing that it is given."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..model.spatial_model import SpatialModel
from ..solve.integrators import Choice
from .kept_check import Kept

ROWS = ("q", "v", "a", "multipliers")
"""Arrays of a run with one row per output."""


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
        step_ends: (N,) s, of all its steps, if it was asked for them.
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
    step_ends: Array = field(default_factory=lambda: np.zeros(0), repr=False)

    @contextmanager
    def checked(self, model: SpatialModel, times: Array) -> Iterator[None]:
        """For the run of `model` with outputs at `times` that goes on with this one.

        Raises `InputError` where sizes, times and numbers are not those of such a run.
        """
        self._check(model, times)
        with self._kept(times).gone_on_with():
            yield

    def _check(self, model: SpatialModel, times: Array) -> None:
        outputs, n_q, n_v = len(self.time), model.tree.n_q, model.tree.n_v
        kept = self._kept(times)
        fits = 0 < outputs <= len(times) and np.array_equal(self.time, times[:outputs])
        kept.expect(fits, "time", "the times of the scene")
        completed = self.status == "completed"
        kept.expect(not completed or outputs == len(times), "status", "a run up to its end")
        columns = dict(zip(ROWS, (n_q, n_v, n_v, len(model.rows)), strict=True))
        for name, count in columns.items():
            kept.numbers(name, getattr(self, name), (outputs, count))
        kept.tree_checkpoint(self.checkpoint, n_q, n_v)
        kept.expect(completed or self.checkpoint.steps.next_step > 0.0, "checkpoint", "a positive step")

    def _kept(self, times: Array) -> Kept:
        return Kept(self.where, times, len(self.time))
