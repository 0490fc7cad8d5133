"""Scenes whose links have more elements or more modes: link files rewritten into a folder, solved through the cache."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from pathlib import Path
from typing import Any

import tomli_w

from ..fe_models.link_file import link_keys, link_path
from ..scene.scene import Scene

Keys = dict[str, Any]

# Patches that fit the modes of the scene need not fit others; where they do, this changes nothing.
_ANY_NUMBER_OF_MODES = {"allocation": "least-squares", "mode_weights": None}


def refined(scene: Scene, elements: float, modes: float, folder: Path) -> Scene | None:
    """The scene with `elements` and `modes` times as many of them in every link that is given by its link file.

    Written to `folder`, one file a link. None where neither changes anything: no link files, or none with such keys.
    """
    changed = False
    bodies = []
    for k, body in enumerate(scene.body):
        if body.link is not None:
            keys = link_keys(body.link)
            changed |= elements != 1 and _scale_mesh(keys, elements)
            changed |= modes != 1 and _scale_modes(keys, modes)
            if "file" in keys["geometry"]:
                keys["geometry"]["file"] = str((link_path(body.link).parent / keys["geometry"]["file"]).absolute())
            path = folder / f"{k}_{elements:g}_{modes:g}_{body.name}.toml"
            path.write_text(tomli_w.dumps(keys), encoding="utf-8")
            body = body.model_copy(update={"link": path})
        bodies.append(body)
    update: Keys = {"body": tuple(bodies)}
    if modes != 1:
        update["pzt"] = tuple(layout.model_copy(update=_ANY_NUMBER_OF_MODES) for layout in scene.pzt)
    return scene.model_copy(update=update) if changed else None


def elements_of(scene: Scene) -> str:
    """What the mesh tables of the link files say, for the record: "20" or "20, 40"."""
    return _listed(scene, lambda keys: keys.get("mesh", {}))


def modes_of(scene: Scene) -> str:
    """Likewise for the numbers of modes."""
    return _listed(scene, lambda keys: {"count": keys.get("modes", {}).get("count", "")})


def _listed(scene: Scene, table: Callable[[Keys], Keys]) -> str:
    links = [link_keys(body.link) for body in scene.body if body.link is not None]
    values = [str(value) for keys in links for key, value in table(keys).items() if key not in ("cell", "order")]
    return ", ".join(dict.fromkeys(values))


def _scale_mesh(keys: Keys, factor: float) -> bool:
    """Whether the mesh table has what can be scaled: elements of a beam, size or divisions of a solid."""
    mesh = keys.get("mesh", {})
    if isinstance(mesh.get("elements"), int):
        mesh["elements"] = ceil(factor * mesh["elements"])
    elif "size" in mesh:
        mesh["size"] /= factor
    elif "divisions" in mesh:
        mesh["divisions"] = [ceil(factor * count) for count in mesh["divisions"]]
    else:
        return False
    return True


def _scale_modes(keys: Keys, factor: float) -> bool:
    """Whether there is a number of modes to scale, and damping that fits any number."""
    modes = keys.get("modes", {})
    if not isinstance(modes.get("count"), int) or isinstance(keys.get("damping", {}).get("ratio"), list):
        return False
    modes["count"] = ceil(factor * modes["count"])
    return True
