"""Meshes that gmsh made, kept in the user's cache: a link that changes in anything but its shape is not meshed again.

An entry is named by the content of the keys that define the mesh, the part's file among them. NumPy only.
"""

from __future__ import annotations

import hashlib
import zipfile
from contextlib import suppress
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..common.cache import cache_folder, is_own
from ..common.errors import SolveError
from ..common.files import write_atomically
from ..common.version import digest_of_code, digest_of_content
from .cells import CELLS, CellName
from .included import files_of
from .records import PartTables, PlaceRecord, SolidGeometry

if TYPE_CHECKING:
    from .part_mesh import PartMesh

_ARRAYS = ("points", "cells", "cell_tag", "facets", "facet_tag")
_NAMES = ("regions", "faces")
_OF_PLACES = set(PlaceRecord.model_fields)  # what else a record of an interface holds has no influence on the mesh


def digest_of_mesh_code() -> str:
    """SHA-256 of the code that makes meshes and reads them."""
    return digest_of_code(Path(__file__).parent)


def geometry_content(geometry: SolidGeometry) -> dict[str, Any]:
    """The keys of `[geometry]`, the content of a part's file, and of files that it includes, in place of its name."""
    record = geometry.model_dump(mode="json")
    if geometry.file is not None:
        first, *others = (hashlib.sha256(file.read_bytes()).hexdigest() for file in files_of(geometry.file))
        record["file"] = first
        if others:
            record["included"] = others
    return record


def kept_path(tables: PartTables) -> Path:
    """Return the path of a part's mesh in the cache, existing or not."""
    file = tables.geometry.file
    content = {
        "code": digest_of_mesh_code(),
        "geometry": geometry_content(tables.geometry),
        "suffix": file.suffix.lower() if file is not None else "",
        "mesh": tables.mesh.model_dump(mode="json"),
        "interfaces": [item.model_dump(mode="json", include=_OF_PLACES) for item in tables.places],
        "outlines": asdict(tables.outlines) if tables.outlines else None,
    }
    return cache_folder("meshes") / f"{digest_of_content(content)}.npz"


def kept_part(path: Path) -> PartMesh | None:
    """The mesh kept at `path`; None where there is none, or it is damaged, or of another user."""
    from .part_mesh import PartMesh

    if not is_own(path):
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            if str(file["cell"]) not in CELLS:
                return None
            names = {key: dict(zip(map(str, file[key]), map(int, file[f"{key}_tag"]), strict=True)) for key in _NAMES}
            return PartMesh(
                cell=cast(CellName, str(file["cell"])),
                degree=int(file["degree"]),
                regions=names["regions"],
                faces=names["faces"],
                remarks=tuple(map(str, file["remarks"])),
                **{key: file[key] for key in _ARRAYS},
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def keep_part(path: Path, part: PartMesh) -> None:
    """Keep a mesh at `path`; a cache that cannot be written does no harm."""
    arrays: dict[str, Any] = {key: getattr(part, key) for key in _ARRAYS} | {"cell": part.cell, "degree": part.degree}
    for key in _NAMES:
        tags = getattr(part, key)
        arrays |= {
            key: np.array(list(tags), dtype=np.str_),
            f"{key}_tag": np.array(list(tags.values()), dtype=np.int32),
        }
    arrays["remarks"] = np.array(part.remarks, dtype=np.str_)
    image = BytesIO()
    np.savez(image, **arrays)
    with suppress(SolveError):
        write_atomically(path, image.getvalue(), "mesh", ours=True, private=True)
