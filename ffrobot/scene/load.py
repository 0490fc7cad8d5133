"""Loading a scene from a file or from Python: syntax, keys, and that everything it refers to exists."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from ..common.deferred import loaded
from ..common.errors import InputError
from ..common.files import AnyPath
from ..common.python_files import python_allowed
from ..common.toml_files import load_toml, parse_toml, read_text
from ..common.validation import plain, validate
from ..fe_models.link_source import LinkTable
from ..mbs.fields.spelling import PLANAR, SPATIAL
from ..mbs.scene.planar_spelling import in_3d
from .checks import check_functions, problems
from .kinds import KINDS
from .scene import Scene, SceneKeys

MADE_IN_PYTHON = "<scene made in Python>"

# Keys of planar scenes that 3D scenes do not have, by the table in which they stand, and what there is instead.
_AXES = "forces at points are along x, y and z, axes of the body"
UNAVAILABLE = {
    "initial": {
        "angles": "the guess is of joint coordinates, joints = { … }",
        "rates": "the guess is of joint coordinates, joint_rates = { … }",
    },
    "actuation_points": {"transverse": _AXES, "axial": _AXES},
}


def load_scene(path: AnyPath, *, allow_python: Sequence[AnyPath] = ()) -> Scene:
    """Read and validate a scene file; paths in it become relative to its folder.

    What depends on modal bodies (their points, the length of a link) is checked when these are known.

    Args:
        path: the scene file.
        allow_python: as in `solve`.

    Returns:
        The scene, which is immutable.

    Raises:
        InputError: one line for each wrong key.

    Example:
        scene = ffrobot.load_scene("scene.toml")
    """
    path = Path(path)
    with python_allowed(map(Path, allow_python)):
        return validated_scene(load_toml(path, "scene file"), path, read_text(path, "scene file"))


def load_robot(path: Path) -> Scene:
    """The scene in a file as `load_scene` reads it; without an analysis, too, as an import writes it."""
    data, rest = load_toml(path, "scene file"), [{"name": "rest", "kind": "static"}]
    scene = validated_scene({"analysis": rest} | data, path, read_text(path, "scene file"))
    return scene if "analysis" in data else scene.model_copy(update={"analysis": ()})


def make_scene(*, folder: PathLike[str] | str = ".", **keys: Any) -> Scene:  # noqa: ANN401 (whatever TOML may hold)
    """Make a scene in Python, with the keys of a scene file.

    Args:
        folder: folder of the files that the scene names.
        keys: tables are dictionaries, arrays of tables lists of them. NumPy numbers and arrays, tuples and paths can
            replace numbers, lists and text; functions can replace expressions. None omits a key.

    Returns:
        The scene, for `solve`.

    Raises:
        InputError: one line for each wrong key.

    Example:
        scene = ffrobot.make_scene(name="arm", body=[{"name": "arm", "link": "arm.toml"}], joint=[...], analysis=[...])
    """
    import tomli_w

    path = Path(folder) / MADE_IN_PYTHON
    functions: dict[str, object] = {}
    try:
        text = tomli_w.dumps(plain(keys, functions))
    except (TypeError, RecursionError) as error:
        raise InputError(f"{path}: expected numbers, text, lists and tables, found something else: {error}") from None
    return validated_scene(parse_toml(text, path, "scene"), path, text, functions)


def validated_scene(
    data: dict[str, Any], path: Path, text: str, functions: Mapping[str, object] | None = None
) -> Scene:
    """The validated scene of `data`, which was read from `path` as `text`; `functions` of Python by their names.

    Raises `InputError` as `load_scene` does.
    """
    space = SPATIAL if data.get("space") == SPATIAL else PLANAR
    _raise(_unavailable_keys(data) if space == SPATIAL else (), path)
    keys = validate(SceneKeys, with_times_of_actuation(data), path, functions, space)
    _raise(problems(keys), path)
    for link in (body.link for body in keys.body):
        if isinstance(link, LinkTable):
            from ..fe_models.link_file import read_link

            read_link(link)
    check_functions(keys, path)
    return Scene.model_construct(**dict(in_3d(keys)), path=path.absolute(), text=text)  # the keys are validated


def _raise(found: Iterable[str], path: Path) -> None:
    lines = [f"{path}: {problem}" for problem in found]
    if lines:
        raise InputError("\n".join(lines))


def _unavailable_keys(data: dict[str, object]) -> Iterator[str]:
    """Keys that only planar scenes have, before they are called unknown."""
    for table, keys in UNAVAILABLE.items():
        found = data.get(table, [])
        for entry in found if isinstance(found, list) else [found]:
            for key, instead in keys.items():
                if isinstance(entry, dict) and key in entry:
                    yield f'{table}: {key}: expected no such key in space = "spatial", found it: {instead}'


def with_times_of_actuation(data: dict[str, Any]) -> dict[str, Any]:
    """`data` with the `end` and `output_step` of forward analyses taken from their actuation where not given."""
    try:
        sources = {analysis["name"]: analysis for analysis in data["analysis"]}
        analyses = []
        for analysis in data["analysis"]:
            record = KINDS.modules.get(analysis.get("kind", "")) if "actuation" in analysis else None
            takes = record is not None and "actuation" in loaded(record).model_fields
            source = sources.get(analysis.get("actuation"), {}) if takes else {}
            times = {key: source[key] for key in ("end", "output_step") if key in source}
            analyses.append(times | analysis)
    except (KeyError, TypeError, AttributeError):
        return data  # malformed: validation says how
    return data | {"analysis": analyses}
