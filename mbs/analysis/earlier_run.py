"""What an earlier run of an analysis has computed, complete or not: it is taken over, or gone on with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..solve.integrators import Choice

if TYPE_CHECKING:
    from .analyses import Outcome

ROWS = ("time", "q", "v", "a", "lambda_", "tau", "F_p", "residual")
"""Of an `Outcome`, what has one row per output time."""

COUNTS = ("steps", "rejected", "evaluations", "wall_seconds")
"""Of an `Outcome`, what adds up."""


@dataclass(frozen=True)
class EarlierRun:
    """Fields of the `Outcome` by name: `rows` (tau and F_p only where there are any) and `counts`."""

    status: str
    rows: Mapping[str, Array]
    counts: Mapping[str, Any]
    integrator: Choice
    checkpoint: _core.Checkpoint
    recording: _core.Recording | None

    def followed_by(self, outcome: Outcome) -> Outcome:
        """`outcome` of a run that went on from the checkpoint, whose rows before that mean nothing."""
        first = len(self.rows["time"])
        rows = {name: np.concatenate([rows, getattr(outcome, name)[first:]]) for name, rows in self.rows.items()}
        counts = {name: count + getattr(outcome, name) for name, count in self.counts.items()}
        return replace(outcome, **rows, **counts)
