"""Results of a scene: the file, and access to it by link and by analysis."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py

from .analyses import AnalysisAccess
from .links import LinkAccess

if TYPE_CHECKING:
    from ..mbs.scene.space import Space

FORMAT = "ffrobot-results"


def status_in_words(attributes: Mapping[str, Any]) -> str:
    """How an analysis with these attributes ended, with the number of its warnings: "completed, 2 warnings"."""
    status, count = attributes["status"], len(attributes.get("warnings", ()))
    return f"{status}, {count} warning{'s' if count > 1 else ''}" if count else str(status)


class Results(LinkAccess, AnalysisAccess):
    """An open results file. Datasets are named as in the file: `inverse/points/link2.tip/position`.

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
        """What the solve left out, one line each."""
        return [str(line) for line in self.attributes("/")["skipped"]]
