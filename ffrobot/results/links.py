"""Access to results by link: the modal body behind it, its modal coordinates, what its stresses are computed from."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..common.arrays import Array
from ..common.errors import InputError, did_you_mean
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import read_mass, read_modal_body
from .datasets import Datasets

if TYPE_CHECKING:
    from ..mbs.quantities.stress import Recovery


@dataclass(frozen=True)
class ModalFile:
    """The modal body file that a body of the scene came from, as it was then."""

    path: Path
    sha256: str
    input_hash: str


class LinkAccess(Datasets):
    """What a results file has of its links."""

    @property
    def modal_files(self) -> dict[str, ModalFile]:
        """The file behind each flexible body of the scene."""
        entries = json.loads(self.attributes("/")["modal_bodies"]).items()
        return {name: ModalFile(Path(e["path"]), e["sha256"], e["input_hash"]) for name, e in entries}

    def modal_body(self, name: str) -> ModalBody:
        """The modal body that body `name` was solved with.

        Its file is looked for where it was, then beside the results; its hash tells whether it is the same.
        Raises `InputError` where `name` is no flexible body, or its file cannot be found.
        """
        return read_modal_body(self._modal_path(name))

    def modal_mass(self, name: str) -> float:
        """Its mass, kg, without reading the rest of the file."""
        return read_mass(self._modal_path(name))

    def _modal_path(self, name: str) -> Path:
        files = self.modal_files
        if name not in files:
            raise InputError(f'{self.path}: expected a flexible body, found "{name}"{did_you_mean(name, files)}')
        file = files[name]
        for path in (file.path, self.path.parent / file.path.name):  # a folder that has been moved keeps both
            if path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == file.sha256:
                return path
        found = "another" if file.path.is_file() else "none"
        raise InputError(f'{file.path}: expected the modal body file that "{name}" was solved with, found {found}')

    def modal(self, analysis: str, body: str) -> Array:
        """P (T, n) of a flexible body in the modes of its modal body file, however many of them the solve used."""
        from .motion import (
            read_modal,  # here, as below: what writes a group loads the core, which reading can do without
        )

        self[f"{analysis}/bodies/{body}/modal"]  # raises where there is none
        return read_modal(self._file[analysis], body)

    def stress_recovery(self, analysis: str, body: str) -> Recovery:
        """What stresses of a flexible body are computed from, for `mbs.quantities.stress`."""
        from .motion import read_recovery

        self[f"{analysis}/bodies/{body}/modal"]  # raises where there is none
        return read_recovery(self._file[analysis], body)
