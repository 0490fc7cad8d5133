"""Scenes from files and from Python, in the plane and in 3D alike."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from .load import made_in_python
from .spatial import SpatialScene, available_scene, load_spatial_scene

AnyScene = SpatialScene


def load_any_scene(path: Path) -> SpatialScene:
    """Read and validate the scene file at `path`; paths in it come out relative to its folder.

    Raises `InputError` with one line for each wrong key: file, key, expected, found.
    """
    return load_spatial_scene(path)


def make_scene(*, folder: PathLike[str] | str = ".", **keys: Any) -> SpatialScene:  # noqa: ANN401 (whatever TOML may hold)
    """A scene from Python, with the keys of a scene file: tables are dictionaries, arrays of tables lists of them.

    Files it names are looked for in `folder`. NumPy numbers and arrays, tuples and paths may stand for numbers, lists
    and text; keys that are None are left out. Functions may stand for expressions: see `time_functions.user_function`.
    Raises `InputError` as `load_scene` does.
    """
    made = made_in_python(folder, keys)
    return available_scene(made.data, made.path, made.text, made.functions)
