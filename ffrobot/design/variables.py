"""Variables of a search: numbers within bounds and rows of catalogs, and the unit cube of optimizers.

A place u has a coordinate for each variable: that of a number goes from the lower bound (0) to the upper one (1), that
of a catalog is the number of the row, from 0.
"""

import re
import tomllib
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ..actuation.motor_catalog import CatalogMotor, read_catalog
from ..common.errors import InputError
from ..common.keys import MOST_RUNS
from ..common.structs import struct
from ..common.tables import shown
from ..sweep.files import number_at, value_at
from ..sweep.sweep import Key, check_once
from .designs import Point, parse_key

Place = tuple[float, ...]
"""A coordinate for each variable, in the unit cube."""

CATALOGUE = re.compile(r"(?P<keys>.*\S)\s+in\s*\{(?P<rows>.*)\}\s*", re.DOTALL)
MOTOR = re.compile(r"motor\s+(?P<joint>[^,\s]+)\s*(,\s*(?P<mass>\S+))?\s+in\s+(?P<file>[^{].*)")
FORMS = (
    '"KEY=LOW:HIGH", "KEY=LOW:HIGH:log", "KEY in {A, B, C}", "KEY,KEY in {A1:A2, B1:B2}" or "motor JOINT in CATALOG"'
)


@struct
class DesignVariable:
    """A number x between `low` and `high` that all `keys` take, or one of the `rows` with a value for each key.

    A coordinate u is 0 to 1 between the bounds, or the number of a row. `motors`: motors of a catalog in the rows.
    """

    keys: tuple[Key, ...]
    low: float = np.nan
    high: float = np.nan
    logarithmic: bool = False
    rows: tuple[tuple[Any, ...], ...] = ()
    motors: tuple[CatalogMotor, ...] = ()

    @property
    def name(self) -> str:
        """Keys as the user writes them, joined by commas."""
        return ",".join(".".join(key) for key in self.keys)

    @property
    def is_catalogue(self) -> bool:
        """Whether its values are listed."""
        return bool(self.rows)

    @property
    def top(self) -> float:
        """Largest coordinate u of the search: 1 of numbers, the last row's number of catalogs; the smallest is 0."""
        return len(self.rows) - 1.0 if self.rows else 1.0

    def values(self, u: float) -> tuple[Any, ...]:
        """Return the values of all keys at coordinate u."""
        if self.rows:
            return self.rows[round(u)]
        a, b = self.low, self.high
        value = a * (b / a) ** u if self.logarithmic else a + u * (b - a)
        return (float(np.clip(value, a, b)),) * len(self.keys)  # round-off goes past no bound

    def coordinate(self, values: tuple[Any, ...]) -> float | None:
        """Return coordinate u of values of the keys; None if they are out of bounds, differ, or are no row."""
        if self.rows:
            return float(self.rows.index(values)) if values in self.rows else None
        x, (a, b) = values[0], (self.low, self.high)
        if any(value != x for value in values) or not a <= x <= b:
            return None
        return float(np.log(x / a) / np.log(b / a)) if self.logarithmic else (x - a) / (b - a)

    def slope(self, u: float) -> float:
        """Return dx/du, in the unit of the number x, at coordinate u."""
        if self.logarithmic:
            return float(self.values(u)[0] * np.log(self.high / self.low))
        return self.high - self.low

    def step(self, u: float, relative: float) -> float:
        """Return a step of u, the coordinate (0 to 1) of the number x, that changes x by `relative` |x|.

        |x| counts as 0.001 to 1 of the range.
        """
        span = self.high - self.low
        return float(relative * np.clip(abs(self.values(u)[0]), 1e-3 * span, span) / self.slope(u))


@struct
class DesignSpace:
    """All design `variables`; `own`: the scene's values at their keys, in order."""

    variables: tuple[DesignVariable, ...]
    own: Point

    @property
    def keys(self) -> tuple[Key, ...]:
        """Keys of all variables, in order."""
        return tuple(key for variable in self.variables for key in variable.keys)

    @property
    def numbers(self) -> list[int]:
        """Indices of the variables that are numbers between bounds."""
        return [j for j, variable in enumerate(self.variables) if not variable.is_catalogue]

    def point(self, place: Place) -> Point:
        """Return the values of all keys at a place of the unit cube."""
        return tuple(value for v, u in zip(self.variables, place, strict=True) for value in v.values(u))

    def start(self) -> tuple[float | None, ...]:
        """Return the coordinates of the scene's own values; None where they are out of bounds or in no catalog."""
        own = iter(self.own)
        return tuple(variable.coordinate(tuple(islice(own, len(variable.keys)))) for variable in self.variables)

    @property
    def start_place(self) -> Place | None:
        """Place of the scene's own values; None if one is out of bounds or in no catalog."""
        own = [u for u in self.start() if u is not None]
        return tuple(own) if len(own) == len(self.variables) else None


def read_space(path: Path, vary: Sequence[str]) -> DesignSpace:
    """Return the variables that `--vary` names, for the scene file at `path`. Raises `InputError`."""
    variables = tuple(parse_variable(text) for text in vary)
    if not variables:
        raise InputError(f"optimise: expected at least one --vary, {FORMS}")
    check_once([key for variable in variables for key in variable.keys])
    readers = [(value_at if variable.is_catalogue else number_at, variable.keys) for variable in variables]
    return DesignSpace(variables, tuple(read(path, key, "--vary") for read, keys in readers for key in keys))


def parse_variable(text: str) -> DesignVariable:
    """Read a variable: `payload.0.mass=0.1:0.5` or `a.outer,a.inner in {0.05:0.045, 0.06:0.054}`.

    Raises `InputError` for other text.
    """
    if match := MOTOR.fullmatch(text):
        return _motors(match["joint"], match["mass"], Path(match["file"]))
    if match := CATALOGUE.fullmatch(text):
        keys = _keys(match["keys"])
        return DesignVariable(keys, rows=_rows(match["rows"], len(keys), text))
    name, equals, bounds = text.partition("=")
    pieces, found = bounds.split(":"), f'"{shown(text)}"'
    try:
        low, high = map(float, pieces[:2])
    except ValueError:
        low = high = np.nan
    logarithmic = len(pieces) == 3 and pieces[2].strip() == "log"
    if not equals or not (len(pieces) == 2 or logarithmic) or not np.isfinite([low, high]).all():
        raise InputError(f"--vary: expected {FORMS}", found)
    if not low < high:
        raise InputError("--vary: expected a lower bound and a higher one, LOW:HIGH", found)
    if logarithmic and low <= 0.0:
        raise InputError("--vary: expected bounds above 0 for steps in the logarithm", found)
    return DesignVariable(_keys(name), low, high, logarithmic)


def _motors(joint: str, mass: str | None, catalog: Path) -> DesignVariable:
    """Motors for a joint, each with each of its gears: inertia and limits, at the joint, as keys of the scene.

    The torque limit is the motor's peak less losses of a driving gear. `mass`: key that takes the motor's mass.
    """
    keys = tuple(("joint", joint, key) for key in ("gear_ratio", "rotor_inertia", "moment_limit", "speed_limit"))
    rows: dict[tuple[Any, ...], CatalogMotor] = {}
    for motor in read_catalog(catalog):
        if mass is not None and motor.mass is None:
            raise InputError(f'{catalog}: expected a mass of motor "{motor.name}", for {mass}', "none")
        for N in motor.gear_ratio:
            limits = N * motor.peak_torque * motor.efficiency, motor.max_speed / N
            row = (N, motor.rotor_inertia, *limits, motor.mass)[: 5 if mass else 4]
            if row in rows:
                raise InputError(
                    f"{catalog}: expected motors that differ in inertia, peak torque or speed",
                    f'"{rows[row].name}" and "{motor.name}"',
                )
            rows[row] = motor
    more = (parse_key(mass, "--vary"),) if mass else ()
    return DesignVariable((*keys, *more), rows=tuple(rows), motors=tuple(rows.values()))


def _keys(text: str) -> tuple[Key, ...]:
    return tuple(parse_key(part, "--vary") for part in text.split(","))


def _rows(text: str, columns: int, whole: str) -> tuple[tuple[Any, ...], ...]:
    """The rows of a catalog; columns are parted by colons."""
    listed = text if columns == 1 else ", ".join(f"[{row.replace(':', ',')}]" for row in text.split(","))
    try:
        values = tomllib.loads(f"values = [{listed}]")["values"]
    except (ValueError, RecursionError):
        values = []
    rows = [(value,) if columns == 1 else tuple(value) for value in values]
    nested = any(isinstance(value, list | dict) for row in rows for value in row)
    if nested or not 0 < len(rows) <= MOST_RUNS or any(len(row) != columns for row in rows):
        raise InputError(
            f"--vary: expected rows of {columns} value{'s' if columns > 1 else ''} (texts in quotes, columns with"
            f" colons), {FORMS}",
            f'"{shown(whole)}"',
        )
    return tuple(dict.fromkeys(rows))
