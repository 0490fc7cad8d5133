"""Libraries that only some runs need, as attributes of this module: each is imported when one of its names is used."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class _OnUse:
    """A library that is imported by the first use of a name; later uses find the name here."""

    def __init__(self, library: str) -> None:
        self._library = library

    def __getattr__(self, name: str) -> Any:
        value = getattr(import_module(self._library), name)
        setattr(self, name, value)
        return value


scipy: Any = _OnUse("scipy")
