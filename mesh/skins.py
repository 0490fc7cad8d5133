"""Meshes that only say what a body looks like (STL, OBJ, DAE …), by trimesh (extra "urdf")."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, is_own_fault

if TYPE_CHECKING:
    import trimesh

READ = (".3mf", ".dae", ".glb", ".gltf", ".obj", ".off", ".ply", ".stl")
"""Endings of files that are read: formats that trimesh reads itself, all of them without a program of others."""


def loaded_skin(path: Path, scale: Sequence[float], d: Array, C: Array) -> "trimesh.Trimesh":
    """Read the mesh in `path`, turned by C (3, 3) and moved by d (3,), m.

    `scale` (3,): m per unit of its coordinates, in m already where it names a unit. Raises `ModuleNotFoundError`
    without trimesh, `InputError` if the file is missing, damaged or of another format.
    """
    import trimesh

    if path.suffix.lower() not in READ:
        raise InputError(f"expected a mesh in one of {', '.join(READ)}", path.name)
    try:
        loaded = trimesh.load(path, force="mesh")
        if loaded.units:
            loaded.convert_units("meters")
        loaded.merge_vertices(merge_tex=True, merge_norm=True)  # of faces that meet with several normals
    except ModuleNotFoundError:
        raise
    except Exception as error:  # whatever a reader of damaged or missing files raises
        if is_own_fault(error):
            raise
        raise InputError("expected a mesh that trimesh can read", path.name) from error
    if not len(loaded.faces):
        raise InputError("expected a mesh with facets", f"{path.name} without any")
    return _moved(loaded, C @ np.diag(scale), d)


def primitive_skin(shape: str, size: Sequence[float], d: Array, C: Array) -> "trimesh.Trimesh":
    """Box (x, y, z), cylinder along z (radius, length) or sphere (radius,), m, turned by C (3, 3), moved by d (3,)."""
    from trimesh import creation

    made = {
        "box": lambda: creation.box(size),
        "cylinder": lambda: creation.cylinder(*size),
        "sphere": lambda: creation.icosphere(2, *size),
    }[shape]()
    return _moved(made, C, d)


def _moved(skin: "trimesh.Trimesh", C: Array, d: Array) -> "trimesh.Trimesh":
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = C, d
    skin.apply_transform(transform)
    return skin
