"""The text of SID_FEM files: nested objects, and matrices M0 + Σ M1_l q_l of which entries of zero are left out."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.tables import shown

ENTRY = re.compile(r"m([01])\s*\(([\s\d,]+)\)")
MOST = 10**7  # entries of a matrix: a file that asks for more is damaged
SYMMETRIC, IDENTITY = 2, 4  # values of `structure`


@dataclass
class Taylor:
    """A matrix M0 (rows, columns) + Σ_l M1[:, l] q_l with M1 (rows, modes, columns)."""

    m0: Array
    m1: Array

    @property
    def nrow(self) -> int:
        """Number of rows."""
        return len(self.m0)


@dataclass
class Section:
    """An object of the file: its keys, and the objects inside, by name and in order."""

    name: str
    keys: dict[str, str] = field(default_factory=dict)
    inside: list[Section] = field(default_factory=list)

    def __getitem__(self, name: str) -> Section:
        for section in self.inside:
            if section.name.lower() == name.lower():
                return section
        raise InputError(f"expected the object {name} in {self.name}, found none")

    def number(self, key: str) -> float:
        """The value of a key."""
        if key not in self.keys:
            raise InputError(f"{self.name}: expected the key {key}, found none")
        return real(self.keys[key], f"{self.name}: {key}")


def real(text: str, label: str) -> float:
    """A number with Fortran's exponents."""
    try:
        value = float(text.replace("D", "E").replace("d", "e"))
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise InputError(f'{label}: expected a finite number, found "{shown(text.strip())}"')
    return value


def parse(text: str) -> tuple[str, Section]:
    """The first line, and the object `part` as a tree. Raises `InputError` where objects do not nest."""
    head, *lines = text.splitlines() or [""]
    top = Section("file")
    stack = [top]
    for number, line in enumerate(lines, 2):
        words, _, value = line.strip().partition("=")
        words = words.strip()
        if words == "end" or words.startswith("end "):
            if len(stack) == 1:
                raise InputError(f'line {number}: expected an object to end, found "{shown(words)}" outside of all')
            stack.pop()
        elif not words:
            continue
        elif value.strip() and not words.startswith("new "):
            stack[-1].keys[words] = value.strip()
        else:
            name = words.removeprefix("new ").strip()
            section = Section(name, {"number": value.strip()} if value.strip() else {})
            stack[-1].inside.append(section)
            stack.append(section)
    if len(stack) > 1:
        raise InputError(f"expected `end {stack[-1].name}`, found the end of the file")
    return head, top


class Layout(NamedTuple):
    """Number of modes, and whether M1 is (row, column, mode) in place of (row, mode, column)."""

    modes: int
    mode_is_last: bool


def taylor(section: Section, layout: Layout, *sizes: tuple[int, int]) -> Taylor:
    """The matrix of an object, which has one of these numbers of rows and columns; any where none is given."""
    modes = layout.modes
    nrow, ncol = (int(section.number(key)) for key in ("nrow", "ncol"))
    if not (nrow > 0 and ncol > 0 and nrow * ncol * (modes + 1) <= MOST) or (sizes and (nrow, ncol) not in sizes):
        wanted = " or ".join(f"{rows} × {columns}" for rows, columns in sizes) or "rows × columns"
        raise InputError(f"{section.name}: expected a matrix of {wanted}, found nrow = {nrow}, ncol = {ncol}")
    found = Taylor(np.zeros((nrow, ncol)), np.zeros((nrow, modes, ncol)))
    structure = int(section.number("structure"))
    if structure == SYMMETRIC and nrow != ncol:
        raise InputError(f"{section.name}: expected a square matrix of structure {SYMMETRIC}, found {nrow} × {ncol}")
    if structure == IDENTITY:
        found.m0[:] = np.eye(nrow, ncol)
    for order, index, value in _entries(section):
        if order and layout.mode_is_last and len(index) == 3:
            index = (index[0], index[2], index[1])
        target = found.m1 if order else found.m0
        if len(index) != target.ndim or any(not 0 <= k < size for k, size in zip(index, target.shape, strict=False)):
            at = ", ".join(str(k + 1) for k in index)
            raise InputError(f"{section.name}: expected m{order} within {target.shape}, found m{order}({at})")
        target[index] = value
        if structure == SYMMETRIC and not order:
            target[index[::-1]] = value
    return found


def _entries(section: Section) -> Iterator[tuple[int, tuple[int, ...], float]]:
    """Order, indices from 0, value."""
    for key, value in section.keys.items():
        if match := ENTRY.fullmatch(key):
            try:
                index = tuple(int(part) - 1 for part in match[2].split(","))
            except ValueError:
                raise InputError(f'{section.name}: expected whole numbers in indices, found "{shown(key)}"') from None
            yield int(match[1]), index, real(value, f"{section.name}: {key}")


def layout_of(modal: Section, modes: int) -> Layout:
    """How M1 is written: mdCM has one column, so that a third index above 1 is that of a mode."""
    thirds = [index[2] for order, index, _ in _entries(modal["mdCM"]) if order and len(index) == 3]
    return Layout(modes, any(third > 0 for third in thirds))


def lines_of(
    name: str, m0: Array, m1: Array | None = None, indent: int = 11, structure: int | None = None
) -> Iterator[str]:
    """The object `name` with M0 (rows, columns), and M1 (rows, modes, columns) where it is of first order."""
    kind = 3 if structure is None else structure
    if structure is None and not np.any(m0) and (m1 is None or not np.any(m1)):
        kind = 0
    modes = 0 if m1 is None else m1.shape[1]
    blank = " " * indent
    yield f"{blank}{name}"
    for key, value in (("order", int(m1 is not None)), ("nrow", m0.shape[0]), ("ncol", m0.shape[1]),
                       ("nq", modes), ("nqn", 0), ("structure", kind)):  # fmt: skip
        yield f"{blank}     {key:<22}= {value:5d}"
    if kind != IDENTITY:
        for order, matrix in enumerate([m0] if m1 is None else [m0, m1]):
            for index in zip(*np.nonzero(matrix), strict=True):
                at = ",".join(f"{k + 1:2d}" for k in index)
                yield f"{blank}     {f'm{order}({at})':<22}= {fortran(matrix[index])}"
    yield f"{blank}end {name}"


def fortran(value: float) -> str:
    """A number with all its digits, as Fortran writes it."""
    return f"{value: .16E}".replace("E", "D")
