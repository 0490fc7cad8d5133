"""A results file as it lies on the disk: datasets, groups and attributes by name."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, Self

import h5py

from ..common.arrays import Array
from ..common.checksum import sealed
from ..common.errors import InputError, did_you_mean, quoted
from ..common.files import write_atomically
from ..common.hdf5 import blaming, numbers, open_checked

NUMBER = re.compile(r"(\d+)")
COLUMN = re.compile(r"(?P<dataset>.*?)\[(?P<column>\d+)\]")


class _Attributes(dict[str, Any]):
    """Attributes of a group, which messages call `where`; `InputError` for one that it does not have."""

    def __init__(self, where: str, values: Mapping[str, Any]) -> None:
        super().__init__(values)
        self._where = where

    def __missing__(self, name: str) -> Any:
        raise InputError(f'{self._where}: expected the attribute "{name}"', "none")


class Datasets:
    """An open HDF5 file with a scene; datasets are named as in the file: `inverse/points/link2.tip/position`.

    Attributes:
        path: of the file, as messages call it.
        scene, scene_text: the scene file, as TOML has it and as text.
        asked: names of datasets and groups in analyses that were read.
    """

    def _open(self, path: Path, content: PathLike[str] | str | h5py.h5f.FileID) -> None:
        self.path, self._in_memory = path, isinstance(content, h5py.h5f.FileID)
        self.asked = set[str]()
        try:
            self._file = h5py.File(content, "r") if isinstance(content, h5py.h5f.FileID) else open_checked(path)
        except OSError as error:
            reason = "no such file" if not self.path.exists() else f"not a readable HDF5 file ({error})"
            if self.path.suffix.lower() == ".toml" and self.path.exists():
                reason = f"a scene or link file: solve it first (ffrobot solve {path}, which writes .results.h5)"
            raise InputError(f"{path}: expected a results file", reason) from None
        if "scene" not in self._file.attrs:
            self._file.close()
            raise InputError(f"{path}: expected a results file", "an HDF5 file without a scene")
        with blaming(path):
            self.scene_text: str = self._file.attrs["scene"]
            self.scene: dict[str, Any] = tomllib.loads(self.scene_text)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the HDF5 file; its datasets cannot be read afterwards."""
        self._file.close()

    def keys(self) -> list[str]:
        """Names of all datasets, for `results[NAME]`."""
        names: list[str] = []
        self._file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        return [name for name in names if "/resume/" not in name]

    def _ipython_key_completions_(self) -> list[str]:
        """What an interactive session offers behind `results["`."""
        return self.keys()

    def __contains__(self, dataset: object) -> bool:
        return isinstance(dataset, str) and self.has(dataset)

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def save(self, path: PathLike[str] | str) -> Path:
        """Write the results, or a copy of their file, to the file `path`.

        Raises `InputError` if it would overwrite a file of another kind, `SolveError` if it cannot be written.
        """
        self._file.flush()
        content: bytes = self._file.id.get_file_image()
        write_atomically(Path(path), sealed(content), "results file")
        return Path(path)

    @contextmanager
    def on_disk(self) -> Iterator[Path]:
        """Context with the path of the results file; of results in memory of a temporary one."""
        if not self._in_memory:
            yield self.path
            return
        with TemporaryDirectory() as folder:
            yield self.save(Path(folder) / f"{Path(self.path).stem.strip('<>').replace(' ', '_')}.results.h5")

    def attributes(self, group: str) -> Mapping[str, Any]:
        """Attributes of an analysis or of one of its groups, such as `inverse/pzt/link1`.

        Raises `InputError` where there is no such group, or no such attribute.
        """
        self.asked |= {group} if "/" in group.strip("/") else set()
        if group not in self._file:
            raise InputError(f'{self.path}: expected the group "{group}"', f"none{self._near(group)}")
        return _Attributes(f"{self.path}: {group}", dict(self._file[group].attrs))

    def settling(self, point: str, option: str = "settling") -> tuple[str, Mapping[str, Any]]:
        """First analysis with residual vibration of "BODY.POINT" (or of "ANALYSIS/BODY.POINT"), and its numbers.

        Raises `InputError`, with the `option` that names the point, where there is none.
        """
        analysis, slash, name = point.rpartition("/")
        groups = [analysis] if slash else list(self._file)
        known = [f"{of}/{one}" for of in self._file for one in self.names(f"{of}/settling")]
        for of in groups:
            if f"{of}/{name}" in known:
                return of, self.attributes(f"{of}/settling/{name}")
        points = quoted(known) if known else "none: paths move to the end of their analyses"
        raise InputError(
            f'{option}: expected "BODY.POINT" or "ANALYSIS/BODY.POINT" with residual vibration, {points}',
            f'"{point}"{did_you_mean(point, known)}',
        )

    def names(self, group: str) -> list[str]:
        """Names in a group such as `inverse/points`, in natural order; empty if the file does not have the group."""
        return sorted(self._file.get(group, ()), key=_natural)

    def group(self, name: str) -> h5py.Group:
        """h5py group of an analysis."""
        self.asked.add(name)
        return self._file[name]

    def has(self, dataset: str) -> bool:
        """Whether the file contains this dataset or group."""
        return dataset in self._file

    def __getitem__(self, dataset: str) -> Array:
        """Dataset with its shape in the file, in SI units. Raises `InputError` if absent."""
        item = self._file.get(dataset)
        self.asked.add(dataset)
        if isinstance(item, h5py.Group):
            inside = quoted(f"{dataset}/{name}" for name in item)
            raise InputError(f"{self.path}: expected the name of a dataset", f'the group "{dataset}" of {inside}')
        if not isinstance(item, h5py.Dataset):
            raise InputError(f'{self.path}: expected the dataset "{dataset}"', f"none{self._near(dataset)}")
        return numbers(item, f"{self.path}: {dataset}")

    def time(self, dataset: str) -> Array:
        """Output times (T,), in s, of the analysis that `dataset` belongs to; the analysis' own name does, too.

        For `control/` of closed-loop runs, the times of its samples.
        """
        analysis, *inside = dataset.strip("/").split("/")
        return self[f"{analysis}/control/time" if inside[:1] == ["control"] else f"{analysis}/time"]

    def data(self, name: str) -> Array:
        """A dataset in SI units as (T, columns), or one column, `name[k]`, as (T, 1). Raises `InputError` if absent."""
        match = COLUMN.fullmatch(name)
        dataset = match["dataset"] if match else name
        values = self[dataset]
        values = values.reshape(len(values), -1)
        if match is None:
            return values
        k = int(match["column"])
        if k >= values.shape[1]:
            raise InputError(f'{self.path}: expected column {k} of "{dataset}"', f"{values.shape[1]} columns")
        return values[:, k : k + 1]

    def peak(self, name: str) -> tuple[float, float]:
        """The largest size of a history, in its unit, and when it has that, s; between outputs if the file has that.

        Of all columns, of one of them, `name[k]`, or of the length of a deflection or a reaction.
        """
        from .peaks import peak_of

        match = COLUMN.fullmatch(name)
        dataset = match["dataset"] if match else name
        self[dataset]  # raises where there is none
        return peak_of(self._file[dataset], self.time(dataset), int(match["column"]) if match else None)

    def _near(self, dataset: str) -> str:
        known: list[str] = []
        self._file.visit(known.append)
        return did_you_mean(dataset, known)


def _natural(name: str) -> list[str | int]:
    """What sorts names as people do: text and whole numbers in turn."""
    return [int(part) if part.isdecimal() else part for part in NUMBER.split(name)]
