"""Reading what figures need of a results file."""

from __future__ import annotations

import csv
import re
import tomllib
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..validation import did_you_mean

Array = NDArray[np.float64]

COLUMN = re.compile(r"(?P<dataset>.*?)\[(?P<column>\d+)\]")


class Results:
    """An open results file. Datasets are named as in the file: `inverse/points/link2.tip/position`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = h5py.File(path, "r")
        except OSError as error:
            reason = "no such file" if not path.exists() else f"not a readable HDF5 file ({error})"
            raise InputError(f"{path}: expected a results file, found {reason}") from None
        if "scene" not in self._file.attrs:
            self._file.close()
            raise InputError(f"{path}: expected a results file, found an HDF5 file without a scene")
        self.scene: dict[str, Any] = tomllib.loads(self._file.attrs["scene"])

    def __enter__(self) -> Results:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def analyses(self) -> list[str]:
        """Names of the analyses that the file holds, in the order of the scene."""
        return [entry["name"] for entry in self.scene["analysis"] if entry["name"] in self._file]

    def names(self, group: str) -> list[str]:
        """Names inside a group such as `inverse/points`; none when the file does not have it."""
        return list(self._file[group]) if group in self._file else []

    def has(self, dataset: str) -> bool:
        """Whether the file holds this dataset."""
        return dataset in self._file

    def time(self, dataset: str) -> Array:
        """Output times (T,), in s, of the analysis that `dataset` belongs to."""
        return self.data(dataset.strip("/").split("/")[0] + "/time")[:, 0]

    def data(self, name: str) -> Array:
        """A dataset as (T, columns), or one of its columns, `name[k]`, as (T, 1). Raises `InputError` if absent."""
        match = COLUMN.fullmatch(name)
        dataset = match["dataset"] if match else name
        item = self._file.get(dataset)
        if not isinstance(item, h5py.Dataset):
            raise InputError(f'{self.path}: expected the dataset "{dataset}", found none{self._near(dataset)}')
        values: Array = np.asarray(item, dtype=float)
        values = values.reshape(len(values), -1)
        if match is None:
            return values
        k = int(match["column"])
        if k >= values.shape[1]:
            raise InputError(f'{self.path}: expected column {k} of "{dataset}", found {values.shape[1]} columns')
        return values[:, k : k + 1]

    def _near(self, dataset: str) -> str:
        known: list[str] = []
        self._file.visit(known.append)
        return did_you_mean(dataset, known)


def read_points(path: Path, column: str) -> tuple[Array, Array]:
    """Times and values of one column of a CSV file whose first column is the time; lines with # are comments."""
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    rows = list(csv.reader(lines))
    if not rows or column not in rows[0]:
        header = rows[0] if rows else []
        raise InputError(f'{path}: expected the column "{column}", found {header}')
    k = rows[0].index(column)
    try:
        return np.array([float(row[0]) for row in rows[1:]]), np.array([float(row[k]) for row in rows[1:]])
    except (ValueError, IndexError) as error:
        raise InputError(f'{path}: expected numbers in the column "{column}": {error}') from None
