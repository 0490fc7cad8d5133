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
from .piecewise import Piecewise, superposed


@dataclass(frozen=True)
class Waypoints:
    """The `columns` of a waypoint table after t, their values (T, columns) and times (T,), s, strictly increasing."""

    columns: tuple[str, ...]
    times: Array
    values: Array

    def spline(self) -> Piecewise:
        """The quintic spline (four continuous derivatives) through the rows, from rest to rest.

        Rows that follow each other with the same values are a hold: the spline comes to rest there, and begins anew
        after it. Velocity and acceleration are zero at holds and at both ends.
        """
        moves = np.any(np.diff(self.values, axis=0), axis=1)
        if not moves.any():
            return Piecewise(self.times[[0, -1]], self.values[None, :1])
        begins = np.flatnonzero(moves & ~np.append(False, moves[:-1]))
        ends = np.flatnonzero(moves & ~np.append(moves[1:], False)) + 1
        parts = [interpolated(self.times[a : b + 1], self.values[a : b + 1]) for a, b in zip(begins, ends, strict=True)]
        rest = Piecewise(parts[0].breaks[:2], self.values[None, :1])
        ways = [Piecewise(part.breaks, _from_zero(part, self.values[a])) for part, a in zip(parts, begins, strict=True)]
        return superposed([rest, *ways])


def load_waypoints(path: Path) -> Waypoints:
    """Read the CSV table at `path`: header `t,x,y` or `t,value` …; at least two rows; t (s) strictly increasing.

    Raises `InputError` naming file and line.
    """
    columns, table = _read_table(path)
    return Waypoints(tuple(columns[1:]), table[:, 0], table[:, 1:])


def _from_zero(part: Piecewise, first: Array) -> Array:
    """Coefficients of a part that begins at zero."""
    coefficients = part.coefficients.copy()
    coefficients[:, -1] -= first
    return coefficients


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


def interpolated(nodes: Array, values: Array, degree: int = 5, at_rest: bool = True) -> Piecewise:
    """The spline of a degree through `values` (T, n) at `nodes` (T,), s.

    With `at_rest` its first two derivatives vanish at both ends.
    """
    # Loaded here: a scene without waypoints does not pay for it.
    from scipy.interpolate import make_interp_spline

    rest = [(m, np.zeros(values.shape[1])) for m in (1, 2)]
    curve = make_interp_spline(nodes, values, k=degree, bc_type=(rest, rest) if at_rest else None)
    breaks = np.unique(curve.t)
    powers = [curve.derivative(m)(breaks[:-1]) / math.factorial(m) for m in range(degree, -1, -1)]
    return Piecewise(breaks, np.array(powers).transpose(1, 0, 2))


def spline(nodes: Array, values: Array, degree: int = 5, at_rest: bool = False) -> list[TimeFunction]:
    """One function of time for each column of `values`: see `interpolated`."""
    curve = interpolated(nodes, values, degree, at_rest)
    each = np.ascontiguousarray(np.moveaxis(curve.coefficients, 2, 0))  # (n, intervals, powers)
    return [TimeFunction.polynomial(curve.breaks, of_one) for of_one in each]
