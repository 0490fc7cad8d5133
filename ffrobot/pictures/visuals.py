"""The surface that a scene has for a rigid body to be seen by: `rigid.visual`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.arrays import Array, Integers, as_floats
from ..common.rotations import of_rpy
from ..common.tables import shown
from ..mbs.scene.bodies import PRIMITIVES
from ..mesh.skins import loaded_skin, primitive_skin
from ..results.file import Results

if TYPE_CHECKING:
    import trimesh


def visual_surface(results: Results, name: str, notes: list[str]) -> tuple[Array, Integers] | None:
    """Points (p, 3), m, in the body's axes, and triangles (t, 3); None where nothing is drawn, as `notes` then say."""
    body = next(entry for entry in results.scene["body"] if entry["name"] == name)
    entries = body.get("rigid", {}).get("visual", ())
    if not entries:
        return None
    try:
        skins = [_skin(entry, results.path.parent) for entry in entries]
    except ModuleNotFoundError:
        notes.append("bodies are drawn without their meshes, which need trimesh: pip install trimesh pycollada")
        return None
    except Exception as error:  # whatever a reader of damaged or missing files raises
        notes.append(f"{name} is drawn without its mesh: {shown(str(error))}")
        return None
    first = np.cumsum([0, *(len(skin.vertices) for skin in skins[:-1])])
    points = as_floats(np.concatenate([skin.vertices for skin in skins]))
    return points, np.concatenate([skin.faces + start for skin, start in zip(skins, first, strict=True)])


def _skin(entry: Mapping[str, Any], folder: Path) -> trimesh.Trimesh:
    d, C = np.array(entry.get("at", (0.0, 0.0, 0.0))), of_rpy(*entry.get("rpy", (0.0, 0.0, 0.0)))
    if "mesh" in entry:
        return loaded_skin(folder / entry["mesh"], entry.get("scale", (1.0, 1.0, 1.0)), d, C)
    shape = next(key for key in PRIMITIVES if key in entry)
    return primitive_skin(shape, np.atleast_1d(entry[shape]).tolist(), d, C)
