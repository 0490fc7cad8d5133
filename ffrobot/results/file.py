"""Reading results files: datasets by name, attributes, and the modal bodies that the results rest on."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import TYPE_CHECKING, Any

import h5py

from ..common.arrays import Array
from ..common.checksum import sealed
from ..common.errors import InputError, did_you_mean, quoted
from ..common.extras import extras
from ..common.files import write_atomically
from ..common.hdf5 import blaming, numbers, open_checked
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import read_mass, read_modal_body
from ..mbs.scene.space import SPACES, Space

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..actuation.control.linear_model import LinearModel
    from ..mbs.quantities.stress import Recovery
    from .verdict import Verdict

FORMAT = "ffrobot-results"
COLUMN = re.compile(r"(?P<dataset>.*?)\[(?P<column>\d+)\]")


@dataclass(frozen=True)
class ModalFile:
    """The modal body file that a body of the scene came from, as it was then."""

    path: Path
    sha256: str
    input_hash: str


def status_in_words(attributes: Mapping[str, Any]) -> str:
    """How an analysis with these attributes ended, with the number of its warnings: "completed, 2 warnings"."""
    status, count = attributes["status"], len(attributes.get("warnings", ()))
    return f"{status}, {count} warning{'s' if count > 1 else ''}" if count else str(status)


class _Attributes(dict[str, Any]):
    """Attributes of a group, which messages call `where`; `InputError` for one that it does not have."""

    def __init__(self, where: str, values: Mapping[str, Any]) -> None:
        super().__init__(values)
        self._where = where

    def __missing__(self, name: str) -> Any:  # noqa: ANN401
        raise InputError(f'{self._where}: expected the attribute "{name}", found none')


class Results:
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

    def _open(self, path: Path, content: PathLike[str] | str | h5py.h5f.FileID) -> None:
        self.path, self._in_memory = path, isinstance(content, h5py.h5f.FileID)
        self._histories: dict[str, tuple[str, ...]] = {}  # by analysis: a walk through a file takes milliseconds
        try:
            self._file = h5py.File(content, "r") if isinstance(content, h5py.h5f.FileID) else open_checked(path)
        except OSError as error:
            reason = "no such file" if not self.path.exists() else f"not a readable HDF5 file ({error})"
            if self.path.suffix.lower() == ".toml" and self.path.exists():
                reason = f"a scene or link file: solve it first (ffrobot solve {path}, which writes .results.h5)"
            raise InputError(f"{path}: expected a results file, found {reason}") from None
        if "scene" not in self._file.attrs:
            self._file.close()
            raise InputError(f"{path}: expected a results file, found an HDF5 file without a scene")
        with blaming(path):
            self.scene_text: str = self._file.attrs["scene"]
            self.scene: dict[str, Any] = tomllib.loads(self.scene_text)

    def __enter__(self) -> Results:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

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

    def keys(self) -> list[str]:
        """Names of all datasets, as `results[…]` takes them."""
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
        """Write results that are in memory only to the file `path`, or a copy of those that are in one.

        Raises `InputError` where that would cost a file of another kind, `SolveError` where it cannot be written.
        """
        self._file.flush()
        content: bytes = self._file.id.get_file_image()
        write_atomically(Path(path), sealed(content), "results file")
        return Path(path)

    @contextmanager
    def on_disk(self) -> Iterator[Path]:
        """The file of the results; of those in memory a temporary one."""
        if not self._in_memory:
            yield self.path
            return
        with TemporaryDirectory() as folder:
            yield self.save(Path(folder) / f"{Path(self.path).stem.strip('<>').replace(' ', '_')}.results.h5")

    def close(self) -> None:
        """Close the file; nothing can be read afterwards."""
        self._file.close()

    @property
    def name(self) -> str:
        """Name of the scene."""
        return str(self.attributes("/")["name"])

    @property
    def space(self) -> Space:
        """The axes of the scene: x, y of planar ones, x, y, z of 3D ones."""
        return SPACES[str(self.scene.get("space", "planar"))]

    @property
    def ffrobot_version(self) -> str:
        """Version of the program that wrote the file."""
        return str(self.attributes("/")["ffrobot_version"])

    @property
    def skipped(self) -> list[str]:
        """What the solve left out, one line each."""
        return [str(line) for line in self.attributes("/")["skipped"]]

    @property
    def analyses(self) -> list[str]:
        """Names of the analyses that the file holds, in the order of the scene."""
        return [entry["name"] for entry in self.scene["analysis"] if entry["name"] in self._file]

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
        from .bodies import (
            read_modal,  # here, as below: what writes a group loads the core, which reading can do without
        )

        self[f"{analysis}/bodies/{body}/modal"]  # raises where there is none
        return read_modal(self._file[analysis], body)

    def stress_recovery(self, analysis: str, body: str) -> Recovery:
        """What stresses of a flexible body are computed from, for `mbs.quantities.stress`."""
        from .bodies import read_recovery

        self[f"{analysis}/bodies/{body}/modal"]  # raises where there is none
        return read_recovery(self._file[analysis], body)

    def linear(self, analysis: str) -> tuple[LinearModel, ...]:
        """The linear models of an analysis, one for each of its times. Raises `InputError` where it has none."""
        if not self.has(f"{analysis}/linear"):
            raise InputError(
                f'{self.path}: expected a linear analysis ({quoted(self._with_models())}), found "{analysis}"'
            )
        from .linear import read_linear

        return read_linear(self._file, analysis)

    def export_linear(self, analysis: str | None, path: Path) -> str:
        """Write the linear models of an analysis, the first that has any if not named, to .npz or .mat; its name."""
        from .linear import save_models

        name = self.linear_analysis(analysis)
        save_models(self.linear(name), path)
        return name

    def linear_analysis(self, analysis: str | None) -> str:
        """`analysis`, or the first that has linear models. Raises `InputError` where there is none."""
        known = self._with_models()
        if analysis is None and not known:
            raise InputError(f'{self.path}: expected an analysis of kind = "linear", found none')
        return analysis or known[0]

    def _with_models(self) -> list[str]:
        return [name for name in self.analyses if self.has(f"{name}/linear")]

    @property
    def warnings(self) -> dict[str, list[str]]:
        """Why results of an analysis may be wrong, or not mean what they seem to; by analysis, where there is any."""
        return self._texts("warnings")

    @property
    def notes(self) -> dict[str, list[str]]:
        """What is worth knowing of right results of an analysis; by analysis, where there is any."""
        return self._texts("notes")

    def _texts(self, kind: str) -> dict[str, list[str]]:
        told = {name: self.attributes(name).get(kind, ()) for name in self.analyses}
        return {name: [str(text) for text in texts] for name, texts in told.items() if len(texts)}

    @property
    def verdict(self) -> Verdict:
        """Of every analysis: can it be done, peaks and RMS of motors, deflection, stress, warnings, what to try next.

        `print(results.verdict)` is what `ffrobot solve` prints; `results.verdict["inverse"]` that of one analysis.
        """
        from .verdict import judge

        with blaming(self.path):
            return judge(self._file, self.analyses, self.scene)

    def attributes(self, group: str) -> Mapping[str, Any]:
        """Attributes of an analysis or of one of its groups, such as `inverse/pzt/link1`.

        Raises `InputError` where there is no such group, and when an attribute is asked for that it does not have.
        """
        if group not in self._file:
            raise InputError(f'{self.path}: expected the group "{group}", found none{self._near(group)}')
        return _Attributes(f"{self.path}: {group}", dict(self._file[group].attrs))

    def names(self, group: str) -> list[str]:
        """Names inside a group such as `inverse/points`; none when the file does not have it."""
        return list(self._file[group]) if group in self._file else []

    def has(self, dataset: str) -> bool:
        """Whether the file holds this dataset or group."""
        return dataset in self._file

    def time(self, dataset: str) -> Array:
        """Output times (T,), in s, of the analysis that `dataset` belongs to; the analysis' own name does, too.

        Of what is in `control/` of a closed loop, the times of its samples.
        """
        analysis, *inside = dataset.strip("/").split("/")
        return self[f"{analysis}/control/time" if inside[:1] == ["control"] else f"{analysis}/time"]

    def __getitem__(self, dataset: str) -> Array:
        """A dataset with the shape it has in the file. Raises `InputError` if absent."""
        item = self._file.get(dataset)
        if isinstance(item, h5py.Group):
            inside = quoted(f"{dataset}/{name}" for name in item)
            raise InputError(f'{self.path}: expected the name of a dataset, found the group "{dataset}" of {inside}')
        if not isinstance(item, h5py.Dataset):
            raise InputError(f'{self.path}: expected the dataset "{dataset}", found none{self._near(dataset)}')
        return numbers(item, f"{self.path}: {dataset}")

    def data(self, name: str) -> Array:
        """A dataset as (T, columns), or one of its columns, `name[k]`, as (T, 1). Raises `InputError` if absent."""
        match = COLUMN.fullmatch(name)
        dataset = match["dataset"] if match else name
        values = self[dataset]
        values = values.reshape(len(values), -1)
        if match is None:
            return values
        k = int(match["column"])
        if k >= values.shape[1]:
            raise InputError(f'{self.path}: expected column {k} of "{dataset}", found {values.shape[1]} columns')
        return values[:, k : k + 1]

    def peak(self, name: str) -> tuple[float, float]:
        """The largest size of a history and when it has that, s, between outputs too where the file says so.

        Of all columns, of one of them, `name[k]`, or of the length of a deflection or a reaction.
        """
        from .peaks import peak_of

        match = COLUMN.fullmatch(name)
        dataset = match["dataset"] if match else name
        self[dataset]  # raises where there is none
        return peak_of(self._file[dataset], self.time(dataset), int(match["column"]) if match else None)

    def columns(self, analysis: str) -> dict[str, Array]:
        """Everything an analysis holds over time, one (T,) array each.

        The name is the dataset's inside the analysis, with the column where it has several:
        `points/link2.tip/position[0]`.
        """
        found: dict[str, Array] = {}
        for name in self.histories(analysis):
            values = self[f"{analysis}/{name}"]
            columns = values.reshape(len(values), -1)
            labels = [name] if values.ndim == 1 else [f"{name}[{k}]" for k in range(columns.shape[1])]
            found.update(zip(labels, columns.T, strict=True))
        return found

    def histories(self, analysis: str) -> list[str]:
        """Names, inside an analysis, of its datasets with a row for each output."""
        if analysis not in self._histories:
            self._histories[analysis] = tuple(self._names_of_histories(analysis))
        return list(self._histories[analysis])

    def _names_of_histories(self, analysis: str) -> list[str]:
        found: list[str] = []
        outputs = len(self.time(analysis))

        def collect(name: str, item: h5py.Dataset | h5py.Group) -> None:
            if isinstance(item, h5py.Dataset) and item.shape[:1] == (outputs,) and not name.startswith("resume/"):
                found.append(name)

        self._file[analysis].visititems(collect)
        return found

    def frame(self, analysis: str) -> DataFrame:
        """`columns` of an analysis as a table of pandas, by time (s)."""
        with extras():
            from pandas import DataFrame

        return DataFrame(self.columns(analysis)).set_index("time")

    def _near(self, dataset: str) -> str:
        known: list[str] = []
        self._file.visit(known.append)
        return did_you_mean(dataset, known)
