"""Loading a scene file: syntax, keys, and that everything it refers to exists."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from ..common.errors import InputError
from ..common.toml_files import load_toml, parse_toml, read_text
from ..common.validation import plain, validate
from ..fe_models.link_file import LinkTable, read_link
from .actuation_times import with_times_of_actuation
from .checks import check_functions, problems
from .scene import Scene, SceneKeys

MADE_IN_PYTHON = "<scene made in Python>"


def load_scene(path: Path) -> Scene:
    """Read and validate the scene file at `path`; paths in it come out relative to its folder.

    Raises `InputError` with one line for each wrong key: file, key, expected, found. What depends on modal bodies
    (their points, the length of a link) is checked when these are known.
    """
    return _scene(load_toml(path, "scene file"), path, read_text(path, "scene file"))


@dataclass(frozen=True)
class MadeInPython:
    """Tables from Python as those of a file: `functions` by the text that stands for them."""

    data: dict[str, Any]
    path: Path
    text: str
    functions: Mapping[str, object]


def made_in_python(folder: PathLike[str] | str, keys: Mapping[str, Any]) -> MadeInPython:
    """The keys of a scene as a file in `folder` would have them. Raises `InputError` for what no file can hold."""
    import tomli_w

    path = Path(folder) / MADE_IN_PYTHON
    functions: dict[str, object] = {}
    try:
        text = tomli_w.dumps(plain(keys, functions))
    except (TypeError, RecursionError) as error:
        raise InputError(f"{path}: expected numbers, text, lists and tables, found something else: {error}") from None
    return MadeInPython(parse_toml(text, path, "scene"), path, text, functions)


def made_scene(made: MadeInPython) -> Scene:
    """The validated planar scene. Raises `InputError` as `load_scene` does."""
    return _scene(made.data, made.path, made.text, made.functions)


def make_scene(*, folder: PathLike[str] | str = ".", **keys: Any) -> Scene:  # noqa: ANN401 (whatever TOML may hold)
    """A planar scene from Python: see `any_space.make_scene`."""
    return made_scene(made_in_python(folder, keys))


def _scene(data: dict[str, Any], path: Path, text: str, objects: Mapping[str, object] | None = None) -> Scene:
    """The validated scene of `data`, which was read from `path` as `text`."""
    _refuse_unavailable(data, path)
    keys = validate(SceneKeys, with_times_of_actuation(data), path, objects)
    found = [f"{path}: {problem}" for problem in problems(keys)]
    if found:
        raise InputError("\n".join(found))
    for link in (body.link for body in keys.body):
        if isinstance(link, LinkTable):
            read_link(link)
    check_functions(keys, path)
    return Scene.model_construct(**dict(keys), path=path.absolute(), text=text)  # the keys are validated


def _refuse_unavailable(data: dict[str, Any], path: Path) -> None:
    """Say so plainly, before the keys of what is not there yet are called wrong."""
    if data.get("space") == "spatial":
        raise InputError(
            f'{path}: space: expected "planar", found "spatial": 3D scenes run by `ffrobot solve`, `ffrobot'
            " sweep` and `ffrobot.solve` so far"
        )
