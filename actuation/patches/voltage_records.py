"""Keys of what stands between a wanted voltage and a patch: its amplifier, its hysteresis. SI units."""

from collections.abc import Iterator
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from ...common.validation import Record
from ...mbs.fields.field_types import NotEmpty, NotNegative, Positive
from ...mbs.model.amplifiers import MOST_PLAYS

Each = Positive | Annotated[tuple[Positive, ...], NotEmpty]
Range = tuple[float, float]


class Amplifier(Record):
    """Amplifier of the patches of a layout, each key with one value for all patches or a list with one for each.

    The largest current limits C dV/dt and the charge of the strain together. `tracking` and `feasibility` take range,
    current and slew rate as limits; forward runs with `limits = true` and closed-loop control cut voltages at them.
    Bandwidth and delay act in both.
    """

    range: Range | Annotated[tuple[Range, ...], NotEmpty] | None = None
    """Smallest and largest voltage, V, such as [-50.0, 200.0]; default: plus and minus `limit`."""
    current: Each | None = None
    """Largest current, A."""
    slew: Each | None = None
    """Largest rate of the voltage, V/s."""
    bandwidth: Each | None = None
    """Bandwidth of first order, Hz."""
    delay: NotNegative | Annotated[tuple[NotNegative, ...], NotEmpty] = 0.0
    """Delay of the voltage, s."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for lowest, highest in np.reshape(() if self.range is None else self.range, (-1, 2)):
            if not lowest < 0.0 < highest:
                raise ValueError(
                    "range: expected a negative and a positive voltage, as patches are at 0 V where the robot rests,"
                    f" found [{lowest:g}, {highest:g}]"
                )
        return self

    def lists(self) -> Iterator[tuple[str, int]]:
        """Keys with a list, and its length."""
        for key in type(self).model_fields:
            if np.ndim(value := getattr(self, key)) == (2 if key == "range" else 1):
                yield key, len(value)

    def for_any(self) -> Self:
        """Return one amplifier with limits that all patches can meet."""
        least = {key: float(np.min(getattr(self, key))) for key, _ in self.lists() if key not in ("range", "delay")}
        lowest = np.reshape(() if self.range is None else self.range, (-1, 2))
        range = (float(lowest[:, 0].max()), float(lowest[:, 1].min())) if len(lowest) else None
        return self.model_copy(update={**least, "range": range, "delay": float(np.max(self.delay))})


class HysteresisKeys(Record):
    """Hysteresis of the patches of a layout in forward runs, closed-loop control and loads: play operators.

    Under a voltage V a patch acts as under Σ w z: z follows V at the distance of a threshold. The other analyses plan
    without it.
    """

    weights: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=MOST_PLAYS)]
    """Weights w."""
    thresholds: tuple[NotNegative, ...]
    """Thresholds, V, ascending from 0."""
    compensate: bool = False
    """Inverse of the hysteresis in front of computed voltages and of controllers."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.thresholds) != len(self.weights):
            raise ValueError(f"expected {len(self.weights)} thresholds, as weights, found {len(self.thresholds)}")
        if self.thresholds[0] != 0.0 or min(np.diff(self.thresholds), default=1.0) <= 0.0:
            raise ValueError(f"thresholds: expected ascending voltages from 0 on, found {list(self.thresholds)}")
        return self
