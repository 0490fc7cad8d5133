"""What an analysis of a scene in space starts from, and what it computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from .. import _core
from ..model.spatial_drives import PointDrive
from ..model.spatial_model import SpatialModel
from ..scene.analysis import Analysis
from ..solve.integrators import NOT_INTEGRATED, Choice
from .drive import Progress
from .outcome import ADVICE, Details
from .samples import in_order
from .spatial_earlier import EarlierSpatialRun

OF_TIME = ("time", "q", "v", "a", "multipliers", "required")
"""Arrays of a run with a row for each time."""


@dataclass(frozen=True)
class SpatialRun:
    """The motion that an analysis in space found, at outputs as far as it got.

    Attributes:
        analysis: that asked for it.
        model: with the rows that held in it.
        time: (T,) s.
        q, v, a: (T, n_q), (T, n_v), (T, n_v) of the model's tree.
        multipliers: (T, rows).
        required: (T, n_v) generalized forces that a prescribed shape takes; None where those of the paths are all.
        is_at_rest: whether targets stand still, as in an equilibrium.
        applied: forces on points beside the loads of the scene.
        status: how it ended.
        integrator: which, and why.
        steps, evaluations: how many.
        wall_seconds: of all.
        before, after: s, how long it acts before t = 0 and after the end of the analysis.
        warnings: on what is left open.
        cause: why it ended early, where more is known than its status says.
        commanded: (T, k) moments by joint that act along joints beside the scene's loads, N·m or N: what a controller
            commands, or a replay applies.
        driving: the same as accelerations have it, where that is something else: before a command changes.
        details: what only its kind finds.
        checkpoint: where its integration can be gone on with; None where that cannot be done.
        step_ends: (N,) s, with which it can be repeated, if it was asked for them; see `fields.steps`.
        again: the same run with outputs at other times (T,), between its first and its last; None where it has none.
        look_closer: the same with times between its outputs; None where nothing is between.
    """

    analysis: Analysis
    model: SpatialModel
    time: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    required: Array | None = None
    is_at_rest: bool = False
    applied: tuple[PointDrive, ...] = ()
    status: str = "completed"
    integrator: Choice = NOT_INTEGRATED
    steps: int = 0
    evaluations: int = 0
    wall_seconds: float = 0.0
    before: float = 0.0
    after: float = 0.0
    warnings: tuple[str, ...] = ()
    cause: str = ""
    commanded: Mapping[str, Array] = field(default_factory=dict)
    driving: Mapping[str, Array] = field(default_factory=dict)
    details: Details = field(default=Details(), repr=False)
    checkpoint: _core.TreeCheckpoint | None = field(default=None, repr=False)
    again: Callable[[Array], SpatialRun] | None = field(default=None, repr=False)
    step_ends: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    look_closer: Callable[[], SpatialRun] | None = field(default=None, repr=False)

    @property
    def closer(self) -> SpatialRun:
        """The run at its outputs and between: see `samples`. Itself where nothing is between."""
        return self if self.look_closer is None else self.look_closer()

    @property
    def time_reached(self) -> float:
        """Where the last step ended, s; the last output where that is not known."""
        if self.checkpoint is not None:
            return self.checkpoint.time
        return float(self.time[-1]) if len(self.time) else 0.0

    @property
    def failed(self) -> bool:
        """Whether it did not do what it was for; of some kinds an early end is a finding."""
        return self.status not in ("completed", *self.analysis.findings)

    def rows(self, chosen: slice | Sequence[int]) -> SpatialRun:
        """These outputs alone."""
        of_time = {name: getattr(self, name) for name in OF_TIME}
        return replace(
            self,
            commanded={joint: values[chosen] for joint, values in self.commanded.items()},
            driving={joint: values[chosen] for joint, values in self.driving.items()},
            **{name: values[chosen] for name, values in of_time.items() if values is not None},
        )

    def among(self, between: SpatialRun) -> SpatialRun:
        """With the rows of the same run at times between its outputs."""
        order = in_order(self.time, between.time)
        of_time = {name: (getattr(self, name), getattr(between, name)) for name in OF_TIME}
        joined = {name: np.concatenate(both)[order] for name, both in of_time.items() if both[0] is not None}
        return replace(self, **joined)

    def added_to(self, earlier: EarlierSpatialRun) -> SpatialRun:
        """With the work of the run that this one went on from."""
        counts = ("steps", "evaluations", "wall_seconds")
        whole = replace(self, **{name: getattr(earlier, name) + getattr(self, name) for name in counts})
        ends = np.concatenate([earlier.step_ends, self.step_ends])
        return replace(whole, step_ends=ends if len(ends) == whole.steps else np.zeros(0))

    def check_completed(self, how_to_go_on: str = "") -> None:
        """Raise `SolveError` with advice where it ended early."""
        if self.failed:
            raise SolveError(
                f'{self.model.scene.path}: analysis "{self.analysis.name}" ended at t = {self.time_reached:.9g} s'
                f" ({self.status}): {self.cause or ADVICE[self.status]}{how_to_go_on}"
            )


ModalForces = Mapping[str, Array]
"""By body, (T, n) on the modes of its file."""

Supply = Callable[[ModalForces, bool], ModalForces]
"""What patches do of modal forces, within their limits or not; bodies without patches are left out."""


def no_patches(wanted: ModalForces, limited: bool) -> ModalForces:
    """Nothing."""
    return {}


ForcesAtPoints = Callable[[SpatialRun], Mapping[str, Array]]
"""By "BODY.POINT" what a run's driving forces are there: (T, 3) N, global axes."""


def no_points(run: SpatialRun) -> Mapping[str, Array]:
    """None."""
    return {}


@dataclass(frozen=True)
class SpatialContext:
    """What the run of an analysis in space starts from.

    Attributes:
        model: the robot, with the rows of all joints that close loops and of all trajectories.
        runs: of the analyses before, by name.
        progress: see `drive.Progress`.
        supply: what patches do.
        at_points: what driving forces are at the actuation points.
        earlier: a run of this analysis to go on with; None from the start.
    """

    model: SpatialModel
    runs: Mapping[str, SpatialRun]
    progress: Progress
    supply: Supply = no_patches
    at_points: ForcesAtPoints = no_points
    earlier: EarlierSpatialRun | None = None
