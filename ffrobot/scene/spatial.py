"""A scene in space as a whole, and the one list of what space does not have yet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..common.errors import InputError
from ..common.toml_files import load_toml, read_text
from ..common.validation import validate
from ..fe_models.link_file import LinkTable, read_link
from ..mbs.fields.spelling import PLANAR, SPATIAL
from ..mbs.scene.spatial.mechanism import SpatialMechanismScene
from ..mbs.scene.spatial.planar_spelling import in_3d
from .actuation_times import with_times_of_actuation
from .checks import check_functions, problems
from .spatial_keys import SpatialSceneKeys

# Keys of planar scenes that scenes in space do not have, by the table in which they stand, and what there is instead.
_AXES = "forces at points are along x, y and z, axes of the body"
UNAVAILABLE = {
    "initial": {
        "angles": "the guess is of joint coordinates, joints = { … }",
        "rates": "the guess is of joint coordinates, joint_rates = { … }",
    },
    "actuation_points": {"transverse": _AXES, "axial": _AXES},
}


class SpatialScene(SpatialSceneKeys, SpatialMechanismScene):
    """A validated scene in space, with the absolute `path` of its file and the raw `text` that results files carry."""


def is_spatial(path: Path) -> bool:
    """Whether the scene file says `space = "spatial"`; False of what cannot be read, which others tell."""
    try:
        return bool(load_toml(path, "scene file").get("space") == "spatial")
    except InputError:
        return False


def load_spatial_scene(path: Path) -> SpatialScene:
    """Read and validate the scene file at `path`; paths in it come out relative to its folder.

    Raises `InputError` with one line for each wrong key: file, key, expected, found.
    """
    return available_scene(load_toml(path, "scene file"), path, read_text(path, "scene file"))


def available_scene(
    data: dict[str, Any], path: Path, text: str, functions: Mapping[str, object] | None = None
) -> SpatialScene:
    """The validated scene of `data`, all of which the program can do. Raises `InputError` as `load_spatial_scene`."""
    scene = spatial_scene(data, path, text, functions)
    check_available(scene)
    return scene


def check_available(scene: SpatialScene) -> None:
    """Raise `InputError` with a line for each thing that the records can say and the program cannot do yet."""
    found = [f"{scene.path}: {problem}" for problem in _not_available(scene)]
    if found:
        raise InputError("\n".join(found))


def spatial_scene(
    data: dict[str, Any], path: Path, text: str, functions: Mapping[str, object] | None = None
) -> SpatialScene:
    """The validated scene of `data`, which was read from `path` as `text`; `functions` of Python by their names."""
    space = SPATIAL if data.get("space") == SPATIAL else PLANAR
    refused = [f"{path}: {problem}" for problem in _unavailable_keys(data)] if space == SPATIAL else []
    if refused:
        raise InputError("\n".join(refused))
    keys = validate(SpatialSceneKeys, with_times_of_actuation(data), path, functions, space)
    found = [f"{path}: {problem}" for problem in problems(keys)]
    if found:
        raise InputError("\n".join(found))
    for link in (body.link for body in keys.body):
        if isinstance(link, LinkTable):
            read_link(link)
    check_functions(keys, path)
    return SpatialScene.model_construct(**dict(in_3d(keys)), path=path.absolute(), text=text)  # the keys are validated


def _unavailable_keys(data: dict[str, object]) -> Iterator[str]:
    """Keys that only planar scenes have so far, before they are called unknown."""
    for table, keys in UNAVAILABLE.items():
        found = data.get(table, [])
        for entry in found if isinstance(found, list) else [found]:
            for key, instead in keys.items():
                if isinstance(entry, dict) and key in entry:
                    yield f'{table}: {key}: expected no such key in space = "spatial", found it: {instead}'


def _not_available(scene: SpatialSceneKeys) -> Iterator[str]:
    """The list of what the records can say and the program cannot do yet."""
    for joint in scene.joint:
        if not joint.units and getattr(joint, "motor", False):
            yield (
                f"{joint.label}: motor: expected false of a {joint.type} joint, which has no coordinates for motors,"
                " found true: revolute and prismatic joints in series have them"
            )
