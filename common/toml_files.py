"""TOML and CSV files: whatever is wrong with one that is read comes as an `InputError` in its name."""

import csv
import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import InputError, refuse
from .outputs import check_regular
from .tables import DEEPEST, CsvTable, beyond_limits, parse_csv

# The key that makes a file one of its kind, and the command for it.
_KINDS: Mapping[str, tuple[str, str]] = {
    "link file": ("geometry", "ffrobot link"),
    "scene file": ("analysis", "ffrobot solve"),
}


TOO_DEEP = re.compile(rf"^[ \t\[]*(?:[\w-]+[ \t]*\.[ \t]*){{{2 * DEEPEST}}}", re.MULTILINE)


def read_text(path: Path, kind: str) -> str:
    """Read UTF-8 text, with or without byte order mark, at `path`. Raises `InputError`, which calls the file `kind`."""
    try:
        text = read_bytes(path, kind).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if error.object.startswith(b"\x89HDF"):
            raise InputError(f"{path}: expected a {kind}", "an HDF5 file (see ffrobot info)") from None
        line = error.object.count(b"\n", 0, error.start) + 1
        found = f"the byte {error.object[error.start]:#x}: save the file as UTF-8"
        raise InputError(f"{path}: line {line}: expected a {kind} in UTF-8", found) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_csv(path: Path, kind: str) -> CsvTable:
    """Read the CSV file at `path`: see `parse_csv`. Raises `InputError`, whose message calls the file `kind`."""
    try:
        return parse_csv(read_text(path, kind))
    except csv.Error as error:
        raise InputError(f"{path}: cannot read the {kind}: {error}") from None


def read_labelled_csv(path: Path, kind: str) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Read the CSV file at `path` as `read_csv`: its header, and the cells of each line by column.

    Raises `InputError`, also for a line with more or fewer cells than columns.
    """
    header, rows = read_csv(path, kind)
    for line, row in rows:
        if len(row) != len(header):
            raise InputError(
                f"{path}: line {line}: expected {len(header)} cells with commas, semicolons or tabs between them, as"
                " the header has",
                len(row),
            )
    return header, [(line, dict(zip(header, row, strict=True))) for line, row in rows]


def read_bytes(path: Path, kind: str) -> bytes:
    """Read the bytes of the file at `path`. Raises `InputError`, whose message calls the file `kind`."""
    check_regular(path)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: {kind} not found") from None
    except (OSError, ValueError) as error:  # no name of a file at all
        raise InputError(f"{path}: cannot read the {kind}: {getattr(error, 'strerror', None) or error}") from None


def load_toml(path: Path, kind: str) -> dict[str, Any]:
    """Parse the TOML file at `path`. Raises `InputError`, whose message calls it `kind` ("link file", …)."""
    data = parse_toml(read_text(path, kind), path, kind)
    for other, (key, command) in _KINDS.items():
        if kind in _KINDS and key in data and _KINDS[kind][0] not in data:
            raise InputError(f"{path}: expected a {kind}", f"a {other} (is it for {command}?)")
    return data


def parse_toml(text: str, path: Path, kind: str) -> dict[str, Any]:
    """Parse the `text` of the TOML file at `path`. Raises `InputError` for errors and values beyond all limits."""
    try:
        if TOO_DEEP.search(text):  # which would take tomllib the square of its length
            raise RecursionError
        data = tomllib.loads(text)
    except RecursionError:
        raise InputError(
            f"{path}: not a valid TOML {kind}: expected at most {DEEPEST} tables and lists within each other"
        ) from None
    except ValueError as error:  # TOMLDecodeError; and an integer of thousands of digits, which Python refuses to read
        about = str(error) if isinstance(error, tomllib.TOMLDecodeError) else "a whole number of too many digits"
        raise InputError(f"{path}: not a valid TOML {kind}: {about}") from None
    check_limits(data, path)
    return data


def check_limits(data: dict[str, Any], path: Path) -> None:
    """Raise `InputError`, a line each, for values that no file may hold: see `tables.beyond_limits`."""
    refuse(list(beyond_limits(data))[:10], path)


def toml_text(data: Mapping[str, Any]) -> str:
    """`data` as text of a TOML file: plain keys first, then tables, then lists of tables."""
    plain = {key: value for key, value in data.items() if not isinstance(value, Mapping) and not _is_tables(value)}
    parts = ["\n".join(_lines(plain))] if plain else []
    for key, value in data.items():
        if isinstance(value, Mapping):
            parts.append("\n".join([f"[{toml_key(key)}]", *_lines(value)]))
        elif _is_tables(value):
            parts += ["\n".join([f"[[{toml_key(key)}]]", *_lines(entry)]) for entry in value]
    return "\n\n".join(parts) + "\n"


def toml_line(key: str, value: object) -> str:
    """A key with its value, in one line of TOML."""
    return f"{toml_key(key)} = {_value(value)}"


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(entry, Mapping) for entry in value)


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [toml_line(key, value) for key, value in table.items()]


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_lines(value))} }}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    raise TypeError(f"no TOML for {type(value).__name__}")


def toml_key(key: str) -> str:
    """`key` as TOML writes it, in quotes where needed."""
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else _value(key)
