"""Modal bodies in HDF5 files (docs/reference/files.md); needs h5py, no finite element library."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import h5py
import numpy as np

from ..common.arrays import Array, NDArray
from ..common.checksum import MARK, METHOD, sealed
from ..common.errors import InputError, naming
from ..common.files import AnyPath, write_atomically
from ..common.hdf5 import datasets_in, fields_in, image_of, in_memory, numbers, open_checked, read
from ..common.meanings import write_record
from .modal_body import Interface, MeasuredValues, ModalBody, OutlinedPatches, PictureMesh, Stations, StressPoint

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Found = TypeVar("Found")

FORMAT = "ffrobot-modal-body"
FORMAT_VERSION = 1
LARGEST = 1e100  # of any number: products of three of them are still finite

_ATTRIBUTES = ("name", "kind", "reference_condition", "ffrobot_version", "input_hash")
_OPTIONAL = ("modes_hash", "assembly", "eigensolver")  # empty where not known
# Field of ModalBody → dataset; those with a default not all files have.
_DATASETS = {
    "length": "length",
    "mass": "mass",
    "first_moment": "first_moment",
    "second_moment": "second_moment",
    "frequency": "modes/frequency",
    "stiffness": "modes/stiffness",
    "modal_mass": "modes/mass",
    "damping_ratio": "modes/damping_ratio",
    "S_bar": "invariants/S_bar",
    "I_bar": "invariants/I_bar",
    "S_bar_kl": "invariants/S_bar_kl",
    "J_spin": "invariants/J_spin",
    "h_spin": "invariants/h_spin",
    "S_spin": "invariants/S_spin",
    "surface_stress": "stress/surface",
    "surface_static": "stress/surface_static",
}
_NAMES = {"stress_loads": "stress/loads", "remarks": "remarks"}
_PARTS: "dict[str, tuple[str, type[DataclassInstance]]]" = {
    "stations": ("stations", Stations),
    "mesh": ("mesh", PictureMesh),
    "measured": ("modes/measured", MeasuredValues),
    "surface_patches": ("surface_patches", OutlinedPatches),
}
_UNITS = {"length": "m", "mass": "kg", "first_moment": "kg m", "second_moment": "kg m2", "modes/frequency": "Hz"}


def write_modal_body(path: Path, body: ModalBody, *, in_cache: bool = False) -> None:
    """Write `body` to `path`; an existing file is replaced once the new one is complete.

    A file `in_cache` is for this user alone. Raises `SolveError`, with file and reason, where it cannot be written.
    """
    write_atomically(path, sealed(_image(body)), "modal body file", ours=in_cache, private=in_cache)


def read_modal_body(path: AnyPath) -> ModalBody:
    """Read and check a modal body file.

    Args:
        path: the file, `LINK.h5`.

    Returns:
        The modal body.

    Raises:
        InputError: the file is missing, damaged, of another kind or version, or its modal body is inconsistent.

    Example:
        ffrobot.read_modal_body("arm.h5").mass  # kg
    """
    path = Path(path)
    kept = _kept_of(path)
    read_files.add(path)
    return kept or _read(path, _body)


_kept = dict[Path, tuple[object, ModalBody]]()
read_files = set[Path]()
"""Modal body files that this process, or one that it is forked from, has read."""


def keep_modal_body(path: Path) -> None:
    """Read a file for this process and those forked from it: none of them reads it again until it changes."""
    if _kept_of(path) is None:
        _kept[path] = _state(path), _read(path, _body)


def _kept_of(path: Path) -> ModalBody | None:
    state, body = _kept.get(path, (None, None))
    return body if state is not None and state == _state(path) else None


def _state(path: Path) -> object:
    about = path.stat() if path.is_file() else None
    return about and (about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns, about.st_ctime_ns)


def read_mass(path: Path) -> float:
    """Read the mass, kg, of the modal body in the file at `path`. Raises `InputError` if it is no such file."""
    return _read(path, lambda file: float(_array(file, _DATASETS["mass"])))


def _read(path: Path, reader: Callable[[h5py.File], Found]) -> Found:
    """What `reader` finds in a modal body file. Raises `InputError` as of `read_modal_body`."""
    if not path.is_file():
        raise InputError(f"{path}: modal body file not found")
    try:
        with naming(path), open_checked(path) as file:
            _check_format(file.attrs)
            return reader(file)
    except KeyError as error:
        raise InputError(f"{path}: damaged modal body file: {error.args[0]}") from error
    except MemoryError:
        raise InputError(f"{path}: damaged modal body file: larger than memory") from None
    except (OSError, RuntimeError, ValueError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: not a modal body file, or a damaged one: {error}") from error


def is_modal_body_file(path: Path) -> bool:
    """Whether the file is a modal body file; False where it cannot be read."""
    try:
        with open_checked(path) as file:
            return bool(file.attrs.get("format") == FORMAT)
    except (OSError, InputError):
        return False


def _check_format(attributes: h5py.AttributeManager) -> None:
    if attributes.get("format") != FORMAT:
        raise InputError(f'expected format "{FORMAT}"', f"{attributes.get('format', 'no such attribute')!r}")
    version = attributes["format_version"]
    if not isinstance(version, int | np.integer) or version < 1:
        raise InputError("format_version: expected a whole number", f"{version!r}")
    if version > FORMAT_VERSION:
        raise InputError(
            f"written by a newer ffrobot ({attributes.get('ffrobot_version', 'unknown')}): format_version:"
            f" expected at most {FORMAT_VERSION}",
            version,
        )


def _body(file: h5py.File) -> ModalBody:
    values: dict[str, Any] = {name: _text(file.attrs[name]) for name in _ATTRIBUTES}
    known = {item.name: item for item in fields(ModalBody)}
    for name, dataset in _DATASETS.items():
        if known[name].default is MISSING or dataset in file:
            values[name] = _array(file, dataset)
    for name, (group, record) in _PARTS.items():
        if known[name].default is MISSING or group in file:
            values[name] = record(**_arrays(file[group], record))
    values |= {name: _texts(file, dataset) for name, dataset in _NAMES.items() if dataset in file}
    if (residual := file.get("modes/residual")) is not None:
        if residual.dtype.kind not in "iu":
            raise InputError(f"{residual.name}: expected whole numbers", residual.dtype)
        values["residual"] = np.asarray(read(residual), dtype=np.int64)
    if "damping_of" in file["modes"].attrs:
        values["damping_of"] = _text(file["modes"].attrs["damping_of"])
    values |= {name: _text(file.attrs.get(name, "")) for name in _OPTIONAL}
    points, K = file.get("stress/points", {}), file.get("geometric_stiffness")
    return ModalBody(
        **values,
        family=_texts(file, "modes/family"),
        geometric_stiffness={} if K is None else {name: _array(K, name) for name in datasets_in(K)},
        interfaces={
            name: Interface(**_arrays(group, Interface) | {"coupling": _text(group.attrs.get("coupling", ""))})
            for name, group in file["interfaces"].items()
        },
        stress={name: StressPoint(**_arrays(points[name], StressPoint)) for name in points},
    )


def _arrays(group: h5py.Group, record: "type[DataclassInstance]") -> dict[str, Any]:
    """The datasets of `group` that are fields of `record`; those without default must be there."""
    return {name: _numbers(item) for name, item in fields_in(group, record).items()}


def _array(group: h5py.Group, name: str) -> Array:
    return np.asarray(_numbers(group[name]), dtype=np.float64)


def _numbers(item: h5py.Dataset | h5py.Group) -> NDArray[Any]:
    """A dataset of whole or real numbers, none so large that products of a few were infinite."""
    name = item.name.lstrip("/")
    values = numbers(item, name)
    if np.any(np.abs(values) > LARGEST):
        worst = values.flat[np.abs(values).argmax()]
        raise InputError(f"{name}: expected numbers up to {LARGEST:g}", f"{worst:.3g}")
    return values.astype(np.int64) if item.dtype.kind in "iu" else values


def _text(value: object) -> str:
    return value.decode("utf-8") if isinstance(value, bytes) else str(value)


def _texts(file: h5py.File, name: str) -> tuple[str, ...]:
    return tuple(map(_text, read(file[name])))


def _image(body: ModalBody) -> bytes:
    """The HDF5 file as bytes; the same body always gives the same bytes."""
    with in_memory() as file:
        file.attrs["format"] = FORMAT
        file.attrs["format_version"] = FORMAT_VERSION
        file.attrs[MARK] = METHOD
        for name in _ATTRIBUTES:
            file.attrs[name] = getattr(body, name)
        for name in _OPTIONAL:
            if text := getattr(body, name):
                file.attrs[name] = text
        _write_arrays(file, {dataset: getattr(body, name) for name, dataset in _DATASETS.items()})
        for dataset, unit in _UNITS.items():
            file[dataset].attrs["unit"] = unit
        _write_names(file, "modes/family", body.family)
        _write_arrays(file, {"modes/residual": body.residual})
        if body.damping_of != "link":
            file["modes"].attrs["damping_of"] = body.damping_of
        for name, (path, _) in _PARTS.items():
            if (part := getattr(body, name)) is not None:
                write_record(file.create_group(path), part)
        if body.measured is not None:
            file["modes/measured"].attrs["what"] = body.measured.in_words()
        _write_arrays(file.create_group("geometric_stiffness"), dict(sorted(body.geometric_stiffness.items())))
        for name, interface in sorted(body.interfaces.items()):
            group = file.create_group(f"interfaces/{name}")
            write_record(group, interface)
            if interface.coupling:
                group.attrs["coupling"] = interface.coupling
        for name, point in sorted(body.stress.items()):
            write_record(file.create_group(f"stress/points/{name}"), point)
        for name, path in _NAMES.items():
            if names := getattr(body, name):
                _write_names(file, path, names)
        if body.reference_condition == "craig-bampton":
            _write_craig_bampton(file.create_group("craig_bampton"), body)
        return image_of(file)


def _write_arrays(group: h5py.Group, arrays: Mapping[str, NDArray[np.generic] | None]) -> None:
    for name, array in arrays.items():
        if array is not None:
            group.create_dataset(name, data=array, track_times=False)


def _write_craig_bampton(group: h5py.Group, body: ModalBody) -> None:
    """For other programs; it follows from the rest of the file, and is not read."""
    from .modal_body.craig_bampton import craig_bampton  # here: reading does without the records of links

    link = craig_bampton(body)
    _write_names(group, "coordinates", link.coordinates)
    _write_arrays(group, {"mass": link.mass, "stiffness": link.stiffness, "recovery": link.recovery})


def _write_names(group: h5py.Group, name: str, names: Sequence[str]) -> None:
    group.create_dataset(name, data=list(names), dtype=h5py.string_dtype(), track_times=False)
