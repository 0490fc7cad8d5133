"""Observers of closed loops in a scene file, key by key. SI units."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ...common.errors import quoted
from ...common.validation import InputFile, Record
from ...mbs.fields.field_types import ModeCount, NotEmpty, NotNegative, Positive, Reference

Matrix = tuple[tuple[float, ...], ...]


class ObserverRecord(Record):
    """Base of all observers."""

    settle: Annotated[int, Field(ge=0, le=1_000_000)] = 0
    """Samples for which observer and controllers see the first readings before the run; 0: start on the reference."""
    about: Literal["reference", "zero"] = "reference"
    """Origin of commands, readings and estimates: what they are on the reference, or zero."""


class FilterRecord(Record):
    """Keys of the model of Kalman filters.

    They estimate coordinates and rates of joints, motors and the lowest `modes` of links, and constant loads on
    request. `process` and `disturbance` name inputs of the linear model: "joint/NAME", "pzt/LAYOUT/k" or
    "force/BODY.POINT/x".
    """

    modes: ModeCount = 2
    """Number of the lowest modes per link in the model."""
    process: dict[str, Positive] = Field(min_length=1)
    """Standard deviation, by input, of white noise that is constant over a sample; N·m, V or N."""
    disturbance: dict[str, Positive] = Field(default_factory=dict)
    """Constant loads to be estimated, by input, with their drift; N·m, V or N per √s."""

    @property
    def points(self) -> dict[str, str]:
        """Points "BODY.POINT" at which forces are inputs, each by its own name."""
        return {reference.name: reference.name for reference in FilterRecord.references(self)}

    def references(self) -> Iterator[Reference]:
        """Yield references to points at which forces are inputs."""
        for key in ("process", "disturbance"):
            for name in getattr(self, key):
                kind, _, rest = name.partition("/")
                point = rest.rpartition("/")[0]
                if kind == "force" and "." in point:
                    yield Reference(key, point)


class KalmanRecord(ObserverRecord, FilterRecord):
    """Keys of Kalman filters of a loop."""

    reject: bool = False
    """Permission for motors and patches to act against estimated disturbances of theirs."""


class KalmanObserver(KalmanRecord):
    """Steady-state Kalman filter of the sampled linear model about the reference at `time`."""

    kind: Literal["kalman"]
    time: NotNegative = 0.0
    """Instant of the reference about which the model is linear, s."""


class ScheduledObserver(KalmanRecord):
    """Kalman filters at `count` instants of the path; between them all matrices are straight lines.

    Each is checked to be stable, half way between as well.
    """

    kind: Literal["scheduled"]
    count: Annotated[int, Field(ge=2, le=1000)] = 5
    """Number of instants, from start to end of the reference."""


class GainsObserver(ObserverRecord):
    """x̂⁺ = A x̂ + B u + gain (y − C x̂) with given numbers, for the controller "state-feedback".

    States are "state/1", …; y is in units of the readings times `scale`.
    """

    kind: Literal["gains"]
    inputs: tuple[str, ...]
    """Commands u, as `control/` in the results names them."""
    outputs: Annotated[tuple[str, ...], NotEmpty]
    """Readings y, as `control/` in the results names them."""
    A: Matrix | None = None
    """(states, states), from sample to sample."""
    B: Matrix | None = None
    """(states, inputs)."""
    C: Matrix | None = None
    """(outputs, states)."""
    gain: Matrix | None = None
    """(states, outputs)."""
    file: InputFile | None = None
    """File .npz or .mat with A, B, C and gain."""
    scale: tuple[float, ...] | None = None
    """Factor of each reading, such as 1000 for y in mm; by default 1."""

    @model_validator(mode="after")
    def _complete(self) -> Self:
        missing = [name for name in ("A", "B", "C", "gain") if getattr(self, name) is None]
        if (self.file is None) == bool(missing):
            found = "both" if not missing else f"neither ({quoted(missing)} missing)"
            raise ValueError(f"expected A, B, C and gain, or a file with them, found {found}")
        return self

    @property
    def matrices(self) -> tuple[Any, Any, Any, Any]:
        """A, B, C and gain. Raises `InputError` where the file does not have them."""
        if self.file is None:
            return self.A, self.B, self.C, self.gain
        from .linear_model import read_arrays

        A, B, C, gain = read_arrays(self.file, ("A", "B", "C", "gain"))
        return A, B, C, gain


Observer = Annotated[KalmanObserver | ScheduledObserver | GainsObserver, Field(discriminator="kind")]
