"""Planar scenes for FMUs of forward motions: read by the records of 3D, from the start that `ffrobot solve` has."""

from __future__ import annotations

from pathlib import Path

from ...common.toml_files import load_toml, read_text
from ...mbs.analysis.forward import Forward
from ...mbs.solve.start_in_space import start_in_space
from ...run.prepare import prepare
from ...run.watcher import Watcher
from ...scene.scene import Scene
from ...scene.spatial import SpatialScene, available_scene


def forward_scene(path: Path, scene: Scene, analysis: Forward, watcher: Watcher) -> SpatialScene:
    """The scene at `path` with `analysis` alone, without what nothing follows; stage 1 tells `watcher`.

    Raises `InputError` as the analysis itself does.
    """
    data = load_toml(path, "scene file")
    tables = [table for table in data["analysis"] if table["name"] == analysis.name]
    found = available_scene(data | {"trajectory": [], "analysis": tables}, path, read_text(path, "scene file"))
    start = start_in_space(prepare(scene, watcher).model)
    initial = {key: getattr(found.initial, key) | values for key, values in start.items()}
    return found.model_copy(update={"initial": found.initial.model_copy(update=initial)})
