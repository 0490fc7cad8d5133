"""Motors of a catalog that can do what a joint has to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.keys import NotNegative, Positive
from ..common.peaks import root_mean_square
from ..common.toml_files import load_toml, read_csv
from ..common.validation import Record, validate


class CatalogMotor(Record):
    """A motor with the gears that it is sold with; all values at the motor, before the gear."""

    name: str
    """Its name."""
    rated_torque: Positive
    """Torque that it can give for ever, N·m (N of linear motors): what the RMS may be."""
    peak_torque: Positive
    """Torque that it can give for a moment, N·m (N)."""
    max_speed: Positive
    """Speed, rad/s (m/s)."""
    rotor_inertia: NotNegative = 0.0
    """Of the rotor with what turns with it, kg·m² (kg)."""
    gear_ratio: tuple[Positive, ...] = (1.0,)
    """Ratios of the gears to choose from: turns of the motor for one of the joint."""
    efficiency: float = Field(default=1.0, gt=0.0, le=1.0)
    """Of the gear."""
    mass: Positive | None = None
    """Of motor and gear, kg: lighter ones are listed first."""
    cost: Positive | None = None
    """Of motor and gear, in any currency."""


class _Catalog(Record):
    motor: tuple[CatalogMotor, ...] = Field(min_length=1)


class JointTask(NamedTuple):
    """Task of a joint: `time` (T,), s; `load` (T,), N·m or N, without any rotor; rate and acceleration."""

    time: Array
    load: Array
    rate: Array
    acceleration: Array


class MotorChoice(NamedTuple):
    """A motor with one of its gears on a joint: shares of its torques and speed that the task takes (1 is all).

    `rms`, `peak`, `speed` are of the motor, in its units.
    """

    motor: CatalogMotor
    ratio: float
    rms: float
    peak: float
    speed: float

    @property
    def shares(self) -> tuple[float, float, float]:
        """Shares of rated torque, peak torque and speed."""
        motor = self.motor
        return self.rms / motor.rated_torque, self.peak / motor.peak_torque, self.speed / motor.max_speed

    @property
    def fits(self) -> bool:
        """Whether the motor can do it."""
        return max(self.shares) <= 1.0


def read_catalog(path: Path) -> tuple[CatalogMotor, ...]:
    """Read motors from a TOML file with [[motor]] tables, or a CSV file with their keys as columns.

    Several gear ratios of a CSV line are separated by spaces; see `read_csv`. Raises `InputError` for wrong keys or
    numbers.
    """
    if path.suffix.lower() == ".toml":
        return validate(_Catalog, load_toml(path, "catalog of motors"), path).motor
    header, rows = read_csv(path, "catalog of motors")
    if not rows:
        raise InputError(f"{path}: expected a line of columns (name, rated_torque, …) and motors below", "none")
    for number, row in rows:
        if len(row) != len(header):
            raise InputError(
                f"{path}: line {number}: expected {len(header)} cells with commas, semicolons or tabs between them, as"
                " the header has",
                len(row),
            )
    return validate(_Catalog, {"motor": [_of_line(dict(zip(header, row, strict=True))) for _, row in rows]}, path).motor


def _of_line(line: dict[str, str]) -> dict[str, Any]:
    given: dict[str, Any] = {key: text for key, text in line.items() if text}
    if "gear_ratio" in given:
        given["gear_ratio"] = tuple(given["gear_ratio"].split())
    return {key: text if key == "name" else _numbers(text) for key, text in given.items()}


def _numbers(text: Any) -> Any:
    try:
        return tuple(map(float, text)) if isinstance(text, tuple) else float(text)
    except ValueError:
        return text


def choices(task: JointTask, catalog: Sequence[CatalogMotor]) -> list[MotorChoice]:
    """Return every motor with each of its gears: fitting ones first, ordered by mass (or size)."""
    rated = [choice_of(task, motor, N) for motor in catalog for N in motor.gear_ratio]
    return sorted(rated, key=lambda one: (not one.fits, _size(one.motor) if one.fits else max(one.shares)))


def _size(motor: CatalogMotor) -> tuple[float, ...]:
    return (np.inf if motor.mass is None else motor.mass, motor.rated_torque, motor.peak_torque)


def choice_of(task: JointTask, motor: CatalogMotor, N: float) -> MotorChoice:
    """Judge a motor with gear ratio N: τ = J N α + L/(N η) if load L takes power, J N α + η L/N if it returns it."""
    is_driven = task.load * task.rate >= 0.0
    through = np.where(is_driven, 1.0 / motor.efficiency, motor.efficiency)
    torque = motor.rotor_inertia * N * task.acceleration + task.load * through / N
    speed = float(np.abs(N * task.rate).max())
    return MotorChoice(motor, N, root_mean_square(task.time, torque), float(np.abs(torque).max()), speed)
