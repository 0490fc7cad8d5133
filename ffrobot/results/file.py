"""Results of a scene: the file with its datasets, groups and attributes by name, by analysis and by link."""

import hashlib
import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from os.path import isfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import h5py

from ..common.arrays import Array
from ..common.checksum import sealed
from ..common.errors import InputError, check_known, did_you_mean, quoted
from ..common.files import write_atomically
from ..common.hdf5 import blaming, datasets_in, fields_in, numbers, open_checked
from ..common.libraries import extras
from ..common.structs import struct
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import read_mass, read_modal_body

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

    from ..actuation.control.linear_model import LinearModel, SampledController, StateSpace
    from ..mbs.quantities.stress import Recovery
    from ..mbs.scene.space import Space
    from .verdict import Verdict


@struct
class ModalFile:
    """The modal body file of a body of the scene, with its hashes at the time of the run."""

    path: Path
    sha256: str
    input_hash: str


FORMAT = "ffrobot-results"


def status_in_words(attributes: Mapping[str, Any]) -> str:
    """Return status and number of warnings from an analysis's attributes: "completed, 2 warnings"."""
    status, count = attributes["status"], len(attributes.get("warnings", ()))
    return f"{status}, {count} warning{'s' if count > 1 else ''}" if count else str(status)


def dataset_and_column(name: str) -> tuple[str, int | None]:
    """Split `name[k]` into dataset and number of its column; None without a column."""
    match = re.fullmatch(r"(.*?)\[(\d+)\]", name)
    return (match[1], int(match[2])) if match else (name, None)


class _Attributes(dict[str, Any]):
    """Attributes of a group, which messages call `where`; `InputError` for one that it does not have."""

    def __init__(self, where: str, values: Mapping[str, Any]) -> None:
        super().__init__(values)
        self._where = where

    def __missing__(self, name: str) -> Any:
        raise InputError(f'{self._where}: expected the attribute "{name}"', "none")


class Results:
    """Open results file; datasets have the names of the file, such as `inverse/points/link2.tip/position`.

    Raises `InputError` where `path` is no results file.

    Attributes:
        path: of the file, for messages.
        scene, scene_text: the scene file, as tables and as text.
        asked: names of datasets and groups in analyses that were read so far.
    """

    def __init__(self, path: PathLike[str] | str, *, image: bytes | None = None) -> None:
        self.path, self._in_memory, self.asked = Path(path), image is not None, set[str]()
        self._histories = dict[str, list[str]]()
        try:
            # not as a file of Python's: HDF5 closes what is left open at the end, when Python is no more
            self._file = open_checked(self.path) if image is None else h5py.File(h5py.h5f.open_file_image(image), "r")
        except OSError as error:
            reason = "no such file" if not self.path.exists() else f"not a readable HDF5 file ({error})"
            if self.path.suffix.lower() == ".toml" and self.path.exists():
                reason = f"a scene or link file: solve it first (ffrobot solve {path}, which writes .results.h5)"
            raise InputError(f"{path}: expected a results file", reason) from None
        if "scene" not in self._file.attrs:
            self._file.close()
            raise InputError(f"{path}: expected a results file", "an HDF5 file without a scene")
        with blaming(self.path):
            self.scene_text: str = self._file.attrs["scene"]
            self.scene: dict[str, Any] = tomllib.loads(self.scene_text)

    @classmethod
    def from_image(cls, image: bytes, path: Path) -> "Results":
        """Results from the bytes of a file that exists only in memory; messages name it `path`."""
        return cls(path, image=image)

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
        from html import escape

        if not self._file:
            return f"<p>{escape(repr(self))}</p>"
        return f"<p><b>{escape(self.name)}</b></p><pre>{escape(str(self.verdict))}</pre>"

    @property
    def name(self) -> str:
        """Name of the scene."""
        return str(self.attributes("/")["name"])

    @property
    def space(self) -> "Space":
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
    def analyses(self) -> list[str]:
        """Names of the analyses in the file, in the order of the scene."""
        return [entry["name"] for entry in self.scene["analysis"] if entry["name"] in self._file]

    @property
    def verdict(self) -> "Verdict":
        """Answer of each analysis: feasibility, peaks and RMS of motors, deflection, stress, warnings and advice.

        `print(results.verdict)` prints the text of `ffrobot solve --verbose`; `results.verdict["inverse"]` is one
        analysis.
        """
        from .judging import judge

        with blaming(self.path):
            return judge(self._file, self.analyses, self.scene)

    @property
    def warnings(self) -> dict[str, list[str]]:
        """Reasons why results may be wrong or misleading, by analysis."""
        return self._texts("warnings")

    @property
    def notes(self) -> dict[str, list[str]]:
        """Remarks by analysis that are no warnings: on properties of the run, not on errors."""
        return self._texts("notes")

    def _texts(self, kind: str) -> dict[str, list[str]]:
        texts_of = {name: self.attributes(name).get(kind, ()) for name in self.analyses}
        return {name: [str(text) for text in texts] for name, texts in texts_of.items() if len(texts)}

    def histories(self, analysis: str) -> list[str]:
        """Names of the histories of an analysis: datasets over its outputs."""
        if analysis not in self._histories:  # a walk through a file takes ms
            outputs, found = (len(self.time(analysis)),), datasets_in(self._file[analysis])
            self._histories[analysis] = [
                name for name, item in found.items() if item.shape[:1] == outputs and not name.startswith("resume/")
            ]
        return list(self._histories[analysis])

    def columns(self, analysis: str) -> dict[str, Array]:
        """All histories of an analysis, one (T,) array in SI units each.

        By name in the analysis, with the column where there are several: `points/link2.tip/position[0]`.
        """
        by_label: dict[str, Array] = {}
        for name in self.histories(analysis):
            values = self[f"{analysis}/{name}"]
            columns = values.reshape(len(values), -1)
            labels = [name] if values.ndim == 1 else [f"{name}[{k}]" for k in range(columns.shape[1])]
            by_label.update(zip(labels, columns.T, strict=True))
        return by_label

    def frame(self, analysis: str) -> "DataFrame":
        """Histories of an analysis (see `columns`) as a pandas DataFrame, indexed by time (s)."""
        with extras():
            from pandas import DataFrame

        return DataFrame(self.columns(analysis)).set_index("time")

    def to_xarray(self, analysis: str) -> "Dataset":
        """All histories of an analysis as a Dataset of xarray, named as in the file: dimensions, units, coordinates.

        Dimension `time` (s), for `control/` of closed-loop runs `control/time`; further dimensions have the
        axes, modes, patches or components as coordinates. Attributes: `units`, `long_name`; of the Dataset those of the
        analysis. Raises `SolveError` where xarray is not installed.
        """
        with extras():
            from .labelled import labelled

            return labelled(self, analysis, self.histories(analysis))

    def linear(self, analysis: str) -> "tuple[LinearModel, ...]":
        """Linear models of an analysis, one for each of its times. Raises `InputError` if there is none."""
        if not self.has(f"{analysis}/linear"):
            raise InputError(
                f"{self.path}: expected a linear analysis ({quoted(self._with('linear'))})", f'"{analysis}"'
            )
        from .kinds import read_linear

        return read_linear(self._file, analysis)

    def controller(self, analysis: str) -> "SampledController":
        """Return controllers and observer of a closed-loop run at its start as one linear discrete-time system.

        Raises `InputError` where the analysis has none: no loop, or controllers that are not linear.
        """
        return self.controllers(analysis)[0]

    def controllers(self, analysis: str) -> "tuple[SampledController, ...]":
        """Return linear discrete-time controllers of a closed-loop run, one for each instant of a scheduled observer.

        All have the same states; interpolated matrices approximate those of the run. Raises `InputError` without any.
        """
        if not self.has(f"{analysis}/control/controller"):
            known = quoted(self._with("control/controller"))
            raise InputError(f"{self.path}: expected a closed loop of linear controllers ({known})", f'"{analysis}"')
        from .kinds import read_controllers

        return read_controllers(self._file, analysis)

    def state_spaces(self, analysis: str) -> "tuple[StateSpace, ...]":
        """Return linear models of an analysis, or the controller of a run. Raises `InputError` without either."""
        return self.controllers(analysis) if self.has(f"{analysis}/control") else self.linear(analysis)

    def linear_analysis(self, analysis: str | None) -> str:
        """Return `analysis`, or the first one with linear models. Raises `InputError` if there is none."""
        known = self._with("linear")
        if analysis is None and not known:
            loops = self._with("control/controller")
            hint = f"; the name of closed-loop control ({quoted(loops)}) selects its controllers" if loops else ""
            raise InputError(f'{self.path}: expected an analysis of kind = "linear"', f"none{hint}")
        return analysis or known[0]

    def export_linear(self, analysis: str | None, path: Path) -> str:
        """Write linear models (default: of the first analysis with any), or a loop's controller, to .npz or .mat.

        Returns the name of the analysis.
        """
        from .kinds import save_models

        save_models(self.state_spaces(name := self.linear_analysis(analysis)), path)
        return name

    def _with(self, group: str) -> list[str]:
        return [name for name in self.analyses if self.has(f"{name}/{group}")]

    @property
    def modal_files(self) -> dict[str, ModalFile]:
        """The file behind each flexible body of the scene."""
        entries = json.loads(self.attributes("/")["modal_bodies"]).items()
        return {name: ModalFile(Path(e["path"]), e["sha256"], e["input_hash"]) for name, e in entries}

    def modal_body(self, name: str) -> ModalBody:
        """The modal body of body `name` in the run.

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
            if isfile(path) and hashlib.sha256(path.read_bytes()).hexdigest() == file.sha256:
                return path
        now = "another" if isfile(file.path) else "none"
        raise InputError(f'{file.path}: expected the modal body file that "{name}" was solved with', now)

    def modal(self, analysis: str, body: str) -> Array:
        """Modal coordinates (T, n), √kg·m, of a flexible body in all modes of its modal body file, kept or not."""
        p, place = self[f"{analysis}/bodies/{body}/modal"], f"{analysis}/bodies/{body}/modal_transform"
        return p @ self[place].T if self.has(place) else p

    def stress_recovery(self, analysis: str, body: str) -> "Recovery":
        """Modal coordinates and load sizes that determine the stresses of a flexible body; see `Recovery`."""
        from ..mbs.quantities.stress import Recovery, SectionLoads, mode_displacement  # loads the core

        p, place = self.modal(analysis, body), f"{analysis}/stress/{body}"
        if not self.has(f"{place}/modal"):
            return mode_displacement(p)
        entry, sections = self._file[place], None
        names = tuple(str(name) for name in entry["loads"].attrs["columns"])
        if "layers" in entry:
            layers = fields_in(entry["layers"], SectionLoads)
            sections = SectionLoads(**{key: values[()] for key, values in layers.items()})
        return Recovery(str(entry.attrs["method"]), entry["modal"][()], names, entry["loads"][()], sections)

    def __enter__(self) -> "Results":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the HDF5 file; its datasets cannot be read afterwards."""
        self._file.close()

    def keys(self) -> list[str]:
        """Names of all datasets, for `results[NAME]`."""
        return [name for name in datasets_in(self._file) if "/resume/" not in name]

    def _ipython_key_completions_(self) -> list[str]:
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
            yield self.save(Path(folder) / f"{self.path.stem.strip('<>').replace(' ', '_')}.results.h5")

    def attributes(self, group: str) -> Mapping[str, Any]:
        """Attributes of an analysis or of one of its groups, such as `inverse/pzt/link1`.

        Raises `InputError` where there is no such group, or no such attribute.
        """
        self.asked |= {group} if "/" in group.strip("/") else set()
        if group not in self._file:
            raise InputError(f'{self.path}: expected the group "{group}"', f"none{self._near(group)}")
        return _Attributes(f"{self.path}: {group}", dict(self._file[group].attrs))

    def settling(self, point: str, option: str = "settling") -> tuple[str, Mapping[str, Any]]:
        """First analysis with residual vibration of "BODY.POINT" (or of "ANALYSIS/BODY.POINT"), and its attributes.

        Raises `InputError` where there is none; the message begins with `option`, which named the point.
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
        """Output times (T,), s, of the analysis of `dataset`, or of the analysis with that name.

        For `control/` of closed-loop runs, the times of its samples.
        """
        analysis, *inside = dataset.strip("/").split("/")
        return self[f"{analysis}/control/time" if inside[:1] == ["control"] else f"{analysis}/time"]

    def data(self, name: str) -> Array:
        """A dataset in SI units as (T, columns), or one column, `name[k]`, as (T, 1). Raises `InputError` if absent."""
        dataset, k = dataset_and_column(name)
        values = self[dataset]
        values = values.reshape(len(values), -1)
        if k is None:
            return values
        if k >= values.shape[1]:
            raise InputError(f'{self.path}: expected column {k} of "{dataset}"', f"{values.shape[1]} columns")
        return values[:, k : k + 1]

    def peak(self, name: str) -> tuple[float, float]:
        """The largest absolute value of a history, in its unit, and its time, s; between outputs if the file has that.

        Of all columns, of one of them, `name[k]`, or of the length of a vector such as a deflection.
        """
        from .peaks import peak_of

        dataset, column = dataset_and_column(name)
        self[dataset]  # raises where there is none
        return peak_of(self._file[dataset], self.time(dataset), column)

    def _near(self, dataset: str) -> str:
        known: list[str] = []
        self._file.visit(known.append)
        return did_you_mean(dataset, known)


def _natural(name: str) -> list[str | int]:
    """What sorts names as people do: text and whole numbers in turn."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)]
