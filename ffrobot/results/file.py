"""Results of a scene: the file, and access to it by link and by analysis."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py

from ..common.arrays import Array
from ..common.errors import InputError, check_known
from ..common.structs import struct
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import read_mass, read_modal_body
from .analyses import AnalysisAccess

if TYPE_CHECKING:
    from ..mbs.quantities.stress import Recovery
    from ..mbs.scene.space import Space


@struct
class ModalFile:
    """The modal body file that a body of the scene came from, as it was then."""

    path: Path
    sha256: str
    input_hash: str


FORMAT = "ffrobot-results"


def status_in_words(attributes: Mapping[str, Any]) -> str:
    """Return status and number of warnings from an analysis's attributes: "completed, 2 warnings"."""
    status, count = attributes["status"], len(attributes.get("warnings", ()))
    return f"{status}, {count} warning{'s' if count > 1 else ''}" if count else str(status)


class Results(AnalysisAccess):
    """Open results file; datasets have the names of the file, such as `inverse/points/link2.tip/position`.

    Raises `InputError` where `path` is no results file.
    """

    def __init__(self, path: PathLike[str] | str) -> None:
        self._open(Path(path), path)

    @classmethod
    def from_image(cls, image: bytes, path: Path) -> Results:
        """Results whose file is in memory only; messages call them `path`."""
        results = cls.__new__(cls)
        # not as a file of Python's: HDF5 closes what is left open at the end, when Python is no more
        results._open(path, h5py.h5f.open_file_image(image))
        return results

    def __repr__(self) -> str:
        if not self._file:
            return f"Results({str(self.path)!r}), closed"
        lines = [f"Results({str(self.path)!r}): scene {self.name!r}"]
        for name in self.analyses:
            about, time = self.attributes(name), self.time(name)
            ended = f"{len(time)} outputs up to {time[-1]:g} s, {status_in_words(about)}"
            lines.append(f"  {name}: {about['kind']}, {ended}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """The verdict, as notebooks show it."""
        from html import escape

        if not self._file:
            return f"<p>{escape(repr(self))}</p>"
        return f"<p><b>{escape(self.name)}</b></p><pre>{escape(str(self.verdict))}</pre>"

    @property
    def name(self) -> str:
        """Name of the scene."""
        return str(self.attributes("/")["name"])

    @property
    def space(self) -> Space:
        """The axes of the scene: x, y of planar ones, x, y, z of 3D ones."""
        from ..mbs.scene.space import SPACES

        return SPACES[str(self.scene.get("space", "planar"))]

    @property
    def ffrobot_version(self) -> str:
        """Version of the program that wrote the file."""
        return str(self.attributes("/")["ffrobot_version"])

    @property
    def skipped(self) -> list[str]:
        """Parts of the scene that the model omits, one line each."""
        return [str(line) for line in self.attributes("/")["skipped"]]

    @property
    def modal_files(self) -> dict[str, ModalFile]:
        """The file behind each flexible body of the scene."""
        entries = json.loads(self.attributes("/")["modal_bodies"]).items()
        return {name: ModalFile(Path(e["path"]), e["sha256"], e["input_hash"]) for name, e in entries}

    def modal_body(self, name: str) -> ModalBody:
        """The modal body that body `name` was solved with.

        Sought at its path, then in the folder of the results; its hash has to be the same.
        Raises `InputError` where `name` is no flexible body, or its file cannot be found.
        """
        return read_modal_body(self._modal_path(name))

    def modal_mass(self, name: str) -> float:
        """Mass of a modal body, kg; reads no other data."""
        return read_mass(self._modal_path(name))

    def _modal_path(self, name: str) -> Path:
        files = self.modal_files
        check_known(name, files, f"{self.path}: expected a flexible body")
        file = files[name]
        for path in (file.path, self.path.parent / file.path.name):  # a folder that has been moved keeps both
            if path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == file.sha256:
                return path
        now = "another" if file.path.is_file() else "none"
        raise InputError(f'{file.path}: expected the modal body file that "{name}" was solved with', now)

    def modal(self, analysis: str, body: str) -> Array:
        """Modal coordinates (T, n), √kg·m, of a flexible body in all modes of its modal body file, kept or not."""
        # Here, as below: what writes a group loads the core, which reading can do without.
        from .motion import read_modal

        self[f"{analysis}/bodies/{body}/modal"]  # raises where there is none
        return read_modal(self._file[analysis], body)

    def stress_recovery(self, analysis: str, body: str) -> Recovery:
        """Data for the stresses of a flexible body, for `mbs.quantities.stress`."""
        from .motion import read_recovery

        self[f"{analysis}/bodies/{body}/modal"]  # raises where there is none
        return read_recovery(self._file[analysis], body)
