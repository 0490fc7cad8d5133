"""Names of other programs as scenes may have them, and scenes as TOML text for readers."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from ...common.keys import LONGEST_NAME

FORBIDDEN = str.maketrans({"/": "_", ".": "_"})


class Names:
    """Names in one list, each once: the same for the same original, with the fewest changes that the rules ask for.

    Attributes:
        changed: originals whose name is another one now.
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)
        self._of = dict[str, str]()

    def __getitem__(self, original: str) -> str:
        if original not in self._of:
            self._of[original] = self._free(_allowed(original))
        return self._of[original]

    @property
    def changed(self) -> dict[str, str]:
        """The new name of each original that could not stay."""
        return {original: name for original, name in self._of.items() if original != name}

    def _free(self, name: str) -> str:
        candidate, number = name, 2
        while candidate in self._taken:
            candidate, number = f"{name}_{number}", number + 1
        self._taken.add(candidate)
        return candidate


def _allowed(name: str) -> str:
    """Without what `common.keys.check_name` refuses."""
    printable = "".join(c if c.isprintable() else "_" for c in name.translate(FORBIDDEN)).strip()
    return printable[: LONGEST_NAME - 4] if len(printable) > LONGEST_NAME else printable or "_"


def toml_text(data: Mapping[str, Any]) -> str:
    """The text of a file: plain keys first, then tables, then lists of tables."""
    plain = {key: value for key, value in data.items() if not isinstance(value, Mapping) and not _is_tables(value)}
    parts = ["\n".join(_lines(plain))] if plain else []
    for key, value in data.items():
        if isinstance(value, Mapping):
            parts.append("\n".join([f"[{_key(key)}]", *_lines(value)]))
        elif _is_tables(value):
            parts += ["\n".join([f"[[{_key(key)}]]", *_lines(entry)]) for entry in value]
    return "\n\n".join(parts) + "\n"


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(entry, Mapping) for entry in value)


def _lines(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_value(value)}" for key, value in table.items()]


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    raise TypeError(f"no TOML for {type(value).__name__}")


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    return key if bare else _value(key)
