"""Reading TOML files: whatever is wrong with one comes as an `InputError` in its name."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import InputError
from .outputs import check_regular
from .tables import DEEPEST, beyond_limits

# The key that makes a file one of its kind, and the command for it.
_KINDS: Mapping[str, tuple[str, str]] = {
    "link file": ("geometry", "ffrobot link"),
    "scene file": ("analysis", "ffrobot solve"),
}


def read_text(path: Path, kind: str) -> str:
    """The text of the file at `path`, UTF-8 with or without a byte order mark; messages call it `kind`."""
    try:
        text = read_bytes(path, kind).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: cannot read the {kind}: {error}") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_bytes(path: Path, kind: str) -> bytes:
    """The content of the file at `path`; messages call it `kind`."""
    check_regular(path)
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: {kind} not found") from None
    except (OSError, ValueError) as error:  # no name of a file at all
        raise InputError(f"{path}: cannot read the {kind}: {getattr(error, 'strerror', None) or error}") from None


def load_toml(path: Path, kind: str) -> dict[str, Any]:
    """Parse the TOML file at `path`; `kind` ("link file", "scene file") is how the error message calls it."""
    data = parse_toml(read_text(path, kind), path, kind)
    for other, (key, command) in _KINDS.items():
        if kind in _KINDS and key in data and _KINDS[kind][0] not in data:
            raise InputError(f"{path}: expected a {kind}, found a {other} (is it for {command}?)")
    return data


def parse_toml(text: str, path: Path, kind: str) -> dict[str, Any]:
    """The tables in the `text` of the file at `path`. Raises `InputError` for what no file may hold."""
    try:
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
    """Raise `InputError`, a line for each, for what no key of any file may hold: see `tables.beyond_limits`."""
    if found := list(beyond_limits(data)):
        raise InputError("\n".join(f"{path}: {line}" for line in found[:10]))
