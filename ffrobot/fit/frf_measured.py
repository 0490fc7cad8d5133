"""Measured frequency response functions (FRFs) of a robot in poses, in SI units and global axes.

Sources: a TOML file of tests, universal files (dataset 58), CSV tables, .mat files.
"""

import io
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from ..common.arrays import Array, Booleans, ComplexArray
from ..common.errors import InputError, check_known, either, naming, quoted
from ..common.libraries import extras, scipy
from ..common.rotations import of_rpy
from ..common.structs import struct
from ..common.tables import shown
from ..common.toml_files import load_toml, read_bytes, read_labelled_csv
from ..common.validation import InputFile, Record, validate
from ..mbs.fields.field_types import NotNegative, PointReference, Positive
from ..mbs.joints.joint import Angles

ENDS = ("force", "response")
COLUMNS = ("frequency", "force", "response", "real", "imaginary", "coherence")
FORCE, ORDERS = 13, {8: 0, 11: 1, 12: 2}  # data types of UFF 58: what is measured per force
LABELS = {0: ("m",), 1: ("m/s",), 2: ("m/s^2", "m/s2", "m/s²", "m/s**2")}  # of its units, where they are SI


class Column(NamedTuple):
    """An FRF of a file: `values` (F,), in its unit, at `frequency` (F,), Hz; points and directions as "POINT/-x"."""

    force: str
    response: str
    frequency: Array
    values: ComplexArray
    coherence: Array | None
    order: int | None = None  # of the time derivative, see `UNITS`
    is_si: bool = False  # whether label and dataset 164, if any, are SI's


def read_columns(path: Path) -> list[Column]:
    """Read all FRFs of a file. Raises `InputError` for a file of another kind, and for one without FRFs."""
    readers = {".uff": _universal, ".unv": _universal, ".58": _universal, ".csv": _of_csv, ".mat": _of_mat}
    suffix = path.suffix.lower()
    with naming(path):
        if suffix not in readers:
            raise InputError(f"expected a file with {quoted(readers)}", f'"{path.name}"')
        columns = list(readers[suffix](path))
        if not columns:
            raise InputError("expected frequency response functions (type 4 of dataset 58)", "none")
    return columns


def _universal(path: Path) -> Iterator[Column]:
    """FRFs of datasets 58 with the coherence of the same ends; other functions are left out."""
    with extras():
        import pyuff
    read_bytes(path, "universal file")
    try:
        file = pyuff.UFF(str(path))
        kinds = np.array(file.get_set_types())
        sets, units = ([file.read_sets(k) for k in np.flatnonzero(kinds == kind).tolist()] for kind in (58, 164))
        is_of_si = all(one["length"] == one["force"] == 1.0 for one in units)
        for one in sets:
            one["data"].real, one["x"], one["func_type"]
    except Exception:  # whatever pyuff finds in a file that is none
        raise InputError("expected datasets 58 of a universal file", "damaged ones") from None
    ends = [(one["ref_node"], one["ref_dir"], one["rsp_node"], one["rsp_dir"]) for one in sets]
    coherence = {at: one["data"].real for at, one in zip(ends, sets, strict=True) if one["func_type"] == 6}
    for at, one in zip(ends, sets, strict=True):
        if one["func_type"] != 4:  # an FRF
            continue
        kind, by = one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]
        if kind not in ORDERS or by != FORCE:
            raise InputError(
                f"node {at[2]}: expected displacement, velocity or acceleration (data types 8, 11, 12) per force (13)",
                f"types {kind} and {by}",
            )
        force, response = (f"{node:.0f}/{_axis(axis)}" for node, axis in (at[:2], at[2:]))
        labels = {str(one[f"{of}_axis_units_lab"]).strip().lower() for of in ("ordinate", "orddenom")}
        is_si = is_of_si and labels <= {"", "none", "n", *LABELS[ORDERS[kind]]}
        frequency, values = np.asarray(one["x"], float), one["data"].astype(complex)
        yield Column(force, response, frequency, values, coherence.get(at), order=ORDERS[kind], is_si=is_si)


def _axis(code: float) -> str:
    if abs(code) not in (1, 2, 3):
        raise InputError("expected translations along x, y, z (directions ±1, ±2, ±3)", f"{code:g}")
    return "-" * (code < 0) + "xyz"[int(abs(code)) - 1]


def _of_csv(path: Path) -> Iterator[Column]:
    """FRFs of a table with a line for each frequency of each function."""
    header, table = read_labelled_csv(path, "table of FRFs")
    for name in header:
        check_known(name, COLUMNS, f"line 1: expected columns among {quoted(COLUMNS)}")
    if missing := [name for name in COLUMNS[:-1] if name not in header]:
        raise InputError(f"line 1: expected the columns {quoted(COLUMNS[:-1])}", f"no {quoted(missing)}")
    if not table:
        raise InputError("expected a line for each frequency of each function below line 1", "none")
    functions: dict[tuple[str, ...], list[list[float]]] = {}
    for line, cells in table:
        numbers = []
        for cell in (cells[name] for name in COLUMNS if name in cells and name not in ENDS):
            try:
                numbers.append(float(cell))
            except ValueError:
                raise InputError(f"line {line}: expected a number", f'"{shown(cell)}"') from None
        functions.setdefault(tuple(cells[end] for end in ENDS), []).append(numbers)
    for (force, response), rows in functions.items():
        values = np.array(rows)
        coherence = values[:, 3] if values.shape[1] > 3 else None
        yield Column(force, response, values[:, 0], values[:, 1] + 1j * values[:, 2], coherence)


def _of_mat(path: Path) -> Iterator[Column]:
    """FRFs of variables frequency (F,), H (F, p), force and response (p names), and perhaps coherence (F, p)."""
    content = io.BytesIO(read_bytes(path, "file of FRFs"))
    try:
        data = scipy.io.loadmat(content)
    except Exception:  # whatever SciPy finds in a file that is none
        raise InputError("expected a .mat file of version 7 or older (MATLAB: save -v7)", "another file") from None
    if missing := [name for name in ("frequency", "H", *ENDS) if name not in data]:
        raise InputError("expected variables frequency, H, force and response", f"no {quoted(missing)}")
    try:
        frequency, H = data["frequency"].ravel().astype(float), data["H"].astype(complex)
        ends = [[str(np.ravel(one)[0]).strip() for one in data[name].ravel()] for name in ENDS]
        coherence = data["coherence"].astype(float) if "coherence" in data else np.full(H.shape, np.nan)
    except (ValueError, TypeError, IndexError):
        raise InputError(
            "expected numbers in frequency, H and coherence, and names in force and response", "others"
        ) from None
    shape = (len(frequency), len(ends[0]))
    if not shape == H.shape == coherence.shape == (len(frequency), len(ends[1])):
        raise InputError(
            "expected H and coherence with a line for each frequency and a column for each force and response",
            f"H of shape {H.shape} for {shape[0]} frequencies, {shape[1]} forces and {len(ends[1])} responses",
        )
    for k, (force, response) in enumerate(zip(*ends, strict=True)):
        yield Column(force, response, frequency, H[:, k], coherence[:, k] if "coherence" in data else None)


G = 9.80665  # m/s²
UNITS = {
    "m/N": (0, 1.0), "mm/N": (0, 1e-3), "µm/N": (0, 1e-6), "m/s/N": (1, 1.0), "mm/s/N": (1, 1e-3), "m/s²/N": (2, 1.0),
    "mm/s²/N": (2, 1e-3), "g/N": (2, G),
}  # fmt: skip
"""Order of the time derivative that was measured (receptance 0, mobility 1, accelerance 2), and factor to SI."""
Unit = Literal["m/N", "mm/N", "µm/N", "m/s/N", "mm/s/N", "m/s²/N", "mm/s²/N", "g/N"]
FLOOR = 1e-3  # relative deviation that no FRF is better known than


class ResponseTest(Record):
    """FRFs in one pose of the robot."""

    name: str
    """Name in tables and pictures."""
    file: InputFile
    """Universal file (.uff, .unv, .58), CSV table or .mat file."""
    unit: Unit | None = None
    """Unit of the FRFs, of receptance, mobility or accelerance. Universal files in SI units do not need it."""
    pose: dict[str, Any] = Field(default_factory=dict)
    """Pose, with the keys of [initial] of a scene: { joints = { elbow = "70*deg" } }; default: that of the scene."""
    points: dict[str, PointReference] = Field(default_factory=dict)
    """Points of the robot, "BODY.POINT", for node numbers or other names in the file."""
    rpy: Angles = (0.0, 0.0, 0.0)
    """Orientation of the axes x, y, z of the file in the global ones: roll, pitch, yaw about fixed axes, rad."""
    band: tuple[NotNegative, Positive] | None = None
    """Lowest and highest frequency that count, Hz; default: all."""
    averages: Annotated[int, Field(ge=2)] | None = None
    """Number of averages: with the coherence it determines the deviation of each value."""
    validation: bool = False
    """Whether the test is only compared with the fitted model."""


class ResponseTests(Record):
    """All tests of a robot."""

    test: tuple[ResponseTest, ...] = Field(min_length=1)
    """FRFs in one pose each."""


class Direction(NamedTuple):
    """A point "BODY.POINT" and a direction of unit length in global axes."""

    point: str
    axis: tuple[float, float, float]

    @property
    def label(self) -> str:
        """Text of the point and the axis, "fore.tip -z"; of an oblique axis its components."""
        for sign, value in (("", 1.0), ("-", -1.0)):
            if value in self.axis:
                return f"{self.point} {sign}{'xyz'[self.axis.index(value)]}"
        return f"{self.point} ({', '.join(f'{x:.3g}' for x in self.axis)})"


class Ends(NamedTuple):
    """The different directions in p FRFs, and the index among them of each FRF's force (p) and response (p)."""

    directions: list[Direction]
    force: list[int]
    response: list[int]


@struct
class MeasuredPose:
    """The p FRFs of one test at `frequency` (F,), Hz: directions of `force` and `response` of each.

    `receptance` (F, p), m/N; `coherence` (F, p), no unit, NaN where unknown.
    """

    test: ResponseTest
    frequency: Array
    force: tuple[Direction, ...]
    response: tuple[Direction, ...]
    receptance: ComplexArray
    coherence: Array

    @cached_property
    def omega(self) -> Array:
        """Angular frequencies (F,), rad/s."""
        return 2 * np.pi * self.frequency

    @cached_property
    def ends(self) -> Ends:
        """Directions of forces and responses, each once."""
        directions = list(dict.fromkeys((*self.force, *self.response)))
        force, response = ([directions.index(end) for end in ends] for ends in (self.force, self.response))
        return Ends(directions, force, response)

    @property
    def labels(self) -> list[str]:
        """Texts of the p pairs of force and response."""
        return [f"{force.label} → {response.label}" for force, response in zip(self.force, self.response, strict=True)]

    @cached_property
    def deviation(self) -> Array:
        """Standard deviation (F, p) of ln H by n averages and coherence γ², no unit; 1 where γ² is unknown.

        √((1 − γ²)/(2 n γ²)) (Bendat and Piersol, Random Data, 2010, 9.2).
        """
        averages = self.test.averages or 2
        spread = np.sqrt((1.0 - self.coherence) / (2.0 * averages * np.maximum(self.coherence, FLOOR)))
        return np.where(np.isnan(spread), 1.0, np.maximum(spread, FLOOR))


def read_tests(path: Path) -> list[MeasuredPose]:
    """Read the tests of the TOML file at `path`. Raises `InputError` for errors in it or in the files it names."""
    tests = validate(ResponseTests, load_toml(path, "file of tests"), path).test
    for test in tests:
        if len(tests) > 1 and not test.pose:
            raise InputError(f'{path}: test "{test.name}": pose: expected one for each of several tests', "none")
    return [_read(path, test) for test in tests]


def _read(path: Path, test: ResponseTest) -> MeasuredPose:
    columns = read_columns(test.file)
    frequency = columns[0].frequency
    low, high = test.band or (-np.inf, np.inf)
    inside = (frequency >= low) & (frequency <= high)
    if not inside.any():
        raise InputError(f'{path}: test "{test.name}": band: expected frequencies of the file within it', "none")
    responses = []
    for column in columns:
        with naming(f"{test.file}: {column.force} → {column.response}"):
            sizes = {len(of) for of in (frequency, column.frequency, column.coherence) if of is not None}
            if len(sizes) > 1 or not np.allclose(column.frequency, frequency, rtol=1e-9):
                raise InputError("expected the frequencies of the other functions", "others")
            _check(column, inside)
            responses.append(_response(test, column, inside))
    force, response, receptance, coherence = zip(*responses, strict=True)
    if test.averages is not None and np.isnan(coherence).any():
        raise InputError(f'{path}: test "{test.name}": averages: expected them with a coherence in the file', "none")
    of_columns = np.transpose(receptance), np.transpose(coherence)
    return MeasuredPose(test, frequency[inside], force, response, *of_columns)


def _check(column: Column, inside: Booleans) -> None:
    """Refuse numbers that no FRF has."""
    at, values = column.frequency[inside], column.values[inside]
    if not (np.diff(column.frequency) > 0.0).all():
        raise InputError("expected each frequency once, in rising order", "others")
    if not at.min() > 0.0:
        raise InputError(
            "expected frequencies above 0 Hz",
            f"{at.min():g}: the key band, such as [5.0, 200.0], leaves them out",
        )
    if not (np.isfinite(values).all() and np.abs(values).all()):
        raise InputError("expected finite values that are not 0", "others")
    if len(at) > 1 and (values.real > 0.0).all() and not values.imag.any():
        raise InputError("expected complex values", "positive real ones: a magnitude is no FRF")
    coherence = np.ones(1) if column.coherence is None else column.coherence[inside]
    if (wrong := coherence[~((coherence >= 0.0) & (coherence <= 1.0))]).size:
        raise InputError("coherence: expected values from 0 to 1", f"{wrong[0]:g}")


def _response(test: ResponseTest, column: Column, inside: Booleans) -> tuple[Direction, Direction, ComplexArray, Array]:
    """Directions of force and response, receptance (F,), m/N, and coherence (F,), NaN where unknown."""
    order, factor = UNITS[test.unit] if test.unit else (column.order, 1.0)
    if test.unit is None and not column.is_si:
        raise InputError(f"expected the key unit of the test, one of {quoted(UNITS)}", "none")
    if order is None or column.order not in (None, order):
        units = either(unit for unit, (of, _) in UNITS.items() if of == column.order)
        raise InputError(f"unit: expected that of the file, {units}", f'"{test.unit}"')
    axes = of_rpy(*test.rpy)
    force, response = (_direction(text, test.points, axes) for text in (column.force, column.response))
    receptance = column.values[inside] * factor / (2j * np.pi * column.frequency[inside]) ** order
    coherence = np.full(len(receptance), np.nan) if column.coherence is None else column.coherence[inside]
    return force, response, receptance, coherence


def _direction(text: str, points: Mapping[str, str], axes: Array) -> Direction:
    name, _, axis = text.rpartition("/")
    sign, letter = (-1.0 if axis.startswith("-") else 1.0), axis.lstrip("+-")
    if not name or len(letter) != 1 or letter not in "xyz":
        raise InputError("expected POINT/x, POINT/-z, …", f'"{shown(text)}"')
    if name not in points and "." not in name:
        raise InputError(f'points: expected the point of the robot for "{shown(name)}"', "none")
    x, y, z = (sign * axes[:, "xyz".index(letter)]).tolist()
    return Direction(points.get(name, name), (x, y, z))
