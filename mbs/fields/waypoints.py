"""Waypoint tables and splines: functions of time through given values."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.tables import LARGEST, shown
from .._core import TimeFunction


@dataclass(frozen=True)
class Waypoints:
    """Splines through the columns of a waypoint table, defined from `start` to `end` (s)."""

    start: float
    end: float
    components: dict[str, TimeFunction]


def load_waypoints(path: Path) -> Waypoints:
    """Read the CSV table at `path` (header `t,x,y` or `t,value` …) as one function per column after t.

    Each column is interpolated by the quintic spline (four continuous derivatives) that starts and ends at rest: zero
    velocity and acceleration at both ends. At least two rows; t (s) strictly increasing.

    Raises `InputError` naming file and line.
    """
    # Loaded here: a scene without waypoints does not pay for it.
    from scipy.interpolate import PPoly, make_interp_spline

    columns, table = _read_table(path)
    at_rest = [(1, 0.0), (2, 0.0)]
    components = {}
    for name, values in zip(columns[1:], table[:, 1:].T, strict=True):
        spline = PPoly.from_spline(make_interp_spline(table[:, 0], values, k=5, bc_type=(at_rest, at_rest)))
        proper = np.diff(spline.x) > 0.0  # the end knots are repeated
        breaks = np.append(spline.x[:-1][proper], spline.x[-1])
        components[name] = TimeFunction.polynomial(breaks, np.ascontiguousarray(spline.c[:, proper].T))
    return Waypoints(float(table[0, 0]), float(table[-1, 0]), components)


def _read_table(path: Path) -> tuple[list[str], Array]:
    """Column names and the numbers (rows, columns) of the CSV table at `path`."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file, skipinitialspace=True)
            rows = [(reader.line_num, row) for row in reader if any(row)]
    except FileNotFoundError:
        raise InputError(f"{path}: waypoint table not found") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        about = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot read the waypoint table: {about}") from None
    header = [name.strip() for name in rows[0][1]] if rows else []
    if len(header) < 2 or header[0] != "t" or not all(header) or len(set(header)) < len(header):
        raise InputError(f"{path}: line 1: expected a header such as t,x,y or t,value, found {','.join(header)!r}")
    table = np.array([_numbers(path, line, row, len(header)) for line, row in rows[1:]])
    if len(rows) < 3:
        raise InputError(f"{path}: expected at least 2 waypoints, found {len(rows) - 1}")
    late = np.flatnonzero(np.diff(table[:, 0]) <= 0.0)
    if late.size:
        before, after = table[late[0], 0], table[late[0] + 1, 0]
        line = rows[late[0] + 2][0]
        raise InputError(f"{path}: line {line}: expected times that increase, found t = {after:g} after {before:g}")
    return header, table


def _numbers(path: Path, line: int, row: list[str], count: int) -> list[float]:
    try:
        numbers = [float(cell) for cell in row]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(abs(number) <= LARGEST for number in numbers):  # False of NaN
        found = shown(",".join(row))
        raise InputError(f"{path}: line {line}: expected {count} numbers of at most {LARGEST:g}, found {found!r}")
    return numbers


def spline(nodes: Array, values: Array, degree: int = 5, at_rest: bool = False) -> list[TimeFunction]:
    """The n interpolating splines of a degree through the columns of `values` (T, n) at `nodes` (T,), in s.

    With `at_rest` their first two derivatives vanish at both ends.
    """
    from scipy.interpolate import make_interp_spline

    rest = [(m, np.zeros(values.shape[1])) for m in (1, 2)]
    curve = make_interp_spline(nodes, values, k=degree, bc_type=(rest, rest) if at_rest else None)
    breaks = np.unique(curve.t)
    powers = [curve.derivative(m)(breaks[:-1]) / math.factorial(m) for m in range(degree, -1, -1)]
    coefficients = np.ascontiguousarray(np.array(powers).transpose(2, 1, 0))  # (n, intervals, powers)
    return [TimeFunction.polynomial(breaks, of_one) for of_one in coefficients]
