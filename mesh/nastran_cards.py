"""Nastran's bulk data as text: cards of fixed or free field, of 8 or 16 columns, with their continuations.

See "Format of Bulk Data Entries" in the Quick Reference Guide of MSC Nastran.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ..common.errors import InputError
from .included import Line, lines_of, number_of, whole_of

_BEGIN = re.compile(r"\s*BEGIN\b[\s,]*(\w*)", re.IGNORECASE)
_BY_BLANKS = re.compile(r"(GRID|C(?:HEXA|TETRA|PENTA|PYRAM?|ORD[12][RCS]|ONM[12]))\*?(?= )", re.IGNORECASE)
_CONTROL = re.compile(r"\s*CEND\b", re.IGNORECASE)


@dataclass
class Card:
    """A card: its `name` in upper case, where it stands, and its fields after the name, over all its lines."""

    name: str
    place: str
    fields: list[str]

    def __str__(self) -> str:
        return f"{self.name}, {self.place}"

    def text(self, number: int) -> str:
        """Field `number`, counted from 0 after the name; empty where there is none."""
        return self.fields[number] if number < len(self.fields) else ""

    def whole(self, number: int, default: int | None = None) -> int:
        """A whole number in a field. Raises `InputError` where there is none, and no default."""
        text = self.text(number)
        return default if default is not None and not text else whole_of(text, str(self))

    def real(self, number: int, default: float = 0.0) -> float:
        """A number in a field, `default` where it is empty. Raises `InputError` where it is none."""
        text = self.text(number)
        return number_of(text, str(self)) if text else default


@dataclass
class _Row:
    """A line of a card; `begin` and `end` are the marks that tell which line goes on with which.

    `is_half` is of lines of 16 columns that end with *: another line has to follow.
    """

    name: str
    place: str
    fields: list[str]
    begin: str
    end: str
    follows: bool
    is_half: bool


def cards(path: Path) -> Iterator[Card]:
    """The cards of a deck's bulk data, of included files too.

    Raises:
        InputError: an included file is not there, a line goes on with none, or cards are replicated (=).
    """
    rows = [_row(line) for line in _bulk(path)]
    ends: dict[str, int] = {}
    for k, row in enumerate(rows):
        if row.end:
            ends[row.end] = -1 if row.end in ends else k
    if rows and rows[0].follows and rows[0].begin not in ends:
        raise InputError(f"expected a card (GRID …) first, found a line that continues none ({rows[0].place})")
    after: dict[int, int] = {}
    for k, row in enumerate(rows):
        if not row.follows:
            continue
        before = k - 1
        if row.begin and (k == 0 or rows[before].end != row.begin):
            by_mark = ends.get(row.begin)
            before = before if by_mark is None and k and not rows[before].end else -1 if by_mark is None else by_mark
        if before < 0 or before in after:
            raise InputError(f"{row.place}: expected one card that this line continues, found none or several")
        after[before] = k
    for k, row in enumerate(rows):
        if row.is_half and k not in after:
            raise InputError(f"{row.place}: expected a line that continues this one (*), found none")
        if row.follows:
            continue
        fields = list(row.fields)
        while (k := after.get(k, -1)) >= 0:
            fields += rows[k].fields
        while fields and not fields[-1]:
            fields.pop()
        yield Card(row.name, row.place, fields)


def _bulk(path: Path) -> Iterator[Line]:
    """The lines of the bulk data: after BEGIN BULK where there is one, up to ENDDATA; no comments or empty lines."""
    lines = [Line(line.text.partition("$")[0].rstrip(), line.place) for line in lines_of(path, _included)]
    begins = [k for k, line in enumerate(lines) if _BEGIN.match(line.text)]
    if len(begins) > 1:
        raise InputError(f"{lines[begins[1]].place}: expected one BEGIN BULK, found another (superelements)")
    if not begins and any(_CONTROL.match(line.text) for line in lines):
        raise InputError("expected BEGIN BULK after CEND, found none")
    for line in islice(lines, begins[0] + 1 if begins else 0, None):
        if line.text.strip().upper().startswith("ENDDATA"):
            return
        if line.text.strip():
            yield line


def _included(following: Iterator[str], line: str) -> str | None:
    """The file of INCLUDE 'NAME', which may go over several lines."""
    text = line.partition("$")[0].strip()
    if not re.match(r"INCLUDE\b", text, re.IGNORECASE):
        return None
    text = text[7:].strip()
    if text[:1] in ("'", '"'):
        while text.count(text[0]) < 2 and (more := next(following, None)) is not None:
            text += more.strip()
    return text.strip("'\" ")


def _row(line: Line) -> _Row:
    text = line.text
    if "," in text:
        entries = [entry.strip() for entry in text.split(",")]
        name = entries[0]
        width = 4 if "*" in name else 8
        entries += [""] * (width + 2 - len(entries))
        if any(entries[width + 2 :]):
            raise InputError(f"{line.place}: expected {width} fields in a line at most, found {len(entries) - 1}")
    else:
        text = text.expandtabs(8)
        name = text[:8].strip()
        width, columns = (4, 16) if "*" in name else (8, 8)
        entries = [
            name,
            *(text[8 + columns * k : 8 + columns * (k + 1)].strip() for k in range(width)),
            text[72:80].strip(),
        ]
    if first := _BY_BLANKS.match(name):
        raise InputError(
            f'{line.place}: expected fields of 8 columns or commas between them, found "{first[0]}" and a blank'
        )
    if name.startswith("=") or any(entry.startswith("=") for entry in entries):
        raise InputError(f"{line.place}: expected cards one by one, found replicated ones (=)")
    follows = not name or name[0] in "+*"
    return _Row(
        name.rstrip("*").strip().upper(), line.place, entries[1 : width + 1],
        name.lstrip("+* ") if follows else "", entries[width + 1].lstrip("+* "), follows,
        entries[width + 1].startswith("*"),
    )  # fmt: skip
