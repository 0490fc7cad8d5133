"""Everything a scene is made from: the files it names, directly or through its links, and fingerprints of them all."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..common.errors import InputError
from ..common.python_files import sha256_of
from ..common.toml_files import parse_toml, read_text
from ..common.version import VERSION, digest_of_content
from ..mesh.included import files_of as files_with_included

FILE_KEYS = {"link", "modal", "waypoints", "file", "python", "table", "repeat_steps"}
"""Keys of scene and link files whose text names a file, "FILE.py:FUNCTION" of Python."""

PROGRAM = "ffrobot"
"""Stands for the program's version among fingerprints."""


def named_files(data: Any, folder: Path) -> Iterator[Path]:
    """Yield the files that tables (`data`) of a file in `folder` name, and those that link files among them name."""
    for key, file in _named(data, folder):
        yield from files_with_included(file)
        if key == "link":  # whose own links, which are none, are not followed: they might lead in a circle
            for _, part in _named(read_tables(file), file.parent):
                yield from files_with_included(part)


def _named(data: Any, folder: Path) -> Iterator[tuple[str, Path]]:
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(value, dict | list):
            yield from _named(value, folder)
        elif key in FILE_KEYS and isinstance(value, str):
            yield key, folder / (value.rpartition(":")[0] if key == "python" else value)


def python_files(tables: Mapping[str, Any], folder: Path) -> list[Path]:
    """The Python files that the tables of a scene file in `folder` name."""
    return [file for key, file in _named(dict(tables), folder) if key == "python"]


def read_tables(path: Path) -> dict[str, Any]:
    """Tables of a TOML file; {} where it cannot be read, which is an error elsewhere."""
    try:
        return parse_toml(read_text(path, "file"), path, "file")
    except InputError:
        return {}


def files_of(path: Path) -> list[Path]:
    """The scene or link file at `path` and all files that it names, as far as they can be found."""
    return [path, *named_files(read_tables(path), path.parent)]


def fingerprints(scene: Mapping[str, Any], path: Path) -> dict[str, str]:
    """SHA-256 by path of `path`, with the tables `scene`, and of all files that it names; the version by `PROGRAM`.

    Of TOML files that of their tables: comments change nothing.
    """
    files = dict.fromkeys(named_files(dict(scene), path.parent))
    prints = {PROGRAM: VERSION, str(path): digest_of_content(scene)}
    return prints | {os.path.normpath(file): digest_of_file(file) for file in files}


def digest_of_file(path: Path) -> str:
    """SHA-256 of a file's content; "" where it cannot be read."""
    if path.suffix == ".toml" and (tables := read_tables(path)):
        return digest_of_content(tables)
    return sha256_of(path)


def changed(then: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """Return the names of files (without folders), or `PROGRAM`, whose fingerprints differ."""
    names = sorted(name for name in then.keys() | now.keys() if then.get(name) != now.get(name))
    return list(dict.fromkeys(name if name == PROGRAM else Path(name).name for name in names))
