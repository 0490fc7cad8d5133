"""A table of measured modes: natural frequencies and damping ratios, as link files and `ffrobot fit` take them."""

from collections.abc import Iterator
from math import isfinite
from pathlib import Path

from ...common.errors import InputError, check_known, quoted
from ...common.structs import struct
from ...common.tables import LARGEST, shown
from ...common.toml_files import read_labelled_csv
from ...common.validation import InputFile, Record

COLUMNS = ("mode", "family", "frequency", "damping_ratio", "uncertainty")


class Measured(Record):
    """Measured natural frequencies and damping ratios instead of computed ones; shapes stay."""

    table: InputFile
    """CSV table with the columns `mode` and `frequency` (Hz) or `damping_ratio`; `family` in addition to `mode` if
    modes are counted by family."""


@struct
class MeasuredMode:
    """A row of the table of measured modes."""

    line: int  # of the file
    number: int  # of the mode, from 1, the lowest first: among those of `family`, or among all where that is empty
    family: str
    frequency: float | None  # Hz; None where not measured
    damping_ratio: float | None  # ζ; None where not measured
    uncertainty: float | None  # standard deviation of the frequency, Hz; None where not known

    @property
    def label(self) -> str:
        """Name of the mode in messages and tables."""
        return f"{self.family} {self.number}" if self.family else f"mode {self.number}"


def read_measured(path: Path, families: tuple[str, ...]) -> list[MeasuredMode]:
    """The rows of the CSV table at `path`; `families` are the names that its column `family` may have.

    Raises `InputError` naming file and line.
    """
    header, table = read_labelled_csv(path, "table of measured modes")
    for name in header:
        check_known(name, COLUMNS, f"{path}: line 1: expected columns among {quoted(COLUMNS)}")
    if "mode" not in header or not {"frequency", "damping_ratio"} & set(header):
        columns = shown(",".join(header))
        raise InputError(f"{path}: line 1: expected a header such as mode,frequency,damping_ratio", f"{columns!r}")
    rows = [_row(f"{path}: line {line}", line, cells, families) for line, cells in table]
    if not rows:
        raise InputError(f"{path}: expected at least one measured mode below the header", "none")
    seen = set[tuple[str, int]]()
    for row in rows:
        if (row.family, row.number) in seen:
            raise InputError(f"{path}: line {row.line}: expected each mode once", f"{row.label} again")
        seen.add((row.family, row.number))
    return rows


def _row(where: str, line: int, texts: dict[str, str], families: tuple[str, ...]) -> MeasuredMode:
    number = texts["mode"]
    if not (number.isascii() and number.isdecimal() and int(number[:9]) > 0):
        raise InputError(f"{where}: mode: expected a whole number from 1 on", f'"{shown(number)}"')
    family = texts.get("family", "")
    if family:
        known = quoted(families) if families else "none of a robot, whose modes have no family"
        check_known(family, families, f"{where}: family: expected {known}")
    frequency, damping, spread = (_number(where, name, texts.get(name, "")) for name in COLUMNS[2:])
    if frequency is None and damping is None:
        raise InputError(f"{where}: expected a frequency or a damping_ratio", "neither")
    return MeasuredMode(line, int(number[:9]), family, frequency, damping, spread)


def _number(where: str, name: str, text: str) -> float | None:
    """The entry as a number above 0, for damping not below it; None where it is empty."""
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    least = value >= 0.0 if name == "damping_ratio" else value > 0.0
    if not (isfinite(value) and least and value < LARGEST):
        bound = "not below 0" if name == "damping_ratio" else "above 0, in Hz"
        raise InputError(f"{where}: {name}: expected a number {bound}, or nothing", f'"{shown(text)}"')
    return value


def paired(rows: list[MeasuredMode], family: tuple[str, ...]) -> Iterator[tuple[int, MeasuredMode]]:
    """Yield measured modes, each after its number, from 0, among computed modes, whose families are `family` (n,)."""
    for row in rows:
        candidates = [k for k, name in enumerate(family) if not row.family or name == row.family]
        if row.number <= len(candidates):
            yield candidates[row.number - 1], row
