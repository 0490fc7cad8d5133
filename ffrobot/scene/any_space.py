"""Scenes in the plane and in space alike: which of the two a file, or tables from Python, describe."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from ..common.toml_files import load_toml
from .load import load_scene, made_in_python, made_scene
from .scene import Scene
from .spatial import SpatialScene, available_scene, load_spatial_scene

AnyScene = Scene | SpatialScene


def load_any_scene(path: Path) -> AnyScene:
    """Read and validate the scene file at `path`; paths in it come out relative to its folder.

    Raises `InputError` with one line for each wrong key: file, key, expected, found.
    """
    is_spatial = load_toml(path, "scene file").get("space") == "spatial"
    return load_spatial_scene(path) if is_spatial else load_scene(path)


def make_scene(*, folder: PathLike[str] | str = ".", **keys: Any) -> AnyScene:  # noqa: ANN401 (whatever TOML may hold)
    """A scene from Python, with the keys of a scene file: tables are dictionaries, arrays of tables lists of them.

    Files it names are looked for in `folder`. NumPy numbers and arrays, tuples and paths may stand for numbers, lists
    and text; keys that are None are left out. Functions may stand for expressions: see `time_functions.user_function`.
    Raises `InputError` as `load_scene` does.
    """
    made = made_in_python(folder, keys)
    if made.data.get("space") == "spatial":
        return available_scene(made.data, made.path, made.text, made.functions)
    return made_scene(made)
