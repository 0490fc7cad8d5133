"""Loading a scene file: syntax, keys, and that everything it refers to exists."""

from __future__ import annotations

from collections.abc import Mapping
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


def make_scene(*, folder: PathLike[str] | str = ".", **keys: Any) -> Scene:  # noqa: ANN401 (whatever TOML may hold)
    """A scene from Python, with the keys of a scene file: tables are dictionaries, arrays of tables lists of them.

    Files it names are looked for in `folder`. NumPy numbers and arrays, tuples and paths may stand for numbers, lists
    and text; keys that are None are left out. Functions may stand for expressions: see `time_functions.user_function`.
    Raises `InputError` as `load_scene` does.
    """
    import tomli_w

    path = Path(folder) / MADE_IN_PYTHON
    functions: dict[str, object] = {}
    try:
        text = tomli_w.dumps(plain(keys, functions))
    except (TypeError, RecursionError) as error:
        raise InputError(f"{path}: expected numbers, text, lists and tables, found something else: {error}") from None
    return _scene(parse_toml(text, path, "scene"), path, text, functions)


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
    return Scene(**dict(keys), path=path.absolute(), text=text)


def _refuse_unavailable(data: dict[str, Any], path: Path) -> None:
    """Say so plainly, before the keys of what is not there yet are called wrong."""
    if data.get("space") == "spatial":
        raise InputError(
            f'{path}: space: expected "planar", found "spatial": only the command `ffrobot solve` takes scenes in space'
            " so far"
        )
