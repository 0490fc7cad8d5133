"""Keys of closed loops."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from ...common.numbers import MOST_OUTPUTS
from ...mbs._core import TimeFunction
from ...mbs.fields.field_types import NotNegative, PointReference, Positive
from ...mbs.fields.references import Reference, under
from ...mbs.scene.analysis import ActuatedAnalysis, Analysis, Need
from ...mbs.scene.loads import Load
from .records import Controller, Sensor


class SampledAnalysis(ActuatedAnalysis):
    """Keys of closed loops: see `ClosedLoop`."""

    kind: Literal["closed-loop"]
    sample_time: Positive
    """Time between samples, s."""
    delay: NotNegative = 0.0
    """Delay from a sample to its command, s."""
    start: Literal["actuation", "scene"] = "actuation"
    """Initial state: that of `actuation`, or [initial]."""
    feed_forward: Literal["none", "joints", "joints+pzt"] = "joints"
    """Part of `actuation` that is added to the commands: torques, torques and voltages, or nothing."""
    unlimited: bool = False
    """Permission to exceed the limits of the scene."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the sensor noise."""
    tip: PointReference | None = None
    """Point "BODY.POINT" whose position error is computed."""
    controller: tuple[Controller, ...] = ()
    """Controllers; their commands add up."""
    sensor: tuple[Sensor, ...] = ()
    """Sensors in addition to those of the controllers."""
    disturbance: tuple[Load, ...] = ()
    """Loads at points, unknown to `actuation`."""

    findings = ("diverged", "step underflow")  # what a controller does is what is to be found out

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.actuation is None:
            raise ValueError(f'expected the key "actuation" in kind = "{self.kind}", found none')
        if any(load.point is None for load in self.disturbance):
            raise ValueError("expected disturbances at points, found one elsewhere")
        for k, load in enumerate(self.disturbance, 1):
            if load.force is not None:
                raise ValueError(
                    f"disturbance no. {k}: force: expected expressions in t, found a function, which only a [[load]]"
                    " may have"
                )
        end = self.end
        if end and self.delay >= end:
            raise ValueError(f"expected a delay shorter than the run ({end:g} s), found {self.delay:g} s")
        if end and end / self.sample_time > MOST_OUTPUTS:
            raise ValueError(f"expected at most {MOST_OUTPUTS} samples, found sample_time = {self.sample_time:g} s")
        if end and self.sample_time > end:
            raise ValueError(f"expected a sample_time of at most the run ({end:g} s), found {self.sample_time:g} s")
        return self

    def needs(self) -> Iterator[Need]:
        """Patches where voltages are fed forward."""
        if self.feed_forward == "joints+pzt":
            yield Need("feed_forward", self.feed_forward, "pzt")

    def references(self) -> Iterator[Reference]:
        """What is measured, disturbed, controlled and reported."""
        for label, records in (
            ("sensor", self.sensor), ("disturbance", self.disturbance), ("controller", self.controller)
        ):  # fmt: skip
            for k, record in enumerate(records, 1):
                yield from under(f"{label} no. {k}", record.references())
        if self.tip is not None:
            yield Reference("tip", self.tip)

    def prescribed(self) -> Iterator[tuple[str, TimeFunction, int]]:
        """The disturbances."""
        for k, load in enumerate(self.disturbance, 1):
            for component, function in load.components.items():
                yield f"disturbance no. {k}: {component}", function, 0

    def replay_problems(self, source: Analysis) -> Iterator[str]:
        """Whether `source` found what is to be fed forward."""
        if self.feed_forward == "joints+pzt" and source.applicable and self.feed_forward not in source.applicable:
            yield (
                f'feed_forward: expected "joints" with an analysis of kind "{source.kind}", found "{self.feed_forward}"'
            )
