"""The record of a run: motion, forces, how it went, and what only its kind of analysis finds. SI units."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, field, replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import SolveError
from ...common.structs import struct
from .. import _core
from .._core import TimeFunction
from ..model.drives import PointDrive
from ..model.model import Model
from ..scene.analysis import Analysis
from ..scene.space import SPACES, Space
from .integrators import NOT_INTEGRATED, Choice
from .stops import path_times

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, PPoly

    from ..model.divided_link import LinkInPieces

HUGE = 1e100  # rates (rad/s, m/s), beyond which squares of what follows from them may be no numbers
ADVICE = {
    "step underflow": "no step is small enough there",
    "too many steps": "raise max_steps, loosen the tolerance or leave out high modes",
    "interrupted": "stopped on request",
    "not evaluated": "its outputs could not be made from the states that it found",
    "mesh too coarse": "motors do not get close enough to the path, as weakly damped vibrations of the zero dynamics"
    " need too fine a mesh. Add damping, leave out high modes, smooth the path or loosen the tolerance",
    "inversion not converged": "no motion follows the path with motor torques only: slow the path down, add"
    ' damping, leave out high modes, or use output = "redefined"',
    "diverged": "a link is bent by as much as it is long: a path too fast, loads beyond buckling, a spin that needs"
    " geometric_stiffening = true, or an arm without motors that falls apart",
}


@struct
class Statistics:
    """Statistics of a run; `cause` is the reason of an early end at `time_reached`, s.

    `rejected` steps are not in `steps`; `evaluations` are of the equations of motion. `step_ends` (N,), s, if kept,
    repeat the run. `warnings`: a text each.
    """

    status: str = "completed"
    integrator: Choice = NOT_INTEGRATED
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    wall_seconds: float = 0.0
    time_reached: float | None = None
    cause: str = ""
    step_ends: Array = field(default_factory=lambda: np.zeros(0))
    warnings: tuple[str, ...] = ()

    def added_to(self, earlier: "Statistics") -> "Statistics":
        """Statistics that include the earlier part of a resumed run."""
        counts = ("steps", "rejected", "evaluations", "wall_seconds")
        whole = replace(self, **{name: getattr(earlier, name) + getattr(self, name) for name in counts})
        ends = np.concatenate([earlier.step_ends, self.step_ends])
        return replace(whole, step_ends=ends if len(ends) == whole.steps else np.zeros(0))


@struct
class Continuation:
    """State from which an integration resumes, its recorded steps, and states between outputs (`samples`)."""

    checkpoint: _core.TreeCheckpoint
    recording: _core.Recording | None = None
    samples: _core.Samples | None = None


class GearCurve(NamedTuple):
    """The twist δ(t) of a compliant gear, rad, and where it is known the torque of the motor at its output, N·m."""

    twist: "BSpline | PPoly"
    torque: "PPoly | None" = None


@struct
class GearMotion:
    """Motion of a compliant gear in an inverse analysis, one row per output."""

    gear_moment: Array  # (T,) τ_s = k(δ) + c δ̇, N·m, of the gear on the joint's second body
    # (T,) θ_m of the motor at the gear's output, rad, rad/s, rad/s²
    angle: Array
    rate: Array
    acceleration: Array
    moment: Array  # (T,) motor torque at the gear's output, N·m: τ_s and that which accelerates the rotor
    # part of the largest moment by which it changes when only every second output is known
    unresolved: float
    twist: Array  # (T, 3) δ = θ_m − γ, rad, γ the joint's coordinate, with two derivatives by time
    curve: GearCurve | None  # δ(t) between outputs; None where outputs are too few


class Details:
    """Findings of one kind of analysis beyond the motion; the base class, for kinds without any."""

    # pre_actuation, post_actuation: s for which motors act before and after the path
    pre_actuation: float = 0.0
    post_actuation: float = 0.0
    # the robot whose constraint equations hold it on a path that the run follows with an error
    held: Model | None = None
    warnings: tuple[str, ...] = ()  # why it may be wrong, a text each


class Prescription(NamedTuple):
    """A motion whose modal coordinates are functions of time."""

    motion: Callable[[], _core.SpatialPrescribedMotion]  # makes new equations of it
    shape: Sequence[Sequence[TimeFunction]]  # p(t) of each body, m·√kg
    near: Array  # (n_q,) a posture near the first, rad and m
    # V(t) (k,) by body, V, where the analysis itself finds them
    voltages: "Mapping[str, PPoly]" = MappingProxyType({})
    breaks: Sequence[float] = ()  # s, between pieces of p(t), where p̈ jumps


@struct
class Run:
    """One run of an analysis: its motion, one row per output, SI units; the forces in it; how it went."""

    _: KW_ONLY
    analysis: Analysis
    model: Model  # with the constraint equations of the run
    time: Array  # (T,) s
    # (T, n_q), (T, n_v), (T, n_v) of the model's tree
    q: Array
    v: Array
    a: Array
    multipliers: Array  # (T, constraint equations) N or N·m
    # (T, n_v) generalized forces, SI, of a prescribed shape; None where `multipliers` have all forces
    required: Array | None = None
    # (T, k) by joint, N·m or N along its coordinates, of a controller or a replay
    commanded: Mapping[str, Array] = field(default_factory=dict)
    # (T, k) V by body, of patches where the analysis itself finds them
    voltages: Mapping[str, Array] = field(default_factory=dict)
    applied: tuple[PointDrive, ...] = ()  # forces on points beside the loads of the scene
    is_at_rest: bool = False  # whether targets stand still, as in an equilibrium
    # of compliant gears by joint, where they are known between outputs
    twists: Mapping[str, GearCurve] = field(default_factory=dict)
    # by name, links whose pieces are bodies of `model`
    links: "Mapping[str, LinkInPieces]" = field(default_factory=dict)
    statistics: Statistics = field(default=Statistics())
    details: Details = field(default=Details())  # findings of its kind of analysis
    continuation: Continuation | None = None
    prescribed: Prescription | None = None  # its motion as functions of time, where no steps integrate it
    # makes a run with outputs also between those of this one; None where nothing is between
    look_closer: "Callable[[], Run] | None" = None

    @property
    def space(self) -> Space:
        """Axes of the scene."""
        return SPACES[self.model.scene.space]

    @property
    def is_prescribed(self) -> bool:
        """Whether the run follows trajectories or a given motion, instead of answering to forces alone."""
        return any(row.is_trajectory for row in self.model.rows) or self.required is not None

    @property
    def recording(self) -> _core.Recording | None:
        """Recorded steps, if a later analysis replays them; else None."""
        return self.continuation.recording if self.continuation else None

    @property
    def closer(self) -> "Run":
        """The run at its outputs and at times between, which show peaks; itself where nothing is between."""
        return self if self.look_closer is None else self.look_closer()

    def with_look(self, at: "Callable[[Array], Run]") -> Self:
        """The run with a `look_closer` by `at`, which makes a run at times (T,), s, that resolve its paths."""

        @cache
        def look_closer() -> "Run":
            scene, shape = self.model.scene, (function for _, function, _ in self.analysis.prescribed())
            others = (*scene.load_functions, *shape)
            return at(path_times(self.time, scene.trajectory, self.analysis.last_time, others))

        return replace(self, look_closer=look_closer)

    @property
    def status(self) -> str:
        """Status at the end, such as "completed"."""
        return self.statistics.status

    @property
    def time_reached(self) -> float:
        """End of the last step, s; if unknown, the last output."""
        if (reached := self.statistics.time_reached) is not None:
            return reached
        return float(self.time[-1]) if len(self.time) else 0.0

    @property
    def failed(self) -> bool:
        """Whether the run missed its purpose; some kinds may end early without failing."""
        return self.status not in ("completed", *self.analysis.findings)

    @property
    def arithmetic(self) -> "np.errstate[Any]":
        """Context that ignores overflow where a run ended early or diverges: its results may be infinite."""
        is_calm = self.status == "completed" and np.abs(self.v).max(initial=0.0) < HUGE
        return np.errstate() if is_calm else np.errstate(over="ignore", invalid="ignore")

    def check_completed(self, how_to_go_on: str = "") -> None:
        """Raise `SolveError` with advice where the run failed."""
        if self.failed:
            run = self.statistics
            raise SolveError(
                f'{self.model.scene.path}: analysis "{self.analysis.name}" ended at t = {self.time_reached:.9g} s'
                f" ({run.status}): {run.cause or ADVICE[run.status]}{how_to_go_on}"
            )

    def at(self, rows: slice | Sequence[int] | Indices) -> Self:
        """The run with the outputs of numbers `rows` (k,) alone."""
        return self._each(lambda x: x[rows])

    def with_rows_of(self, other: "Run", order: Indices) -> Self:
        """Return the run with outputs of `other`, at other times of the same motion, appended, then put in `order`."""
        is_own = order < len(self.time)

        def merged(x: Array, y: Array) -> Array:
            rows = y[np.maximum(order - len(x), 0)]
            rows[is_own] = x[order[is_own]]
            return rows

        return self._each(merged, other)

    def after(self, earlier: "Run") -> Self:
        """The run with the earlier part of the same motion in front."""
        return self._each(lambda x, y: np.concatenate([y, x[len(y) :]]), earlier)

    def _each(self, change: Callable[..., Array], *others: "Run") -> Self:
        def changed(values: Sequence[Any]) -> Any:
            if isinstance(values[0], Mapping):
                return {name: change(*(value[name] for value in values)) for name in values[0]}
            return None if values[0] is None else change(*values)

        runs = (self, *others)
        return replace(self, **{name: changed([getattr(run, name) for run in runs]) for name in BY_OUTPUT})


BY_OUTPUT = ("time", "q", "v", "a", "multipliers", "required", "commanded", "voltages")
"""Fields of a `Run` with one row per output."""
