"""Whether a results file is of the same input: scene, modal bodies, files that the scene names, the program."""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import h5py

from ..common.errors import InputError
from ..common.python_files import allowed_python, imported_files
from ..common.tables import key_path
from ..common.version import program_version
from ..run.inputs import digest_of_file, named_files, python_files
from ..run.loaded_body import LoadedBody
from ..scene.scene import Scene
from .file import Results

MAY_CHANGE = "max_steps"  # counts from where a run goes on


def check_same_input(scene: Scene, bodies: Mapping[str, LoadedBody], file: Results) -> None:
    """Raise `InputError` naming the first thing that is not as it was."""
    found = next(_changes(scene, bodies, file), None)
    if found is not None:
        raise InputError(
            f"{file.path}: resume: expected results of the same input, found that {found} has changed; solve it from"
            " the start, or undo the change"
        )


def _changes(scene: Scene, bodies: Mapping[str, LoadedBody], file: Results) -> Iterator[str]:
    """What of the input is not that of the results file."""
    if file.ffrobot_version != program_version():
        yield f"ffrobot {file.ffrobot_version}, now {program_version()},"
    then, now = _without_limits(file.scene), _without_limits(tomllib.loads(scene.text))
    loc = _first_difference(then, now)
    if loc is not None:
        yield f"the scene ({key_path(loc, now)})"
    for name, body in bodies.items():
        if body.path is not None and body.file_hash != file.modal_files[name].sha256:
            yield f'the modal body of "{name}"'
    files = json.loads(file.attributes("/").get("input_files", "{}"))
    for name, digest in input_files(scene).items():
        if files.get(name) != digest:
            yield name
    for name, digest in json.loads(file.attributes("/").get("imported_files", "{}")).items():
        if digest_of_file(scene.path.parent / name) != digest:
            yield f"the file {name}, which a Python file imports,"


def _without_limits(scene: Mapping[str, Any]) -> dict[str, Any]:
    analyses = [{key: value for key, value in a.items() if key != MAY_CHANGE} for a in scene["analysis"]]
    return {**scene, "analysis": analyses}


def _first_difference(then: object, now: object, loc: tuple[int | str, ...] = ()) -> tuple[int | str, ...] | None:
    """Where two values of TOML differ first; None where they are equal."""
    if then == now:
        return None
    if isinstance(then, dict) and isinstance(now, dict):
        inner = ((key, then.get(key), now.get(key)) for key in now | then)
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        inner = ((k, *pair) for k, pair in enumerate(zip(then, now, strict=True)))
    else:
        return loc
    found = (_first_difference(old, new, (*loc, key)) for key, old, new in inner)
    return next((place for place in found if place is not None), loc)


def write_input_files(file: h5py.File, scene: Scene) -> None:
    """Attributes `input_files`, and `imported_files` where the scene runs Python files: names from its folder on."""
    file.attrs["input_files"] = json.dumps(input_files(scene))
    folder = scene.path.parent
    if python := python_files(tomllib.loads(scene.text), folder):
        found = imported_files(folder, *(file.parent for file in python), *allowed_python())
        names = {os.path.relpath(file, folder.resolve()): digest for file, digest in found.items()}
        file.attrs["imported_files"] = json.dumps(names)


def input_files(scene: Scene) -> dict[str, str]:
    """SHA-256 of the files that a scene names besides links and modal bodies, by what messages call them."""
    tables, folder = tomllib.loads(scene.text), scene.path.parent
    waypoints = {entry["waypoints"] for entry in tables.get("trajectory", []) if "waypoints" in entry}
    calls = {folder / name: f"the waypoints {name}" for name in waypoints}
    besides = {key: value for key, value in tables.items() if key != "body"}
    return {calls.get(file, f"the file {file.name}"): digest_of_file(file) for file in named_files(besides, folder)}
