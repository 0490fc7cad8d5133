"""Placements of patches in a scene file, key by key. SI units."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ...common.validation import Record
from ...mbs.fields.field_types import ModeCount, Name, PatchCount, PointReference, Positive, Reference, under
from .observer_records import FilterRecord
from .sensor_records import Sensor, check_sampling


class EstimateRecord(FilterRecord):
    """The Kalman filter whose estimate of the tip placed patches serve, as sensors."""

    sample_time: Positive
    """Time between readings, s."""
    noise: Positive
    """Standard deviation of the noise of each patch, V."""
    sensor: tuple[Sensor, ...] = ()
    """Other sensors, such as encoders, with their noise."""
    tip: PointReference | None = None
    """Point "BODY.POINT" to be estimated; by default the tip of the robot."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_sampling(self.sensor, self.sample_time, "sample_time", at_every_sample=True)
        return self

    def references(self) -> Iterator[Reference]:
        """Yield references to what is measured, pushed and estimated."""
        for k, sensor in enumerate(self.sensor, 1):
            yield from under(f"sensor no. {k}", sensor.references())
        yield from super().references()
        if self.tip is not None:
            yield Reference("tip", self.tip)


class Placement(Record):
    """Optimal positions of the `count` patches of a [[pzt]] on its link.

    Modes are the lowest of the robot with locked motors; with criterion "voltage", those of the link, whose forces in
    the inverse analysis `about` count. With "estimate" patches are sensors.
    """

    body: str
    """Link with patches."""
    pzt: Name | None = None
    """Layout of the patches; required if a link has several layouts."""
    count: PatchCount | None = None
    """Number of patches; by default that of its [[pzt]]."""
    criterion: Literal["controllability", "voltage", "estimate"] = "controllability"
    """Controllability of the robot's lowest modes, the largest voltage over its limit along the path, or the deviation
    of the estimated tip (the root of the trace of its covariance).
    """
    estimate: EstimateRecord | None = None
    """Filter of criterion "estimate"."""
    measure: Literal["worst", "mean", "product"] = "worst"
    """Controllability measure: that of the worst mode, their mean, or their product."""
    modes: ModeCount | None = None
    """Number of the lowest modes that count."""
    spacing: Positive | None = None
    """Distance between tried centers, m; by default half the length of a patch."""
    most_sets: Annotated[int, Field(gt=0, le=10_000_000)] = 100_000
    """Largest number of sets for an exhaustive search; beyond it, differential evolution searches."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if (self.criterion == "estimate") != (self.estimate is not None):
            found = "none" if self.estimate is None else f'it with "{self.criterion}"'
            raise ValueError(f'expected the table "estimate" with criterion = "estimate" only, found {found}')
        return self

    def references(self) -> Iterator[Reference]:
        """Yield references to the link and its patches."""
        yield Reference("placement.body", self.body)
        yield Reference("placement.body", self.body, "patched body")
        if self.pzt is not None:
            yield Reference("placement.pzt", self.pzt, "patches")
        if self.estimate is not None:
            yield from under("placement.estimate", self.estimate.references())
