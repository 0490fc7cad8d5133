"""Sensors of a scene file, key by key. SI units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from pydantic import model_validator

from ...common.errors import quoted
from ...mbs.fields.field_types import NotNegative, PointReference, Positive, Reference, Referring, one_of


class Sensor(Referring):
    """A sensor of a joint coordinate, of a point, of the strain at a point, or of patch voltages.

    Accelerations are in global axes; "accelerometer" is r̈ − g and "gyro" the angular velocity, in the axes of the
    section. Patches read the charge Φ_Vᵀ p over `capacitance`; none with a `shunt`.

    A reading is filtered by `high_pass`, gets `bias` and Gaussian noise, is cut at ±`range` and rounded to
    `resolution`, kept for `sample_time`, and known `delay` later.
    """

    joint: str | None = None
    """Measured joint coordinate, rad (prismatic: m)."""
    motor: str | None = None
    """Joint with stiffness: measured motor angle after the gear, rad."""
    point: PointReference | None = None
    """Point "BODY.POINT" with measured x, y (in 3D z), m, global axes."""
    pzt: str | None = None
    """Layout of patches with measured voltages, V: its name, or that of its body."""
    modal: str | None = None
    """Body with directly read modal coordinates (m·√kg); no real sensor can."""
    strain: PointReference | None = None
    """Point "BODY.POINT" among the `stress` points of a link, with measured strain along the link."""
    measure: Literal["value", "rate", "acceleration", "accelerometer", "gyro"] = "value"
    """Measured quantity: value or rate; of points also acceleration, accelerometer (m/s²) or gyro (rad/s)."""
    resolution: NotNegative = 0.0
    """Resolution: readings are multiples of it, in their unit; 0: continuous."""
    noise: NotNegative = 0.0
    """Standard deviation of Gaussian noise, in the unit of the reading."""
    noise_density: NotNegative = 0.0
    """Density of white noise, unit of the reading per √Hz (one-sided), up to half the sampling frequency."""
    bias: float = 0.0
    """Constant error of the reading, in its unit."""
    range: Positive | None = None
    """Largest reading of either sign, in its unit."""
    high_pass: Positive | None = None
    """Corner frequency of a first-order high-pass filter, as of charge amplifiers, Hz."""
    delay: NotNegative = 0.0
    """Age of readings, a multiple of the sample time of the loop, s."""
    sample_time: Positive | None = None
    """Time between readings, a multiple of the sample time of the loop, s; by default that."""
    capacitance: Positive | None = None
    """Capacitance of each patch, F; by default computed."""

    refers_to = (
        ("point", "body"), ("modal", "body"), ("modal", "flexible body"), ("pzt", "patches"), ("joint", "joint"),
        ("motor", "elastic joint"),
    )  # fmt: skip

    @model_validator(mode="after")
    def _consistent(self) -> Sensor:
        subject = one_of(self, ("joint", "motor", "point", "pzt", "modal", "strain"))
        every = ("value", "rate", "acceleration", "accelerometer", "gyro")
        known = {"pzt": every[:1], "strain": every[:1], "point": every}.get(subject, every[:2])
        if self.measure not in known:
            raise ValueError(f'expected one of {quoted(known)} as measure with "{subject}", found "{self.measure}"')
        if self.capacitance is not None and subject != "pzt":
            raise ValueError(f'expected the key "capacitance" only with "pzt", found it with "{subject}"')
        return self

    def deviation(self, T: float) -> float:
        """Standard deviation of the noise of readings every T (s), in their unit."""
        return float(np.hypot(self.noise, self.noise_density / np.sqrt(2 * T)))

    def references(self) -> Iterator[Reference]:
        """Yield references to what is measured; points of strain belong to the link file."""
        yield from super().references()
        if self.strain is not None:
            link = self.strain.partition(".")[0]
            yield from (Reference("strain", link), Reference("strain", link, "flexible body"))


def check_sampling(sensors: Sequence[Sensor], T: float, whose: str, *, at_every_sample: bool) -> None:
    """Raise `ValueError` for delays and sample times that are no multiples of T (s), or longer if `at_every_sample`."""
    for k, sensor in enumerate(sensors, 1):
        for key in ("delay", "sample_time"):
            samples = (getattr(sensor, key) or 0.0) / T
            if abs(samples - round(samples)) > 1e-6 or (key == "sample_time" and 0.0 < samples < 0.5):
                raise ValueError(
                    f"expected a multiple of {whose} ({T:g} s) as {key} of sensor no. {k}, found"
                    f" {getattr(sensor, key):g} s"
                )
            if round(samples) > 1 and key == "sample_time" and at_every_sample:
                raise ValueError(f"expected sensors that read at every sample, found no. {k} slower")
