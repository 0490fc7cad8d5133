"""Where the keys of a link are: in a link file, or elsewhere, as a table of a scene or a dictionary of Python."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..common.toml_files import load_toml


@dataclass(frozen=True)
class LinkTable:
    """Content of a link file in memory."""

    keys: Mapping[str, Any]
    path: Path  # name in messages; files that the keys name are in its folder


LinkSource = Path | LinkTable
"""A link file, or its content."""


def link_path(source: LinkSource) -> Path:
    """The path of a link for messages."""
    return source.path if isinstance(source, LinkTable) else source


def link_keys(source: LinkSource) -> dict[str, Any]:
    """The content of a link file, unchecked. Raises `InputError` where it cannot be read."""
    return deepcopy(dict(source.keys)) if isinstance(source, LinkTable) else load_toml(source, "link file")
