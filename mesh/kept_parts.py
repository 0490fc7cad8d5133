"""Meshes that gmsh made, kept in the user's cache: a link that changes in anything but its shape is not meshed again.

An entry is named by the content of the keys that define the mesh, the part's file among them. NumPy only.
"""

import hashlib
import json
import zipfile
from contextlib import suppress
from dataclasses import fields
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.cache import cache_folder, is_own
from ..common.errors import SolveError
from ..common.files import write_atomically
from ..common.version import digest_of_code, digest_of_content
from .included import files_of
from .records import PartTables, PlaceRecord, SolidGeometry

if TYPE_CHECKING:
    from .part_mesh import PartMesh

_REST = "rest"  # of a mesh, beside its arrays: as JSON
_OF_PLACES = set(PlaceRecord.model_fields)  # what else a record of an interface holds has no influence on the mesh


def digest_of_mesh_code() -> str:
    """SHA-256 of the Python files that make and read meshes."""
    return digest_of_code(Path(__file__).parent)


def geometry_content(geometry: SolidGeometry) -> dict[str, Any]:
    """The keys of `[geometry]`, with SHA-256 of the part's file, and of those it includes, in place of its name."""
    record = geometry.model_dump(mode="json")
    if geometry.file is not None:
        first, *others = (hashlib.sha256(file.read_bytes()).hexdigest() for file in files_of(geometry.file))
        record["file"] = first
        if others:
            record["included"] = others
    return record


def kept_path(tables: PartTables) -> Path:
    """The path of a part's mesh in the cache, existing or not."""
    file = tables.geometry.file
    content = {
        "code": digest_of_mesh_code(),
        "geometry": geometry_content(tables.geometry),
        "suffix": file.suffix.lower() if file is not None else "",
        "mesh": tables.mesh.model_dump(mode="json"),
        "interfaces": [item.model_dump(mode="json", include=_OF_PLACES) for item in tables.places],
        "patches": tables.patches and tables.patches.model_dump(mode="json"),
    }
    return cache_folder("meshes") / f"{digest_of_content(content)}.npz"


def kept_part(path: Path) -> "PartMesh | None":
    """Read the mesh in the cache at `path`; None where there is none, or it is damaged, or of another user."""
    from .part_mesh import PartMesh

    if not is_own(path):
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
            return PartMesh(**json.loads(str(arrays.pop(_REST))), **arrays)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def keep_part(path: Path, part: "PartMesh") -> None:
    """Write a mesh to the cache at `path`; nothing happens where that cannot be written."""
    values = {field.name: getattr(part, field.name) for field in fields(part)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    rest = {name: value for name, value in values.items() if name not in arrays}
    image = BytesIO()
    np.savez(image, **arrays, **{_REST: json.dumps(rest)})
    with suppress(SolveError):
        write_atomically(path, image.getvalue(), "mesh", ours=True, private=True)
