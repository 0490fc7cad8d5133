"""Motors of a catalog that suffice for the task of a joint. SI units."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.keys import NotNegative, Positive
from ..common.peaks import root_mean_square
from ..common.toml_files import load_toml, read_labelled_csv
from ..common.validation import Record, validate


class CatalogMotor(Record):
    """A motor of a catalog with its gears; all values are at the motor, before the gear."""

    name: str
    """Name of the motor."""
    rated_torque: Positive
    """Largest continuous torque, N·m (N of linear motors): limit of the RMS."""
    peak_torque: Positive
    """Largest torque for a short time, N·m (N)."""
    max_speed: Positive
    """Largest speed, rad/s (m/s)."""
    rotor_inertia: NotNegative = 0.0
    """Inertia of the rotor with all that turns with it, kg·m² (kg)."""
    gear_ratio: tuple[Positive, ...] = (1.0,)
    """Ratios of the gears to choose from: turns of the motor for one of the joint."""
    efficiency: float = Field(default=1.0, gt=0.0, le=1.0)
    """Efficiency of the gear."""
    mass: Positive | None = None
    """Mass of motor and gear, kg: lighter ones are listed first."""
    cost: Positive | None = None
    """Cost of motor and gear, in any currency."""


class _Catalog(Record):
    motor: tuple[CatalogMotor, ...] = Field(min_length=1)


class JointTask(NamedTuple):
    """Task of a joint over `time`, s: `load` without rotor, N·m or N, rate and acceleration, SI; all (T,)."""

    time: Array
    load: Array
    rate: Array
    acceleration: Array


class MotorChoice(NamedTuple):
    """A motor with one gear `ratio` on a joint: RMS and peak of its torque (N·m or N), peak speed (rad/s or m/s)."""

    motor: CatalogMotor
    ratio: float
    rms: float
    peak: float
    speed: float

    @property
    def shares(self) -> tuple[float, float, float]:
        """Shares of rated torque, peak torque and speed that the task takes; 1 is all."""
        motor = self.motor
        return self.rms / motor.rated_torque, self.peak / motor.peak_torque, self.speed / motor.max_speed

    @property
    def fits(self) -> bool:
        """Whether the motor suffices for the task."""
        return max(self.shares) <= 1.0


def read_catalog(path: Path) -> tuple[CatalogMotor, ...]:
    """Read motors from a TOML file with [[motor]] tables, or a CSV file with their keys as columns.

    Several gear ratios of a CSV line are separated by spaces; see `read_csv`. Raises `InputError` for wrong keys or
    numbers.
    """
    if path.suffix.lower() == ".toml":
        return validate(_Catalog, load_toml(path, "catalog of motors"), path).motor
    _, rows = read_labelled_csv(path, "catalog of motors")
    if not rows:
        raise InputError(f"{path}: expected a line of columns (name, rated_torque, …) and motors below", "none")
    motors = []
    for _, row in rows:
        given: dict[str, Any] = {key: text for key, text in row.items() if text}
        if "gear_ratio" in given:
            given["gear_ratio"] = tuple(given["gear_ratio"].split())
        motors.append({key: text if key == "name" else _numbers(text) for key, text in given.items()})
    return validate(_Catalog, {"motor": motors}, path).motor


def _numbers(text: Any) -> Any:
    try:
        return tuple(map(float, text)) if isinstance(text, tuple) else float(text)
    except ValueError:
        return text


def choices(task: JointTask, catalog: Sequence[CatalogMotor]) -> list[MotorChoice]:
    """Return every motor with each of its gears: fitting ones first, ordered by mass, then by rated torque."""

    def order(one: MotorChoice) -> tuple[float, ...]:
        motor, mass = one.motor, np.inf if one.motor.mass is None else one.motor.mass
        return (0.0, mass, motor.rated_torque, motor.peak_torque) if one.fits else (1.0, max(one.shares))

    return sorted((choice_of(task, motor, N) for motor in catalog for N in motor.gear_ratio), key=order)


def choice_of(task: JointTask, motor: CatalogMotor, N: float) -> MotorChoice:
    """Judge a motor with gear ratio N by its torque J N α + L/(N η) while the load L takes power, J N α + η L/N else.

    J is the inertia of the rotor, α the acceleration of the joint, η the efficiency of the gear.
    """
    is_driven = task.load * task.rate >= 0.0
    through = np.where(is_driven, 1.0 / motor.efficiency, motor.efficiency)
    torque = motor.rotor_inertia * N * task.acceleration + task.load * through / N
    speed = float(np.abs(N * task.rate).max())
    return MotorChoice(motor, N, root_mean_square(task.time, torque), float(np.abs(torque).max()), speed)
