"""Whether what a results file kept of a run can be gone on with: the core looks at nothing that it is given."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .. import _core
from .outcome import METHOD_HISTORY, STEPS, TREE_MEMORY, TREE_VECTORS


@dataclass(frozen=True)
class Kept:
    """What was kept at `where`, as messages call it, of a run with outputs at `times` (s); `outputs` were computed."""

    where: str
    times: Array
    outputs: int

    def expect(self, holds: bool, name: str, expected: str) -> None:
        """Raise `InputError` unless it `holds`."""
        if not holds:
            raise InputError(f"{self.where}/{name}: expected {expected}, found otherwise: damaged or changed")

    def numbers(self, name: str, values: Array, shape: tuple[int, ...]) -> None:
        """Raise `InputError` unless they are finite and have that shape."""
        self.expect(values.shape == shape and bool(np.isfinite(values).all()), name, f"finite numbers {shape}")

    def fields(self, record: object, names: tuple[str, ...]) -> None:
        """Raise `InputError` for numbers of a record of the checkpoint that are not finite."""
        self.numbers("checkpoint", np.array([float(getattr(record, name)) for name in names]), (len(names),))

    @property
    def slack(self) -> float:
        """Of times, for rounding, s."""
        return float(1e-9 * (self.times[-1] - self.times[0]))

    def stands_after_outputs(self, point: _core.TreeCheckpoint) -> None:
        """Raise `InputError` for a checkpoint at a time that does not fit its outputs."""
        until = self.times[min(self.outputs, len(self.times) - 1)]
        in_time = self.times[self.outputs - 1] - self.slack <= point.time <= until + self.slack  # False of NaN
        holds = bool(in_time) and point.outputs == self.outputs
        self.expect(holds, "checkpoint", f"a time after {self.outputs} outputs")

    def tree_checkpoint(self, point: _core.TreeCheckpoint, n_q: int, n_v: int) -> None:
        """Raise `InputError` for a checkpoint that is none of a tree with q (n_q,) and v (n_v,)."""
        self.numbers("checkpoint/state", point.state, (n_q + n_v,))
        for name in TREE_VECTORS[1:]:
            self.numbers(f"checkpoint/{name}", getattr(point, name), getattr(point, name).shape)
        watched = len(point.singular_posture)
        self.expect(watched in (0, n_q), "checkpoint/singular_posture", "a posture or none")
        for record, names in ((point.steps, STEPS), (point.methods, METHOD_HISTORY), (point, TREE_MEMORY)):
            self.fields(record, names)
        self.stands_after_outputs(point)

    @contextmanager
    def gone_on_with(self) -> Iterator[None]:
        """For the run that goes on. Raises `InputError` where the core finds the memory to be of another mechanism."""
        try:
            yield
        except ValueError:
            self.expect(False, "checkpoint", "what a run of this scene remembers")
