"""Whether an earlier run of an analysis can be gone on with: the core looks at nothing that it is given."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .. import _core
from ..model.model import Model
from .outcome import METHOD_HISTORY, STEPS, TREE_MEMORY, TREE_VECTORS, EarlierRun


def check_earlier(earlier: EarlierRun, model: Model, times: Array, *, is_recorded: bool) -> None:
    """Make sure that `earlier` is a run of `model` with outputs at `times` (s).

    `is_recorded`: whether a later analysis replays it. Raises `InputError` for sizes, times or numbers that are not
    those of such a run.
    """
    outputs, is_completed = len(earlier.motion.time), earlier.statistics.status == "completed"
    kept, point = _Kept(earlier.where, times, outputs), earlier.continuation.checkpoint
    fits = 0 < outputs <= len(times) and np.array_equal(earlier.motion.time, times[:outputs])
    kept.expect(fits, "time", "the times of the scene")
    kept.expect(not is_completed or outputs == len(times), "status", "a run up to its end")
    n_q, n_v = model.tree.n_q, model.tree.n_v
    for name, columns in (("q", n_q), ("v", n_v), ("a", n_v), ("multipliers", len(model.rows))):
        kept.numbers(name, getattr(earlier.motion, name), (outputs, columns))
    kept.tree_checkpoint(point, n_q, n_v)
    kept.expect(is_completed or point.steps.next_step > 0.0, "checkpoint", "a positive step")
    kept.expect(
        is_recorded == (earlier.continuation.recording is not None), "recording", "one at which its forces are applied"
    )
    if earlier.continuation.recording is not None:
        kept.recording(earlier.continuation.recording, n_q + n_v, times[-1] if is_completed else point.time)
    if earlier.continuation.samples is not None:
        kept.samples(earlier.continuation.samples, n_q + n_v)


@contextmanager
def going_on(earlier: EarlierRun | None, times: Array) -> Iterator[None]:
    """For the run with outputs at `times` (s) that goes on with `earlier`, if there is one.

    Raises `InputError` where the core finds the memory to be of another mechanism.
    """
    try:
        yield
    except ValueError:
        if earlier is None:
            raise
        kept = _Kept(earlier.where, times, len(earlier.motion.time))
        kept.expect(False, "checkpoint", "what a run of this scene remembers")


@dataclass(frozen=True)
class _Kept:
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

    def samples(self, found: _core.Samples, size: int) -> None:
        """Raise `InputError` for some that are none of states (size,) within the run."""
        self.numbers("samples/times", found.times, (len(found.times),))
        self.numbers("samples/states", found.states, (size * len(found.times),))
        fits = bool(np.all(np.diff(found.times) >= 0.0)) and len(found.times) <= found.most
        self.expect(fits, "samples/times", "ascending times")

    def recording(self, found: _core.Recording, size: int, last: float) -> None:
        """Raise `InputError` for one that is none of states (size,) at steps up to time `last`, s."""
        steps = found.times
        self.numbers("recording/times", steps, (len(steps),))
        self.numbers("recording/states", found.states, (size * len(steps),))
        fits = len(steps) > 0 and steps[0] == self.times[0] and bool(np.all(np.diff(steps) > 0.0))
        self.expect(fits and abs(steps[-1] - last) <= self.slack, "recording/times", f"steps up to t = {last:g} s")
