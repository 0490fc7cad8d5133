"""Reading HDF5 files that may be damaged, or made to lead elsewhere."""

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import MISSING, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import h5py
import numpy as np

from . import checksum
from .arrays import NDArray
from .errors import InputError, blaming_file
from .outputs import check_regular, protected

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

MOST_COMPRESSED = 1100  # gzip makes 1032 bytes of one at best
_KINDS = {"c": "complex ones", "O": "text", "S": "text", "V": "records"}


def open_checked(path: Path) -> h5py.File:
    """The HDF5 file at `path`, its checksum and its links checked.

    Raises `InputError` for a checksum that does not fit or is missing, and for links that lead out of the file;
    `OSError` where there is no such file, or it is not HDF5.
    """
    check_regular(path)
    state = checksum.state(path)
    if state == "damaged":
        raise checksum.refuse(path)
    file = h5py.File(path, "r")
    try:
        with blaming(path):
            if state == "none" and checksum.MARK in file.attrs:
                raise checksum.refuse(path)
            outside = file.id.links.visit(
                lambda name, info: None if info.type == h5py.h5l.TYPE_HARD else name, info=True
            )
            if outside is not None:
                where = outside.decode(errors="replace")
                raise InputError(f"{path}: expected members in the file itself", f"a link at {where}")
    except BaseException:
        file.close()
        raise
    return file


@contextmanager
def in_memory() -> Iterator[h5py.File]:
    """Create a file in memory, for `image_of`, with a unique name: HDF5 opens no name twice."""
    with h5py.File(uuid4().hex, "w", driver="core", backing_store=False) as file:
        yield file


def image_of(file: h5py.File) -> bytes:
    """Return the bytes of a file made by `in_memory`."""
    file.flush()
    return file.id.get_file_image()


def read(dataset: h5py.Dataset) -> Any:
    """Return all data of a dataset.

    Raises `InputError` where its data are elsewhere (virtual and external datasets), fewer than its shape says, or
    complex, which ffrobot never writes.
    """
    stored, declared = dataset.id.get_storage_size(), math.prod(dataset.shape or ()) * dataset.dtype.itemsize
    if dataset.is_virtual or dataset.external:
        problem = "expected data in the file itself, found a virtual or external dataset"
    elif dataset.dtype.kind == "c":
        problem = "expected real numbers, found complex ones"
    elif declared > stored * (MOST_COMPRESSED if dataset.id.get_create_plist().get_nfilters() else 1):
        problem = f"expected {declared:.4g} bytes, as its shape {dataset.shape} says, found {stored}"
    else:
        return dataset[()]
    raise InputError(f"{dataset.file.filename}: dataset {dataset.name}: {problem}")


def numbers(item: object, name: str) -> NDArray[np.float64]:
    """Read numbers of any shape and unit. Raises `InputError` where `item`, which messages call `name`, is none."""
    if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "fiub":
        kind = item.dtype.kind if isinstance(item, h5py.Dataset) else "group"
        raise InputError(f"{name}: expected a dataset of numbers", _KINDS.get(kind, kind))
    return np.asarray(read(item), dtype=np.float64)


def datasets_in(group: h5py.Group) -> dict[str, h5py.Dataset]:
    """Return all datasets below `group` by their names in it."""
    items: dict[str, h5py.Dataset | h5py.Group] = {}
    group.visititems(items.__setitem__)
    return {name: item for name, item in items.items() if isinstance(item, h5py.Dataset)}


def fields_in(values: Mapping[str, Any], record: "type[DataclassInstance]") -> dict[str, Any]:
    """Return the fields of `record`, by name, from a group or attributes. Raises `KeyError` for missing ones.

    Fields with a default may be missing, as in files of earlier versions; other `values` are left out.
    """
    needed = {one.name: one.default is one.default_factory is MISSING for one in fields(record)}
    return {name: values[name] for name, is_needed in needed.items() if is_needed or name in values}


def blaming(*paths: Path) -> AbstractContextManager[None]:
    """Context that turns errors in reading HDF5 files into `InputError`: damaged, or not written by ffrobot.

    If the checksums of all `paths` are right, an error is a fault of the program and stays as it is.
    """

    def problem(error: Exception) -> str:
        doubtful = [path for path in paths if _is_doubtful(path)]
        return f"{doubtful[0]}: damaged file, or one that ffrobot did not write: {_in_words(error)}" if doubtful else ""

    return blaming_file(problem)


@contextmanager
def reading(*paths: Path) -> Iterator[None]:
    """Context in which `paths` cannot be overwritten, and errors in reading become `InputError` (`blaming`)."""
    with protected(paths), blaming(*paths):
        yield


def _in_words(error: Exception) -> str:
    """What h5py and others say of what they do not find, or find otherwise."""
    lacking = re.search(r"(object |attribute: |^)'(.+?)'", str(error)) if isinstance(error, KeyError) else None
    if lacking is not None:
        kind = {"object ": "dataset or group ", "attribute: ": "attribute "}.get(lacking[1], "")
        return f'expected the {kind}"{lacking[2]}", found none'
    return f"{type(error).__name__}: {error}".splitlines()[0]


def _is_doubtful(path: Path) -> bool:
    try:
        return checksum.state(path) != "sound"
    except OSError:
        return True
