"""A TOML file with some values replaced, its comments and order kept where that is possible."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from copy import deepcopy

import tomli_w

from ..sweep.files import set_key

Key = tuple[str, ...]

VALUE = r'("[^"\n]*"|[^\s,}\]#]+)'  # a text or a number


def with_values(text: str, changes: Mapping[Key, float | str]) -> str:
    """The TOML `text` with other values of keys that are in it.

    A value is replaced where it stands, which parsing the outcome proves; where no such place is found, as of an entry
    of a list, the tables are written anew, without comments.
    """
    for key, value in changes.items():
        wanted = deepcopy(tomllib.loads(text))
        set_key(wanted, key, value)
        text = _edited(text, key[-1], json.dumps(value, ensure_ascii=False), wanted) or tomli_w.dumps(wanted)
    return text


def _edited(text: str, name: str, value: str, wanted: Mapping[str, object]) -> str:
    """The text with one entry `name = …` replaced such that it says what is `wanted`; empty where none does."""
    for match in re.finditer(rf"(?<![\w.-]){re.escape(name)}\s*=\s*{VALUE}", text):
        edited = text[: match.start(1)] + value + text[match.end(1) :]
        with suppress(tomllib.TOMLDecodeError):
            if tomllib.loads(edited) == wanted:
                return edited
    return ""
