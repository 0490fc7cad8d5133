"""What an analysis computed: motion, forces, how the run went, and what only its kind finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import SolveError
from .. import _core
from .._core import TimeFunction
from ..joints.measure import Measure
from ..model.planar_tree import PlanarTree
from ..model.raised_mass import coordinate_factors, modal_factors
from ..model.system import MechanismSystem
from ..scene.analysis import Analysis
from ..solve.integrators import NOT_INTEGRATED, Choice

ADVICE = {
    "step underflow": "no step is small enough there",
    "too many steps": "raise max_steps, loosen the tolerance or leave out high modes",
    "interrupted": "stopped on request",
    "not evaluated": "its outputs could not be made from the states that it found",
    "mesh too coarse": "motors do not get close enough to the path: vibrations of the zero dynamics that are hardly"
    " damped take too fine a mesh; add damping, leave out high modes, smooth the path or loosen the tolerance",
    "inversion not converged": "no motion was found that motors alone carry along the path: slow the path down, add"
    ' damping, leave out high modes, or use output = "redefined"',
    "diverged": "a link is bent by as much as it is long, which small deformations do not describe: loads beyond"
    " buckling, a spin that needs geometric_stiffening = true, or an arm without motors that falls apart",
}


class _Rows:
    """Base of records of arrays with one row per output time; None where there is no such array."""

    def at(self, rows: slice | Sequence[int]) -> Self:
        """These rows alone."""
        chosen = {name: None if x is None else x[rows] for name, x in vars(self).items()}
        return replace(self, **chosen)  # type: ignore[type-var]

    def with_rows_of(self, other: Self, order: Indices) -> Self:
        """With the rows of another behind these, all in another order."""
        return type(self)(
            **{
                name: None if x is None else np.concatenate([x, getattr(other, name)])[order]
                for name, x in vars(self).items()
            }
        )

    def followed_by(self, later: Self) -> Self:
        """With the rows that `later` has beyond those that are here."""
        known = {name: x for name, x in vars(self).items() if x is not None}
        joined = {name: np.concatenate([x, getattr(later, name)[len(x) :]]) for name, x in known.items()}
        return replace(self, **joined)  # type: ignore[type-var]


@dataclass(frozen=True)
class Motion(_Rows):
    """One row per output time; bodies side by side in the columns of q, v, a: (R, θ, p) of each, SI units."""

    time: Array  # (T,) s
    q: Array  # (T, coordinates)
    v: Array
    a: Array
    lambda_: Array  # (T, constraints)
    residual: Array  # (T, 3) of C, Ċ, C̈, relative to their terms


@dataclass(frozen=True)
class Forces(_Rows):
    """What actuators have to supply."""

    tau: Array | None = None  # (T, motors) N·m (N for prismatic joints); None where motors do not fit the mechanism
    F_p: Array | None = None  # (T, modes of all bodies) N/√kg


@dataclass(frozen=True)
class Statistics:
    """How a run went. `cause` is what was found wrong at `time_reached` (s, the last step's) where it ended early.

    `step_ends` (N,), in s, with which the run can be repeated, if it was asked for them; see `fields.steps`.
    """

    status: str = "completed"
    integrator: Choice = NOT_INTEGRATED
    steps: int = 0
    rejected: int = 0
    evaluations: int = 0
    wall_seconds: float = 0.0
    time_reached: float | None = None
    cause: str = ""
    step_ends: Array = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)

    def added_to(self, earlier: Statistics) -> Statistics:
        """With the work of the run that this one went on from."""
        counts = ("steps", "rejected", "evaluations", "wall_seconds")
        return replace(self, **{name: getattr(earlier, name) + getattr(self, name) for name in counts})


STEPS = ("next_step", "usual_step", "reserve", "previous_step", "previous_error", "in_transient", "without_look")
"""Of the core's `StepHistory`, all."""

METHOD_HISTORY = ("second", "pace_of_other", "since", "measured", "tries", "window", "trial")
"""Of the core's `MethodHistory`, all."""

TREE_MEMORY = ("inertial_peak", "accepted", "least_ratio", "singular_at", "watched_at", "determinant")
"""Numbers of the core's `TreeCheckpoint` beside those of its steps and methods."""

TREE_VECTORS = ("state", "state_peaks", "force_peaks", "singular_posture", "ranges")
"""Arrays of the core's `TreeCheckpoint`."""


@dataclass(frozen=True)
class Continuation:
    """Where an integration can be gone on with, and its steps where a later analysis replays them.

    Both are of the tree of `assembly`, what was integrated, where that is not the outcome's: see `raised_mass`.
    """

    checkpoint: _core.TreeCheckpoint
    recording: _core.Recording | None = None
    assembly: MechanismSystem | None = None


@dataclass(frozen=True)
class EarlierRun:
    """What an earlier run of an analysis has computed, complete or not: it is taken over, or gone on with.

    `where` is what messages call the place that it was read from.
    """

    motion: Motion
    forces: Forces
    statistics: Statistics
    continuation: Continuation
    where: str


@dataclass(frozen=True)
class GearMotion:
    """What an elastic gear does in an inverse analysis, one row per output.

    Attributes:
        gear_moment: (T,) τ_s = k (θ_m − γ) + c (θ̇_m − γ̇), N·m: what the gear does to the second body.
        angle, rate, acceleration: (T,) of the motor behind its gear, θ_m, rad.
        moment: (T,) τ_s + J N ψ̈ of the motor, behind its gear.
        unresolved: part of the largest moment by which it changes when only every second output is known.
    """

    gear_moment: Array
    angle: Array
    rate: Array
    acceleration: Array
    moment: Array
    unresolved: float


class Details:
    """Base of what only one kind of analysis finds; itself what a kind has that finds nothing besides.

    Attributes:
        pre_actuation, post_actuation: s for which motors act before and after the path.
        loads: of the scene as this analysis had them; None where they were as the model has them.
        shape_force: (T, modes of all bodies) −λ_p, N/√kg: forces that hold a prescribed shape.
    """

    pre_actuation: float = 0.0
    post_actuation: float = 0.0
    loads: tuple[tuple[Measure, TimeFunction], ...] | None = None
    shape_force: Array | None = None

    def actuation_source(self, outcome: Outcome) -> _core.ActuationSource | None:
        """What was found at any time of the run, not at its outputs alone; None where that is not known.

        Modal forces are in the coordinates of what was integrated.
        """
        if outcome.continuation is None or outcome.continuation.recording is None:
            return None
        assembly = outcome.continuation.assembly or outcome.assembly
        motors = () if outcome.tau is None else assembly.model.motors.values()
        return _core.TreeActuation(PlanarTree(assembly, motors).both, outcome.continuation.recording)


@dataclass(frozen=True)
class Outcome:
    """What an analysis computed; `gears` by joint, of inverse analyses with elastic gears.

    Where links were divided, it is told of the one link; `in_pieces` is what was computed, and `point_names` say which
    point of which piece a point of the link is there. `look_closer` finds the same, as computed, with times between.
    """

    analysis: Analysis
    assembly: MechanismSystem
    motion: Motion
    forces: Forces = Forces()
    statistics: Statistics = Statistics()
    details: Details = field(default=Details(), repr=False)
    gears: Mapping[str, GearMotion] = field(default_factory=dict)
    continuation: Continuation | None = field(default=None, repr=False)
    in_pieces: Outcome | None = field(default=None, repr=False)
    look_closer: Callable[[], Outcome] | None = field(default=None, repr=False)
    point_names: Mapping[str, str] = field(default_factory=dict, repr=False)

    @property
    def computed(self) -> Outcome:
        """The outcome as computed: that of the pieces where links were divided, else itself."""
        return self.in_pieces or self

    @property
    def closer(self) -> Outcome:
        """The outcome as computed, at its outputs and between: see `samples`. Itself where nothing is between."""
        found = self.computed
        return found if found.look_closer is None else found.look_closer()

    @property
    def time(self) -> Array:
        """(T,) s."""
        return self.motion.time

    @property
    def q(self) -> Array:
        """(T, coordinates) positions."""
        return self.motion.q

    @property
    def v(self) -> Array:
        """(T, coordinates) velocities."""
        return self.motion.v

    @property
    def a(self) -> Array:
        """(T, coordinates) accelerations."""
        return self.motion.a

    @property
    def lambda_(self) -> Array:
        """(T, constraints) multipliers."""
        return self.motion.lambda_

    @property
    def residual(self) -> Array:
        """(T, 3) of C, Ċ, C̈, relative to their terms."""
        return self.motion.residual

    @property
    def tau(self) -> Array | None:
        """(T, motors) N·m (N for prismatic joints)."""
        return self.forces.tau

    @property
    def F_p(self) -> Array | None:
        """(T, modes of all bodies) N/√kg."""
        return self.forces.F_p

    @property
    def status(self) -> str:
        """How the run ended."""
        return self.statistics.status

    def coordinates(self, body: str) -> slice:
        """Columns of (R, θ, p) of a body in q, v and a."""
        i = self.assembly.index[body]
        first = int(self.assembly.first[i])
        return slice(first, first + 3 + self.assembly.model.bodies[i].n_modes)

    def modal_columns(self, *bodies: str) -> slice:
        """Columns of a body in `F_p`, or of several that follow each other."""
        first, last = (self.assembly.index[name] for name in (bodies[0], bodies[-1]))
        begin, end = (int(self.assembly.first[i]) - 3 * i for i in (first, last))
        return slice(begin, end + self.assembly.model.bodies[last].n_modes)

    @property
    def motor_moments(self) -> Array | None:
        """`tau`, but of elastic gears what their motors must do: (T, motors) N·m."""
        if self.tau is None or not self.gears:
            return self.tau
        motors = enumerate(self.assembly.model.motors)
        columns = [self.gears[joint].moment if joint in self.gears else self.tau[:, k] for k, joint in motors]
        return np.column_stack(columns)

    def in_coordinates_of(self, reported: MechanismSystem) -> Outcome:
        """A motion with raised masses as one of `reported`, the same mechanism without."""
        if all(a is b for a, b in zip(self.assembly.model.bodies, reported.model.bodies, strict=True)):
            return self
        factors, motion, F_p = coordinate_factors(reported.model), self.motion, self.F_p
        return replace(
            self,
            assembly=reported,
            motion=replace(motion, q=motion.q / factors, v=motion.v / factors, a=motion.a / factors),
            forces=replace(self.forces, F_p=None if F_p is None else F_p * modal_factors(reported.model)),
            continuation=self.continuation and replace(self.continuation, assembly=self.assembly),
        )

    @property
    def time_reached(self) -> float:
        """Where the last step ended, s; the last output where that is not known."""
        reached = self.statistics.time_reached
        return float(self.time[-1]) if reached is None else reached

    @property
    def failed(self) -> bool:
        """Whether the run did not do what it was for; of some kinds an early end is a finding."""
        return self.status not in ("completed", *self.analysis.findings)

    def check_completed(self, how_to_go_on: str = "") -> None:
        """Raise `SolveError` with advice where the run failed."""
        if self.failed:
            run, path = self.statistics, self.assembly.model.scene.path
            raise SolveError(
                f'{path}: analysis "{self.analysis.name}" ended at t = {self.time_reached:.9g} s'
                f" ({run.status}): {run.cause or ADVICE[run.status]}{how_to_go_on}"
            )
