"""Waypoint tables and splines: functions of time through given values."""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...common.arrays import Array, Booleans, Indices
from ...common.errors import InputError, naming, quoted
from ...common.libraries import scipy
from ...common.tables import LARGEST, shown
from ...common.toml_files import read_csv
from .._core import TimeFunction
from .paths import Piecewise

TIME = re.compile(r"_*(t|time|times?tamp|stamp|sec(?:ond)?s?)[ _.]*[(\[]?(s|sec|ms|us|µs|ns)?[)\]]?", re.IGNORECASE)
"""Names of the column of times, as programs write them, with or without a unit: t, time, time [ms], timestamp_ns."""
NANOSECONDS = re.compile(r"_*(nano|n)secs?(onds?)?", re.IGNORECASE)
"""Names of a column after that of whole seconds, as ROS has them."""
UNITS = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
SINCE_1970 = ((1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (1e8, 1.0))
"""Clocks of computers by their number now: from so many on, and the unit in s that this then is."""
OF_A_JOINT = ("value", "{0}", "{0}.coordinate", "{0}.position", "{0}/position", "position", "positions", "angle")
"""Names of the column of a joint, {0} being the joint's, the first that is there; a topic may stand before it."""
QUATERNION = ("qw", "qx", "qy", "qz")
TURN = 1.0  # rad, of steps next to one of a whole turn, and of that from a whole turn
UNIT = re.compile(r"(.+?)[ _]*(?:\[(\S+)\]|\((\S+)\))")
FACTORS = {
    "rad": 1.0,
    "deg": math.pi / 180,
    "degree": math.pi / 180,
    "degrees": math.pi / 180,
    "°": math.pi / 180,
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
}
"""Units behind the names of columns."""
MANY, GAP = 20, 20.0  # intervals of a table with a usual step; how many times this a gap is
ABRUPT = 3.0  # times the accelerations of a record: what its spline needs next to an end, where it rests
STOPPING, DENSE = 2.0, 9  # likewise next to a hold; times in an interval at which that is looked at
SAMPLES, LOST = 6, 2.5  # the same where at least three of four steps are equal, as those of records are
JUMP, SUDDEN, FAST, UNLIKE = 0.02, 2000.0, 300.0, 30.0  # rad or m, beside the line through the rows next to it
"""A row jumps if it is as far off, by such an acceleration; or by less, if so many times that of nearly all others."""


@dataclass(frozen=True)
class Waypoints:
    """Names of the columns of a table after t, values (T, columns), m, rad or quaternions, increasing times (T,), s.

    `remarks` say how odd entries were understood, a line each.
    """

    columns: tuple[str, ...]
    times: Array
    values: Array
    remarks: tuple[str, ...] = ()

    def of_joint(self, joint: str) -> "Waypoints":
        """The column of a joint as "value"; the whole table if no column has one of its names (`OF_A_JOINT`).

        Raises `ValueError` where two topics have the joint.
        """
        k = column_of(self.columns, joint)
        return self if k is None else replace(self, columns=("value",), values=self.values[:, [k]])

    @cached_property
    def spline(self) -> Piecewise:
        """Quintic spline (four continuous derivatives) through the rows, from rest to rest.

        Successive rows with the same values are a hold. Velocity and acceleration are zero there and at both ends.
        """
        begins, ends = self._ways
        if not len(begins):
            return Piecewise(self.times[[0, -1]], self.values[None, :1])
        parts = [interpolated(self.times[a : b + 1], self.values[a : b + 1]) for a, b in zip(begins, ends, strict=True)]
        rests = np.zeros((len(parts), 1, *parts[0].coefficients.shape[1:]))
        rests[:, 0, -1] = self.values[ends]
        pieces = [piece for part, rest in zip(parts, rests, strict=True) for piece in (part.coefficients, rest)]
        return Piecewise(np.concatenate([part.breaks for part in parts]), np.concatenate(pieces[:-1]))

    @property
    def _ways(self) -> tuple[Indices, Indices]:
        moves = np.any(np.diff(self.values, axis=0), axis=1)
        begins = np.flatnonzero(moves & ~np.append(False, moves[:-1]))
        return begins, np.flatnonzero(moves & ~np.append(moves[1:], False)) + 1

    @property
    def abrupt_hold(self) -> str:
        """Remark on a hold that rows do not approach smoothly, as they turn or have too few digits; else "".

        Accelerations of the spline in the two intervals before and after are compared with those of the rows.
        """
        begins, ends = self._ways
        if len(self.times) < MANY or len(begins) < 2 or (ends - begins).max() < SAMPLES:
            return ""
        of_rows, steps = _accelerations(self.times, self.values).max(axis=0), np.diff(self.times)
        of_rows = np.where(of_rows > 0.0, of_rows, np.inf)
        beside = np.stack([ends[:-1] - 2, ends[:-1] - 1, begins[1:], begins[1:] + 1], axis=1).clip(0, len(steps) - 1)
        times = self.times[beside, None] + np.linspace(0.0, 1.0, DENSE) * steps[beside, None]
        needed = np.abs(self.spline.sample(times.ravel(), 2)) / of_rows
        holds = needed.reshape(len(beside), -1).max(axis=1)
        k = int(np.argmax(holds))
        if holds[k] < STOPPING:
            return ""
        more = f", one of {len(holds)} holds" if len(holds) > 1 else ""
        return (
            f"rows from t = {self.times[ends[k]]:g} to {self.times[begins[k + 1]]:g} s are alike{more}: the path rests"
            f" there, by accelerations {holds[k]:.2g} times those of the rows. Where it does not, leave one of them"
            " out, or smooth the record"
        )


@dataclass(frozen=True)
class Recorded:
    """A table as a program wrote it: times (T,), s, in any order, values (T, columns), m, rad or quaternions.

    `rates` (T, columns), per s, if the program wrote them, too. `place(row)` is where messages say that a row is.
    """

    columns: Sequence[str]
    times: Array
    values: Array
    place: Callable[[int], str]
    remarks: tuple[str, ...] = ()
    rates: Array | None = None
    units: tuple[str, ...] = ()

    def waypoints(self) -> Waypoints:
        """The rows as waypoints with remarks on odd entries; a row that repeats the one before is left out.

        Raises `InputError` for times that do not increase, and fewer than two rows.
        """
        times, values, remarks = self.times, self.values, [*self.remarks]
        rows, again = np.arange(len(times)), np.zeros(len(times), dtype=bool)
        again[1:] = (np.diff(times) == 0) & (np.diff(values, axis=0) == 0).all(axis=1)
        if again.any():
            place = self.place(int(again.argmax()))
            remarks.append(f"{place}: {again.sum()} rows that repeat the one before count once")
        times, values, rows = times[~again], values[~again], rows[~again]
        late = np.flatnonzero(np.diff(times) <= 0.0)
        if late.size:
            before, after = times[late[0]], times[late[0] + 1]
            place = self.place(int(rows[late[0] + 1]))
            raise InputError(f"{place}: expected times that increase", f"t = {after:g} after {before:g}")
        if len(times) < 2:
            raise InputError("expected at least 2 waypoints", len(times))
        remarks += [*_jumps(self.columns, times, values), *_gaps(times, np.any(np.diff(values, axis=0), axis=1))]
        return Waypoints(tuple(self.columns), times, values, (*remarks, *_moving_ends(self.columns, times, values)))


def column_of(columns: Sequence[str], joint: str) -> int | None:
    """The index of a joint's column or None (see `OF_A_JOINT`). Raises `ValueError` if two topics have one."""
    for pattern in OF_A_JOINT:
        name = pattern.format(joint)
        ends = (f"/{name}",) if name != pattern else ()
        meant = [k for k, column in enumerate(columns) if column == name or column.endswith(ends)]
        if len(meant) > 1:
            raise ValueError(f'expected one column of joint "{joint}", found {quoted(columns[k] for k in meant)}')
        if meant:
            return meant[0]
    return None


def load_waypoints(path: Path) -> Waypoints:
    """Read the CSV table at `path` (see `load_record`): at least two rows; t increasing; rows repeated count once.

    Raises `InputError` naming file and line.
    """
    record = load_record(path)
    with naming(path):
        waypoints = record.waypoints()
    return replace(waypoints, remarks=tuple(f"{path.name}: {remark}" for remark in waypoints.remarks))


def load_record(path: Path) -> Recorded:
    """Read the CSV table at `path`: header `t,x,y` or `t,value` …; at least two rows.

    Times are in s, or in the unit that the header says. Those of a computer's clock begin at zero, with a remark.

    Raises `InputError` naming file and line.
    """
    columns, table, lines = _read_table(path)
    times, remarks = _seconds(columns[0], table[:, 0])
    if len(columns) > 2 and NANOSECONDS.fullmatch(columns[1]):
        times = times + 1e-9 * (table[:, 1] - (table[0, 1] if remarks else 0.0))
        columns, table = [columns[0], *columns[2:]], np.delete(table, 1, axis=1)
    names, values, units = columns[1:], table[:, 1:], list[str]()
    for k, name in enumerate(names):
        match = UNIT.fullmatch(name)
        if match and (unit := match[2] or match[3]) in FACTORS:
            names[k], values[:, k] = match[1], FACTORS[unit] * values[:, k]
            units.append(unit)
            if FACTORS[unit] != 1.0:
                remarks.append(f'"{shown(name)}" is converted to {"m" if "m" in unit else "rad"}')
    return Recorded(names, times, values, lambda k: f"line {lines[k]}", tuple(remarks), units=tuple(units))


def _seconds(header: str, times: Array) -> tuple[Array, list[str]]:
    """Times in s, and a remark where they are those of a clock."""
    match = TIME.fullmatch(header)
    unit = None if match is None or match[2] is None else UNITS.get(match[2].lower(), 1.0)
    first = float(times[0]) if len(times) else 0.0
    clock = next((scale for least, scale in SINCE_1970 if first * (unit or 1.0) >= least), None)
    if clock is None:
        return times * (unit or 1.0), []
    scale = unit or clock
    # From the first one before they are scaled: those of a clock have few digits left.
    return (times - first) * scale, [f"times are those of a clock, in {scale:g} s since 1970; the first is taken as 0"]


def _gaps(times: Array, moves: Booleans) -> list[str]:
    """A remark on the longest interval in which the path moves, where it is far longer than is usual."""
    steps = np.diff(times)
    usual = float(np.median(steps))
    is_record = np.mean(np.abs(steps - usual) <= 0.05 * usual) >= 0.75
    least, ratio = (SAMPLES, LOST) if is_record else (MANY, GAP)
    moving = np.where(moves, steps, 0.0)
    k = int(moving.argmax())
    if len(steps) < least or moving[k] <= ratio * usual:
        return []
    return [
        f"no rows between t = {times[k]:g} and {times[k + 1]:g} s, where others are {usual:.3g} s apart: the path there"
        " is the spline's alone"
    ]


def _jumps(columns: Sequence[str], times: Array, values: Array) -> Iterator[str]:
    """A remark on each column with rows that no robot gets to between the rows next to them, and on whole turns."""
    if len(times) < 3:
        return
    accelerations = _accelerations(times, values)
    between = (times[1:-1] - times[:-2]) / (times[2:] - times[:-2])
    off = np.abs(values[1:-1] - values[:-2] - between[:, None] * (values[2:] - values[:-2]))
    steps = np.abs(np.diff(values, axis=0))
    for k, name in enumerate(columns):
        if name in QUATERNION:
            continue
        beside = np.maximum(np.append(0.0, steps[:-1, k]), np.append(steps[1:, k], 0.0))
        turns = (np.abs(steps[:, k] - 2 * np.pi) < TURN) & (beside < TURN) & (len(times) >= MANY)
        if turns.any():
            at = times[int(turns.argmax()) + 1]
            more = f", and at {turns.sum() - 1} more" if turns.sum() > 1 else ""
            yield (
                f"{shown(name)} jumps by a turn at t = {at:g} s{more}: an angle within ±π is counted anew there; add"
                " whole turns from there on"
            )
            continue
        usual = float(np.quantile(accelerations[:, k], 0.9)) if len(times) >= MANY else np.inf
        odd = (accelerations[:, k] > min(SUDDEN, max(FAST, UNLIKE * usual))) & (off[:, k] > JUMP)
        if odd.any():
            most = int(np.where(odd, off[:, k], 0.0).argmax())
            more = f", and at {odd.sum() - 1} more rows" if odd.sum() > 1 else ""
            yield (
                f"{shown(name)} jumps by {off[most, k]:.3g} at t = {times[most + 1]:g} s{more}: do two programs write"
                " this joint? Leave such rows out"
            )


def _moving_ends(columns: Sequence[str], times: Array, values: Array) -> Iterator[str]:
    """Remarks on a column that moves at an end, by a cubic through four rows there: its spline rests there."""
    if len(times) < MANY:
        return
    steps, accelerations = np.diff(times)[:, None], _accelerations(times, values)
    for at, ends, step in ((times[0], slice(0, 4), steps[0, 0]), (times[-1], slice(-4, None), steps[-1, 0])):
        rates = np.abs(np.polyfit((times[ends] - at) / step, values[ends], 3)[-2]) / step
        abrupt = rates / step > ABRUPT * accelerations.max(axis=0)
        if abrupt.any():
            k = int((rates * abrupt).argmax())
            yield (
                f"{shown(columns[k])} moves at t = {at:g} s by {rates[k]:.3g} per s: the path is at rest there, and"
                f" changes to that speed within {step:.3g} s"
            )


def _accelerations(times: Array, values: Array) -> Array:
    """(T − 2, columns) sizes by second differences of rows (T, columns)."""
    return np.abs(difference_quotients(*difference_quotients(times, values))[1])


def difference_quotients(times: Array, values: Array) -> tuple[Array, Array]:
    """Midpoints (T − 1,) of `times` (T,), s, and mean rates (T − 1, n), per s, of `values` (T, n), any unit."""
    return (times[1:] + times[:-1]) / 2, np.diff(values, axis=0) / np.diff(times)[:, None]


def _read_table(path: Path) -> tuple[list[str], Array, Indices]:
    """Column names, numbers (rows, columns) and lines (rows,) of the CSV table at `path`."""
    header, rows = read_csv(path, "waypoint table")
    if len(header) > 2 and not header[0] and TIME.fullmatch(header[1]):  # row numbers, as pandas writes them
        header, rows = header[1:], [(line, row[1:]) for line, row in rows]
    if header and header[0].startswith(("{", "[")):
        raise InputError(f"{path}: expected a table", f"JSON: ffrobot import {path.name} -o path.csv makes one of it")
    if len(header) < 2 or TIME.fullmatch(header[0]) is None or not all(header):
        raise InputError(f"{path}: line 1: expected a header such as t,x,y or t,value", f"{','.join(header)!r}")
    if len(rows) < 2:
        raise InputError(f"{path}: expected at least 2 waypoints", len(rows))
    try:
        table = np.array([row for _, row in rows], dtype=float)
    except ValueError:
        table = np.empty(0)
    if table.shape != (len(rows), len(header)) or not (np.abs(table) <= LARGEST).all():  # named by its line
        table = np.array([numbers_of(path, line, row, len(header)) for line, row in rows])
    return header, table, np.array([line for line, _ in rows])


def numbers_of(path: Path, line: int, row: list[str], count: int) -> list[float]:
    """The `count` numbers of a row of `path`. Raises `InputError` for text, another count, or too large ones."""
    try:
        numbers = [float(cell) for cell in row]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(abs(number) <= LARGEST for number in numbers):  # False of NaN
        text = shown(",".join(row))
        hint = ": decimal commas need semicolons between columns" if text.count(",") == 2 * count - 1 else ""
        raise InputError(f"{path}: line {line}: expected {count} numbers of at most {LARGEST:g}", f"{text!r}{hint}")
    return numbers


def interpolated(nodes: Array, values: Array, degree: int = 5, at_rest: bool = True) -> Piecewise:
    """The spline of a degree through `values` (T, n), of any unit, at `nodes` (T,), s.

    With `at_rest` its first two derivatives vanish at both ends.
    """
    if degree == 1:
        return Piecewise(nodes, np.stack([difference_quotients(nodes, values)[1], values[:-1]], axis=1))
    rest = [(m, np.zeros(values.shape[1])) for m in (1, 2)]
    curve = scipy.interpolate.make_interp_spline(nodes, values, k=degree, bc_type=(rest, rest) if at_rest else None)
    breaks = np.unique(curve.t)
    powers = [curve(breaks[:-1], m) / math.factorial(m) for m in range(degree, -1, -1)]
    return Piecewise(breaks, np.array(powers).transpose(1, 0, 2))


def spline(nodes: Array, values: Array, degree: int = 5, at_rest: bool = False) -> list[TimeFunction]:
    """A function of time for each column of `values` (N, columns), of any unit, at `nodes` (N,), s.

    They are `interpolated`, or constants if N is 1.
    """
    if len(nodes) == 1:
        return [TimeFunction.constant(value) for value in values[0]]
    return interpolated(nodes, values, degree, at_rest).polynomials()
