"""A link file whose natural frequencies are fitted."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.toml_files import load_toml, read_text
from ..fe_models.link import computed_modal_body
from ..fe_models.link_file import LinkTable
from ..fe_models.link_records import FAMILIES
from ..sweep.files import set_key, value_of
from .toml_edit import Key, with_values


class LinkTarget:
    """The link file at `path`: its eigenmodes under its reference condition."""

    families: tuple[str, ...] = FAMILIES

    def __init__(self, path: Path) -> None:
        self._path = path
        self._tables = load_toml(path, "link file")

    def start(self, key: Key) -> object:
        """What the file says at `key`; None where it is not given."""
        return value_of(self._tables, key)

    def modes(self, changes: dict[Key, float]) -> tuple[tuple[str, ...], Array]:
        """Families and frequencies (Hz) of the eigenmodes, the lowest first, with some values changed."""
        tables = deepcopy(self._tables)
        for key, value in changes.items():
            set_key(tables, key, value)
        body = computed_modal_body(LinkTable(tables, self._path))
        return body.family[: body.eigenmode_count], body.frequency[: body.eigenmode_count]

    def files(self, changes: dict[Key, float], output: Path | None) -> dict[Path, str]:
        """The text of the new link file, by where it goes."""
        path = output or fitted_name(self._path)
        if path.parent.resolve() != self._path.parent.resolve():
            raise InputError(
                f"{path}: output: expected a file next to {self._path}, to which its file names are relative"
            )
        return {path: with_values(read_text(self._path, "link file"), dict(changes))}


def fitted_name(path: Path, more: str = "") -> Path:
    """LINK.fitted.toml of LINK.toml, `more` before the ending."""
    return path.with_name(f"{path.stem}{more}.fitted.toml")
