"""Base of all analyses of a scene file, SI units; each kind is a record, in the file that runs it.

All kinds are in `ffrobot.scene.kinds`.
"""

from collections.abc import Callable, Iterator, Sequence
from math import pi
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, get_args

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array
from ...common.errors import did_you_mean, either, quoted
from ...common.keys import MOST_OUTPUTS, MOST_STEPS
from ...common.validation import Record
from .._core import TimeFunction
from ..fields.field_types import KeptSteps, Name, NotEmpty, NotNegative, Positive, Referring

TIGHTEST_TOLERANCE = 1e-10  # round-off in the forces of stiff links is not far below


class Need(NamedTuple):
    """A `table` that the scene must have at least once, as an analysis has the `value` of `key`."""

    key: str
    value: str
    table: str


class Surroundings(NamedTuple):
    """Position of an analysis among the others of a scene, with all known kinds."""

    earlier: Sequence["Analysis"]
    later: Sequence["Analysis"]
    kinds: Callable[[], Sequence[type["Analysis"]]]

    def replayable(self, way: str | None = None) -> str:
        """Kinds that forward runs can replay with `apply` = `way` (None: any), as text: `"pcid" or "fcid"`."""
        kinds = [kind for kind in self.kinds() if (way in kind.applicable if way else kind.applicable)]
        return either(kind.kind_name() for kind in kinds)


class Analysis(Referring):
    """One analysis of a scene. Class attributes describe its kind."""

    name: Name
    """Name of the analysis, and of its group in the results."""
    kind: str
    """What is computed."""
    tolerance: Annotated[float, Field(ge=TIGHTEST_TOLERANCE, lt=1.0)] = 1e-6
    """Requested error of each result, relative to its peak."""

    follows_trajectories: ClassVar[bool] = True  # whether trajectories must have values at all its `times`
    starts_on_path: ClassVar[bool] = False  # whether it uses the `path` of its context
    is_motion: ClassVar[bool] = True  # whether it finds a motion; others may be about its instants
    is_integrated: ClassVar[bool] = False  # whether this motion comes from an integration over time
    is_algebraic: ClassVar[bool] = False  # whether each output is solved for by itself
    is_resumable: ClassVar[bool] = False  # whether a stopped run can be continued, under the same tolerance
    allocates_patches: ClassVar[bool] = False  # whether patches and actuation points must supply the forces it finds
    supplies_all: ClassVar[bool] = False  # whether motors and patches follow the path within its tolerance, or it warns
    follows_jerk: ClassVar[bool] = False  # whether torques jump where the jerk of a path does
    takes_actuation: ClassVar[bool] = False  # whether it replays the actuation of its `source`
    applicable: ClassVar[tuple[str, ...]] = ()  # values of `apply` by which forward runs can replay what it finds
    findings: ClassVar[tuple[str, ...]] = ()  # ends before the last time that are results, not failures

    @property
    def is_repeated(self) -> bool:
        """Whether it repeats the time steps of another run, which has been checked and judged."""
        return False

    @classmethod
    def kind_name(cls) -> str:
        """The value of `kind` of all analyses of this record."""
        return get_args(cls.model_fields["kind"].annotation)[0]

    @classmethod
    def refuse_key(cls, key: str, others: Sequence[type[Record]]) -> str:
        """The message for a `key` that only the kinds `others` have; empty without any."""
        if not others:
            return ""
        kinds = either(other.kind_name() for other in others if issubclass(other, Analysis))
        return f'expected the key "{key}" only in kind = {kinds}, found kind = "{cls.kind_name()}"'

    @classmethod
    def demand_key(cls, key: str) -> str:
        """The message for a missing key, with the kind."""
        return f'expected the key "{key}" in kind = "{cls.kind_name()}", found none'

    @property
    def times(self) -> Array:
        """Output times (T,), s; by default 0 alone."""
        return np.zeros(1)

    @property
    def last_time(self) -> float:
        """Time (s) at which the run ends, as far as the scene determines it."""
        return float(self.times[-1])

    @property
    def source(self) -> str | None:
        """Name of the earlier analysis whose results this one uses; None where there is none."""
        return None

    @property
    def is_checked(self) -> bool:
        """Whether its results are to be checked by a replay on links with more modes."""
        return getattr(self, "check", None) is not None

    def run(self, context: Any) -> Any:
        """The `Run` of the analysis in a `Context`: the scene's model, earlier runs and what watches."""
        raise NotImplementedError

    def needs(self) -> Iterator[Need]:
        """Yield tables that the scene must have: for an inverse analysis, a trajectory."""
        if self.applicable:
            yield Need("kind", self.kind, "trajectory")

    def prescribed(self) -> Iterator[tuple[str, TimeFunction, int]]:
        """Yield key, function of time that must exist at all `times`, and number of derivatives that must exist."""
        yield from ()

    def problems(self, among: Surroundings) -> Iterator[str]:
        """Yield a message for each contradiction to the other analyses of the scene."""
        yield from ()


Check = Literal["finer"] | None
"""Of an inverse analysis: whether it is replayed on links with twice the modes."""


class TimedAnalysis(Analysis):
    """Outputs at 0, output_step, …, end (s)."""

    end: Positive
    """End time, s; the run begins at 0."""
    output_step: Positive
    """Time between outputs, s; `end` is a whole number of them."""
    settled: Positive = 1e-4
    """Distance from the final position, m, within which a point has settled after the paths end."""

    @model_validator(mode="after")
    def _divides(self) -> Self:
        """Raise `ValueError` unless the outputs 0, step, 2 step, … end exactly at `end`."""
        end, step = self.end, self.output_step
        if not (end and step):
            return self
        ratio = end / step
        if ratio > MOST_OUTPUTS:
            raise ValueError(
                f"expected at most {MOST_OUTPUTS} outputs, found output_step = {step:g} up to end = {end:g}"
            )
        count = round(ratio)
        # 0.1/0.001 is not whole in binary; anything beyond round-off is meant otherwise.
        if count < 1 or abs(ratio - count) > 1e-9 * ratio:
            raise ValueError(
                f"expected an output_step that divides end = {end:g} into equal steps, found {step:g} (such as"
                f" {end / max(1, count):.9g})"
            )
        return self

    @property
    def times(self) -> Array:
        """Output times (T,), s: multiples of `output_step`; `end` exactly."""
        return output_times(self.end, self.output_step)

    @property
    def last_time(self) -> float:
        """End of the paths, s: `end`."""
        return self.end


class IntegratedAnalysis(TimedAnalysis):
    """Base of analyses integrated over time. `integrator`: see `mbs.run.integrators` for "auto"."""

    integrator: Literal["auto", "dopri5", "dop853", "radau", "generalized-alpha"] = "auto"
    """Method of integration; "auto" chooses."""
    spectral_radius: Annotated[float, Field(ge=0.0, le=1.0)] = 0.8
    """Spectral radius of generalized-alpha at infinite frequency: the share of fast vibrations that remains after a
    step."""
    max_steps: Annotated[int, Field(gt=0, le=MOST_STEPS)] = 5_000_000
    """Largest number of steps."""
    keep_steps: bool = False
    """Write the ends of steps to the results, if one explicit integrator makes them all; "auto" then does not switch.
    """
    repeat_steps: KeptSteps | None = None
    """Results file of this analysis with `keep_steps`: the run reuses its time steps, without error control."""

    is_integrated = True

    @property
    def is_repeated(self) -> bool:
        """Whether steps of an earlier run are repeated (`repeat_steps`)."""
        return self.repeat_steps is not None

    @model_validator(mode="after")
    def _integrator_fits(self) -> Self:
        if "spectral_radius" in self.model_fields_set and self.integrator != "generalized-alpha":
            raise ValueError(
                'expected the key "spectral_radius" only with integrator = "generalized-alpha", found integrator ='
                f' "{self.integrator}"'
            )
        return self

    @model_validator(mode="after")
    def _steps_fit(self) -> Self:
        if (steps := self.repeat_steps) is None:
            return self
        if self.integrator not in ("auto", steps.method):
            raise ValueError(
                f'repeat_steps: expected integrator = "{steps.method}", which made the steps in {steps.path}, found'
                f' "{self.integrator}"'
            )
        if self.is_checked:
            raise ValueError('repeat_steps: expected no "check" with it, found one: finer links need their own steps')
        return self


class ActuatedAnalysis(IntegratedAnalysis):
    """Forward simulation under the inputs found by the earlier analysis `actuation`."""

    end: Positive = 0.0
    """End time, s; by default that of `actuation`."""
    output_step: Positive = 0.0
    """Time between outputs, s; by default that of `actuation`."""
    actuation: str | None = None
    """Earlier inverse analysis whose results are applied."""

    takes_actuation = True

    @model_validator(mode="after")
    def _timed(self) -> Self:
        for key in ("end", "output_step"):
            if self.actuation is None and key not in self.model_fields_set:
                raise ValueError(f'expected the key "{key}" in kind = "{self.kind}", found none')
        return self

    @property
    def source(self) -> str | None:
        """Name of the analysis whose actuation is applied."""
        return self.actuation

    def problems(self, among: Surroundings) -> Iterator[str]:
        """Yield a message if `actuation` names no earlier analysis, or one that cannot be replayed."""
        if self.actuation is None:
            return
        sources = {source.name: source for source in among.earlier}
        source = sources.get(self.actuation)
        if source is None:
            comes_later = any(self.actuation == other.name for other in among.later)
            why = ", which does not come before this one" if comes_later else did_you_mean(self.actuation, sources)
            yield f'actuation: expected an earlier analysis, {quoted(sources)}, found "{self.actuation}"{why}'
            return
        if not source.applicable:
            yield (
                f'actuation: expected an analysis of kind {among.replayable()}, found "{source.name}" of kind'
                f' "{source.kind}"'
            )
        elif isinstance(source, IntegratedAnalysis) and source.integrator == "generalized-alpha":
            yield (
                f"actuation: expected an analysis with reproducible steps (any integrator but"
                f' "generalized-alpha"), found "{source.name}" with that'
            )
        elif self.end > source.last_time:
            yield f'end: expected at most {source.last_time!r}, where "{source.name}" ends, found {self.end!r}'
        yield from self.replay_problems(source)

    def replay_problems(self, source: Analysis) -> Iterator[str]:
        """Yield a message for each result of `source` that cannot be applied as requested."""
        yield from ()


def output_times(end: float, step: float, before: float = 0.0, after: float = 0.0) -> Array:
    """Output times (T,), s: multiples of `step` from −`before` to `end` + `after`; `end` exactly."""
    if not (end and step):
        return np.zeros(1)
    early, late, count = (round(x / step) for x in (before, after, end))
    times = np.arange(-early, count + late + 1) * step
    times[early + count] = end
    return times


Share = Annotated[float, Field(gt=0.0, lt=1.0)]


class Robustness(Record):
    """Deviations from the model, each alone, under which the torques and voltages of the result are simulated again.

    The summary has the largest distance of the tip from the computed motion: open loop, and with a sampled PD
    controller of the joints in addition, on quantized encoders and without rate sensors. Encoders of joints with
    compliant gears are on the motors.
    """

    sample_time: Positive = 1e-3
    """Time for which a zero-order hold keeps commands, and between samples of the controller, s."""
    parameters: Annotated[tuple[Share, ...], NotEmpty] = (0.01, 0.05)
    """Relative changes of stiffness and mass of flexible links, with point masses on them, both ways."""
    gears: tuple[Share, ...] = (0.1,)
    """Relative changes of the stiffness of compliant gears, in both directions."""
    force: NotNegative = 0.01
    """Constant force on the tip, along each axis in turn, N."""
    resolution: Positive = 2 * pi / 2**20
    """Increment of the encoders, rad at the joint (prismatic: m)."""
    bandwidth: Positive | None = None
    """Bandwidth of the joint controller, critically damped with rigid links, rad/s; default: half the lowest natural
    frequency of links and compliant gears, less where its samples are too slow for these."""
