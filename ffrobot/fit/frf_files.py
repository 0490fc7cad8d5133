"""Files of measured FRFs: universal files (dataset 58), CSV tables and .mat files."""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, ComplexArray, as_floats
from ..common.errors import InputError, check_known, quoted
from ..common.libraries import extras, scipy
from ..common.tables import shown
from ..common.toml_files import read_bytes, read_csv

ENDS = ("force", "response")
COLUMNS = ("frequency", "force", "response", "real", "imaginary", "coherence")
FRF, COHERENCE = 4, 6  # function types of UFF 58
FORCE, ORDERS = 13, {8: 0, 11: 1, 12: 2}  # data types of UFF 58: what is measured per force
LABELS = {0: ("m",), 1: ("m/s",), 2: ("m/s^2", "m/s2", "m/s²", "m/s**2")}  # of its units, where they are SI


class Column(NamedTuple):
    """An FRF as a file has it, with texts of its ends, "POINT/-x"."""

    force: str
    response: str
    frequency: Array
    values: ComplexArray
    coherence: Array | None
    order: int | None = None  # of the time derivative, where the file has it
    is_si: bool = False


def read_columns(path: Path) -> list[Column]:
    """Return all FRFs of a file. Raises `InputError` for a file of another kind, and for one without FRFs."""
    readers = {".uff": _universal, ".unv": _universal, ".58": _universal, ".csv": _of_csv, ".mat": _of_mat}
    suffix = path.suffix.lower()
    if suffix not in readers:
        raise InputError(f"{path}: expected a file with {quoted(readers)}", f'"{path.name}"')
    columns = list(readers[suffix](path))
    if not columns:
        raise InputError(f"{path}: expected frequency response functions (type 4 of dataset 58)", "none")
    return columns


def _universal(path: Path) -> Iterator[Column]:
    """FRFs of datasets 58 with the coherence of the same ends; other functions are left out."""
    with extras():
        import pyuff
    read_bytes(path, "universal file")
    try:
        file = pyuff.UFF(str(path))
        sets = [file.read_sets(k) for k in np.flatnonzero(np.array(file.get_set_types()) == 58).tolist()]
        for one in sets:
            one["data"].real, one["x"], one["func_type"]
    except Exception:  # whatever pyuff finds in a file that is none
        raise InputError(f"{path}: expected datasets 58 of a universal file", "damaged ones") from None
    ends = [(one["ref_node"], one["ref_dir"], one["rsp_node"], one["rsp_dir"]) for one in sets]
    coherence = {at: one["data"].real for at, one in zip(ends, sets, strict=True) if one["func_type"] == COHERENCE}
    for at, one in zip(ends, sets, strict=True):
        if one["func_type"] != FRF:
            continue
        kind, by = one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]
        if kind not in ORDERS or by != FORCE:
            raise InputError(
                f"{path}: node {at[2]}: expected displacement, velocity or acceleration (data types 8, 11, 12) per"
                " force (13)",
                f"types {kind} and {by}",
            )
        force, response = (f"{node:g}/{_axis(path, axis)}" for node, axis in (at[:2], at[2:]))
        label = str(one["ordinate_axis_units_lab"]).strip().lower()
        is_si = label in ("", "none", *LABELS[ORDERS[kind]])
        values = one["data"].astype(complex)
        yield Column(force, response, as_floats(one["x"]), values, coherence.get(at), order=ORDERS[kind], is_si=is_si)


def _axis(path: Path, code: float) -> str:
    if abs(code) not in (1, 2, 3):
        raise InputError(f"{path}: expected translations along x, y, z (directions ±1, ±2, ±3)", f"{code:g}")
    return "-" * (code < 0) + "xyz"[int(abs(code)) - 1]


def _of_csv(path: Path) -> Iterator[Column]:
    """FRFs of a table with a line for each frequency of each function."""
    header, table = read_csv(path, "table of FRFs")
    for name in header:
        check_known(name, COLUMNS, f"{path}: line 1: expected columns among {quoted(COLUMNS)}")
    if missing := [name for name in COLUMNS[:-1] if name not in header]:
        raise InputError(f"{path}: line 1: expected the columns {quoted(COLUMNS[:-1])}", f"no {quoted(missing)}")
    if not table:
        raise InputError(f"{path}: expected a line for each frequency of each function below line 1", "none")
    functions: dict[tuple[str, ...], list[list[float]]] = {}
    for line, row in table:
        if len(row) != len(header):
            raise InputError(f"{path}: line {line}: expected {len(header)} cells", len(row))
        cells = dict(zip(header, row, strict=True))
        numbers = [_number(path, line, cells[name]) for name in COLUMNS if name in cells and name not in ENDS]
        functions.setdefault(tuple(cells[end] for end in ENDS), []).append(numbers)
    for (force, response), rows in functions.items():
        values = np.array(rows)
        coherence = as_floats(values[:, 3]) if values.shape[1] > 3 else None
        yield Column(force, response, as_floats(values[:, 0]), values[:, 1] + 1j * values[:, 2], coherence)


def _number(path: Path, line: int, cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise InputError(f"{path}: line {line}: expected a number", f'"{shown(cell)}"') from None


def _of_mat(path: Path) -> Iterator[Column]:
    """FRFs of variables frequency (F,), H (F, p), force and response (p names), and perhaps coherence (F, p)."""
    content = io.BytesIO(read_bytes(path, "file of FRFs"))
    try:
        data = scipy.io.loadmat(content, chars_as_strings=True)
    except Exception:  # whatever SciPy finds in a file that is none
        raise InputError(
            f"{path}: expected a .mat file of version 7 or older (MATLAB: save -v7)", "another file"
        ) from None
    if missing := [name for name in ("frequency", "H", *ENDS) if name not in data]:
        raise InputError(f"{path}: expected variables frequency, H, force and response", f"no {quoted(missing)}")
    try:
        frequency, H = data["frequency"].ravel().astype(float), data["H"].astype(complex)
        ends = [[str(np.ravel(one)[0]).strip() for one in data[name].ravel()] for name in ENDS]
        coherence = data["coherence"].astype(float) if "coherence" in data else np.full(H.shape, np.nan)
    except (ValueError, TypeError, IndexError):
        raise InputError(
            f"{path}: expected numbers in frequency, H and coherence, and names in force and response", "others"
        ) from None
    shape = (len(frequency), len(ends[0]))
    if not shape == H.shape == coherence.shape == (len(frequency), len(ends[1])):
        raise InputError(
            f"{path}: expected H and coherence with a line for each frequency and a column for each force and response",
            f"H of shape {H.shape} for {shape[0]} frequencies, {shape[1]} forces and {len(ends[1])} responses",
        )
    for k, (force, response) in enumerate(zip(*ends, strict=True)):
        yield Column(force, response, as_floats(frequency), H[:, k], coherence[:, k] if "coherence" in data else None)
