"""Tables as TOML and CSV have them: where in a file a key is, limits of what any file may contain, cells as text."""

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from datetime import date, time
from typing import Any

DEEPEST = 32  # tables and lists within each other
LONGEST_TEXT = 20_000  # characters; expressions have a limit of their own below this
LARGEST = 1e30  # of any number: products of a few of them are still finite
SMALLEST = 1e-30  # of what has to be positive
LARGEST_INTEGER = 2**63 - 1  # TOML promises no more


CsvTable = tuple[list[str], list[tuple[int, list[str]]]]
"""Cells of a CSV file, without blanks around them: the header, and the rows below it with their lines."""


COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?|[-+]?\d+,([eE][-+]?\d+)?")


def parse_csv(text: str) -> CsvTable:
    """Header and cells of CSV text, between commas, semicolons or tabs, as the header has them.

    With the latter two, numbers may have decimal commas. Empty lines and comments (#) are skipped, but for a header
    that is a comment, as NumPy writes it. Raises `csv.Error`, also where a column stands twice.
    """
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("sep=")]
    comments = [(k, line.lstrip("# ")) for k, line in lines if line.startswith("#")]
    lines = [(k, line) for k, line in lines if not line.startswith("#")]
    separator = next((each for each in ";\t" if lines and each in lines[0][1]), ",")
    if comments and lines and not any(c.isalpha() for c in lines[0][1].replace("e", "").replace("E", "")):
        lines.insert(0, comments[-1])
    reader = csv.reader((line for _, line in lines), delimiter=separator, skipinitialspace=True)
    rows = [(lines[reader.line_num - 1][0], [cell.strip() for cell in row]) for row in reader]
    if separator != ",":
        rows = [(k, [" ".join(map(_with_point, cell.split(" "))) for cell in row]) for k, row in rows]
    header, *below = [(k, row) for k, row in rows if any(row)] or [(0, [])]
    for k, row in below if "_" in text else ():
        for cell in row:
            if "_" in cell and _is_number(cell):  # to Python
                raise csv.Error(f"line {k}: expected a number without underscores, found {cell}")
    is_table = len(header[1]) > 1 and all(map(NAME.fullmatch, header[1]))
    if header[1] and not (is_table or any(_is_number(cell) for _, row in below for cell in row)):
        raise csv.Error("expected names of columns and numbers below, found other text")  # which is not for messages
    names = [name for name in header[1] if name]
    if is_table and len(set(names)) < len(names):
        raise csv.Error(f"line {header[0]}: expected each column once, found {shown(','.join(header[1]))!r}")
    return header[1], below


NAME = re.compile(r"[\w .,;/°µ()\[\]-]{0,100}")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _with_point(word: str) -> str:
    return word.replace(",", ".") if COMMA.fullmatch(word) else word


FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Begins what spreadsheets take for a formula, which may run programs (OWASP, CSV Injection)."""


def as_csv(rows: Iterable[Iterable[object]]) -> str:
    """Lines of a CSV file (RFC 4180), with all digits, and an apostrophe before text that a spreadsheet would run."""
    text = io.StringIO()
    cells = ([f"'{cell}" if _is_formula(cell) else cell for cell in row] for row in rows)
    csv.writer(text, lineterminator="\n").writerows(cells)
    return text.getvalue()


def _is_formula(cell: object) -> bool:
    return isinstance(cell, str) and cell.startswith(FORMULA) and len(cell) > 1 and not _is_number(cell)


def key_path(loc: Sequence[int | str], data: dict[str, Any], kind: str = "missing") -> str:
    """Name for messages, `body "link1": rigid.mass`, of ("body", 0, "rigid", "mass"): of the parts in `data`.

    With `kind` "missing" the last part counts even where `data` lacks it.
    """
    path = ""
    here: Any = data
    for k, part in enumerate(loc):
        is_missing_key = kind == "missing" and k == len(loc) - 1
        if isinstance(here, list) and isinstance(part, int) and part < len(here):
            here = here[part]
            path += f" {_label(here, part)}: " if isinstance(here, dict) else f"[{part}]"
        elif isinstance(here, dict) and (part in here or is_missing_key):
            here = here.get(part)
            path += ("." if path and not path.endswith(" ") else "") + shown(str(part))
    return path.removesuffix(": ")


def shown(text: str) -> str:
    """`text` for one line of a message: at most 60 of its characters; control characters and line breaks escaped."""
    text = text if len(text) <= 60 else text[:59] + "…"
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def beyond_limits(data: dict[str, Any]) -> Iterator[str]:
    """Yield `KEY: expected …, found …` for each value in `data` that is too large, long or deep for any file."""
    yield from (f"{key_path(loc, data)}: {problem}" for loc, problem in _beyond(data, ()))


def _beyond(value: Any, loc: tuple[int | str, ...]) -> Iterator[tuple[tuple[int | str, ...], str]]:
    if isinstance(value, dict | list):
        if len(loc) >= DEEPEST:
            yield loc[:2], f"expected at most {DEEPEST} tables and lists within each other, found more"
            return
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            if isinstance(key, str) and len(key) > LONGEST_TEXT:
                yield loc, f"expected keys of at most {LONGEST_TEXT} characters, found one of {len(key)}"
            yield from _beyond(item, (*loc, key))
    elif isinstance(value, str) and len(value) > LONGEST_TEXT:
        yield loc, f"expected at most {LONGEST_TEXT} characters, found {len(value)}"
    elif isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        yield loc, f"expected a whole number of at most {LARGEST_INTEGER:.3g}, found a larger one"
    elif isinstance(value, date | time):  # TOML has them where quotes are forgotten
        yield loc, f'expected no date or time, found {value} (text is written in quotes: "{value}")'
    elif isinstance(value, float) and LARGEST < abs(value) < float("inf"):  # records say so of infinity and NaN
        yield loc, f"expected a number between -{LARGEST:g} and {LARGEST:g}, found {value:g}"


def _label(table: dict[str, Any], index: int) -> str:
    """What an entry of an array of tables is called: by its name, its body, or its place in the file."""
    name = table.get("name", table.get("body"))
    return f'"{shown(name)}"' if isinstance(name, str) else f"no. {index + 1}"
