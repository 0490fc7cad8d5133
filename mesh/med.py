"""Meshes in MED files, of Salome, code_aster and gmsh: HDF5 with the library's own names.

meshio 5.0 knows neither families without groups nor hexahedra of 27 nodes, and takes coordinates of any system for
Cartesian ones. See "MED file format" in the documentation of MED 4.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..common.arrays import Integers
from ..common.errors import InputError, blaming_file
from .cells import in_gmsh_order
from .source import RawMesh

_SOLIDS = {
    "TE4": (4, "tetra"),
    "T10": (10, "tetra10"),
    "HE8": (8, "hexahedron"),
    "H20": (20, "hexahedron20"),
    "H27": (27, "hexahedron27"),
    "PE6": (6, "wedge"),
    "P15": (15, "wedge15"),
    "P18": (18, "wedge18"),
    "PY5": (5, "pyramid"),
    "P13": (13, "pyramid13"),
}
_SURFACES = {"TR3": (3, 3), "TR6": (6, 3), "TR7": (7, 3), "QU4": (4, 4), "QU8": (8, 4), "QU9": (9, 4)}  # and corners
_LINES = {"SE2": 2, "SE3": 3, "SE4": 4}
# MED's nodes in VTK's order: those on faces are those of the lower face, of the four around it, of the upper face.
_AS_VTK = {"hexahedron27": [*range(20), 24, 22, 21, 23, 20, 25, 26]}


def read_med(path: Path) -> RawMesh:
    """The mesh in a MED file. Groups name regions and faces.

    Raises `InputError` for a file without mesh, a damaged one, and what cannot be read: several meshes or steps, grids,
    polyhedra, other coordinates than Cartesian ones.
    """
    with (
        blaming_file("expected a MED file, found one that cannot be read: {!r}".format),
        h5py.File(path) as file,
    ):
        return _mesh(file)


def _mesh(file: h5py.File) -> RawMesh:
    name, mesh = _only(file["ENS_MAA"], "mesh")
    attributes = mesh.attrs
    if attributes.get("TYP", 0) != 0:
        raise InputError("expected a mesh of cells", f"a structured grid, {name}")
    if attributes.get("REP", 0) != 0:
        raise InputError("expected Cartesian coordinates", "cylindrical or spherical ones")
    if attributes["ESP"] != 3:
        raise InputError("expected a mesh in 3D", f"one in {attributes['ESP']} dimensions")
    step = mesh if "NOE" in mesh else _only(mesh, "step of the mesh")[1]
    points = _columns(step["NOE/COO"], 3).astype(np.float64)
    families = file["FAS"][name] if name in file.get("FAS", ()) else {}
    of_nodes = _members(step["NOE"], _groups(families.get("NOEUD", {})), len(points))
    raw = RawMesh(points, dict(of_nodes), remarks=[*_remarks(attributes, step["MAI"])])
    groups = _groups(families.get("ELEME", {}))
    for kind, of in step["MAI"].items():
        if _text(of.attrs, "PFL") not in ("", "MED_NO_PROFILE_INTERNAL"):
            raise InputError(f"expected all cells of type {kind}", "a profile of some")
        if kind in _SOLIDS:
            width, name = _SOLIDS[kind]
            cells = in_gmsh_order(name, _cells(of, width), _AS_VTK)
            raw.add_solids(name, cells, _members(of, groups, len(cells)))
        elif kind in _SURFACES:
            width, corners = _SURFACES[kind]
            cells = _cells(of, width)[:, :corners]
            raw.add_surfaces(cells, _members(of, groups, len(cells)))
        elif kind in _LINES:
            raw.lines.append(_cells(of, _LINES[kind])[:, :2])
        elif kind != "PO1" and not kind.startswith("POG"):  # points, polygons
            raise InputError(f"expected cells of {', '.join(_SOLIDS)}", f"{kind} (polyhedra, or structure elements)")
    return raw


def _only(parent: h5py.Group, what: str) -> tuple[str, Any]:
    if len(parent) != 1:
        raise InputError(f"expected one {what}", f"{len(parent)}: {', '.join(parent)}")
    return next(iter(parent.items()))


def _columns(data: h5py.Dataset, width: int) -> Any:
    """(n, width) of a dataset that has all first entries, then all second ones."""
    return np.asarray(data[()]).reshape((width, -1)).T


def _cells(of: h5py.Group, width: int) -> Integers:
    nodes = _columns(of["NOD"], width)
    if nodes.dtype.kind not in "iu":
        raise InputError("expected whole numbers of nodes", nodes.dtype)
    return nodes.astype(np.int64) - 1


def _groups(families: Mapping[str, Any]) -> dict[int, list[str]]:
    groups = dict[int, list[str]]()
    for family in families.values():
        names = family["GRO/NOM"][()] if "GRO" in family else ()
        texts = (np.asarray(name).astype(np.uint8).tobytes().decode("utf-8", errors="replace") for name in names)
        groups[int(family.attrs["NUM"])] = [text.partition("\0")[0].strip() for text in texts]
    return groups


def _members(of: h5py.Group, groups: Mapping[int, list[str]], count: int) -> Iterator[tuple[str, Integers]]:
    family = np.asarray(of["FAM"][()]) if "FAM" in of else np.zeros(count, dtype=np.int64)
    if family.shape != (count,):
        raise InputError(f"expected a family for each of {count} cells or nodes", family.size)
    present = set(np.unique(family).tolist())
    for name in {name: None for number in present for name in groups.get(number, ())}:
        yield name, np.flatnonzero(np.isin(family, [number for number in present if name in groups.get(number, ())]))


def _remarks(attributes: Mapping[str, Any], kinds: Iterable[str]) -> Iterator[str]:
    if any(kind.startswith("POG") for kind in kinds):
        yield "polygons (shells?) are left out"
    if unit := _text(attributes, "UNI")[:16].strip():
        yield f"the file says that its unit is {unit}: `unit` in the link file counts"


def _text(attributes: Mapping[str, Any], key: str) -> str:
    text = attributes.get(key, "")
    return (text.decode("utf-8", errors="replace") if isinstance(text, bytes) else str(text)).strip("\0 ")
