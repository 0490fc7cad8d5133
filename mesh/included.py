"""Files of meshes that consist of several, as Abaqus and Nastran decks do: their lines, and which files these are.

NumPy is not needed: input hashes are made of `files_of`.
"""

import math
import re
from collections.abc import Callable, Iterator
from glob import escape
from pathlib import Path
from typing import NamedTuple

from ..common.errors import InputError
from ..common.tables import shown

_ABAQUS = re.compile(  # the keyword line goes on after a comma at its end
    r"""^[ \t]*\*(?:[^*\n,]|,[ \t]*+(?:\r?\n)?+)*?\bINP(?:UT?)?[ \t]*=[ \t]*["']?([^"',\r\n]+)""",
    re.MULTILINE | re.IGNORECASE,
)
_NASTRAN = re.compile(  # unquoted, a name ends with its line
    r"""^[ \t]*INCLUDE\b[ \t]*["']?((?<=["'])[^"']+|[^"'$\r\n]+)""", re.MULTILINE | re.IGNORECASE
)
_XDMF = re.compile(r">\s*([^<>:]+?)\s*:")
_REFERENCES = {
    ".inp": _ABAQUS,
    **dict.fromkeys((".bdf", ".nas", ".fem", ".dat"), _NASTRAN),
    **dict.fromkeys((".xdmf", ".xmf"), _XDMF),
}
# What lies beside files of TetGen and of FEniCS, whose readers take it without a word in the file.
_BESIDE = {".ele": "{}.node", ".node": "{}.ele", ".xml": "{}_*.xml"}
DEEPEST = 20


class Line(NamedTuple):
    """A line of a deck: its `text` without the line end, and its `place` for messages, "line 12" or "FILE, line 12"."""

    text: str
    place: str


def files_of(path: Path) -> list[Path]:
    """`path` and the existing files that it includes or that belong to it, in order."""
    pattern = _REFERENCES.get(path.suffix.lower())
    files: dict[Path, None] = {}

    def add(file: Path) -> None:
        files[file] = None
        if pattern is None or not file.is_file():
            return
        for name in pattern.findall(text_of(file)):
            other = included(name, file, path)
            if other is not None and other not in files:
                add(other)

    add(path)
    if beside := _BESIDE.get(path.suffix.lower()):
        files |= dict.fromkeys(sorted(path.parent.glob(beside.format(escape(path.stem)))))
    return list(files)


def text_of(file: Path) -> str:
    """The text of a file in UTF-8, or in UTF-16 if a byte order mark declares it."""
    content = file.read_bytes()
    encoding = "utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    return content.decode(encoding, errors="replace")


def included(name: str, file: Path, first: Path) -> Path | None:
    """Resolve a file `name` included by `file`: beside it, or beside the `first` of the deck; None where missing.

    Names may have backslashes between folders, as Windows writes them.
    """
    name = re.sub(r"\s*[\r\n]\s*", "", name).strip().replace("\\", "/")
    try:
        return next((path for path in (file.parent / name, first.parent / name) if name and path.is_file()), None)
    except (OSError, ValueError):  # no name of a file at all
        return None


def lines_of(first: Path, include: Callable[[Iterator[str], str], str | None]) -> Iterator[Line]:
    """Yield the lines of a deck, those of included files in place of the line that includes them.

    `include`(following lines, line) returns the name of the file that the line includes, or None. Raises `InputError`
    for a file that is missing, includes itself, or is nested too deeply.
    """

    def of(file: Path, within: tuple[Path, ...]) -> Iterator[Line]:
        text = text_of(file)
        number = 0

        def counted() -> Iterator[str]:
            nonlocal number
            for line in re.split(r"\r\n|\n|\r", text):
                number += 1
                yield line

        following = counted()
        for line in following:
            place = f"line {number}" if file == first else f"{file.name}, line {number}"
            name = include(following, line)
            if name is None:
                yield Line(line, place)
                continue
            other = included(name, file, first)
            if other is None:
                raise InputError(f"{place}: expected a file to include", f"none called {name}")
            if other in within or len(within) > DEEPEST:
                raise InputError(f"{place}: expected files that do not include themselves", f"{name} again")
            yield from of(other, (*within, other))

    return of(first, (first,))


def number_of(token: str, place: str) -> float:
    """Read a number as Fortran writes it: 1.5, 1.D-3, and Nastran's 1.5-3. Raises `InputError`, with `place`."""
    try:
        value = float(token)
    except ValueError:
        exponent = re.fullmatch(r"([+-]?(?:\d+\.?\d*|\.\d+))[DdEe]?([+-]?\d+)", token.strip())
        value = float(f"{exponent[1]}e{exponent[2]}") if exponent else math.nan
    if not math.isfinite(value):
        raise InputError(f"{place}: expected a finite number", f'"{shown(token.strip())}"')
    return value


def whole_of(token: str, place: str) -> int:
    """Read a whole number. Raises `InputError`, with `place`."""
    try:
        return int(token)
    except ValueError:
        raise InputError(f"{place}: expected a whole number", f'"{token}"') from None
