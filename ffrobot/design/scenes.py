"""The scene that designs are judged by: the user's, with the analyses that goals need, and a tolerance of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from math import ceil
from pathlib import Path
from typing import Any

from ..fe_models.link_file import LinkTable, read_link
from ..fe_models.link_records import Link
from ..mbs.analysis.tracking import Tracking
from ..mbs.fields.steps import DATASET
from ..mbs.scene.analysis import IntegratedAnalysis, TimedAnalysis
from ..results.file import Results
from ..scene.load import load_scene
from ..scene.scene import Scene
from ..sweep.files import run_files
from ..sweep.sweep import Key
from .readings import Goal

OUTPUTS = 1000  # at least, where goals are peaks or means over time: they do not depend on those of the scene
ALGEBRAIC = ("static", "pcid")
"""Kinds of analysis that, where they take no steps, solve equations to rounding at every time."""


def changes_for(
    path: Path, goals: Sequence[Goal], tolerance: float | None, *, keep_steps: bool = False
) -> dict[Key, Any]:
    """Changes of the scene at `path`: analyses that no goal needs are left out, the others have at most `tolerance`.

    Replays of inverse analyses on finer links, which change no result, are left out too. There are `OUTPUTS` at least.
    `keep_steps`: of integrations.
    """
    scene = load_scene(path)
    needed = _needed(scene, goals)
    whole = run_files(path, {}, path.parent).scene["analysis"]
    tables = deepcopy([table for table in whole if table["name"] in needed])
    for table, record in zip(tables, (one for one in scene.analysis if one.name in needed), strict=True):
        table.pop("check", None)
        if tolerance is not None and not isinstance(record, Tracking):  # whose tolerance chooses a mesh
            table["tolerance"] = min(tolerance, record.tolerance)
        if keep_steps and record.is_integrated and isinstance(record, IntegratedAnalysis):
            table["keep_steps"] = True
        if isinstance(record, TimedAnalysis) and any(goal.needs_motion for goal in goals):
            table["output_step"] = record.output_step / ceil(OUTPUTS * record.output_step / record.end * (1 - 1e-9))
    return {("analysis",): tables}


def may_repeat(keys: Sequence[Key]) -> bool:
    """Whether runs with other values of `keys` can take the same steps: where analyses end, for example, steps end."""
    return not any(key[0] == "analysis" for key in keys)


def repeated_steps(results: Results, path: Path) -> dict[Key, Any] | None:
    """Changes of a scene with which its integrations take the steps of a run again, whose `results` are at `path`.

    None where one of them cannot be repeated; nothing where none is integrated, and differences are smooth anyway.
    """
    about = {name: results.attributes(name) for name in results.analyses}
    stepping = [name for name in about if about[name]["steps"]]
    repeated = all(results.has(f"{name}/{DATASET}") for name in stepping)
    smooth = all(about[name]["kind"] in ALGEBRAIC for name in about if name not in stepping)
    if not (repeated and smooth):
        return None
    return {("analysis", name, "repeat_steps"): str(path.absolute()) for name in stepping}


def link_with(path: Path, body: str, changes: Mapping[Key, float]) -> Link | None:
    """The link of a body of the scene at `path` with some values changed; None where it comes from a modal body."""
    files = run_files(path, changes, path.parent)
    source = next(entry.get("link") for entry in files.scene["body"] if entry["name"] == body)
    if source is None or (isinstance(source, str) and not source.endswith(".toml")):
        return None
    if isinstance(source, dict):
        return read_link(LinkTable(source, path))
    changed = files.links.get(Path(source))
    return read_link(Path(source) if changed is None else LinkTable(changed, Path(source)))


def _needed(scene: Scene, goals: Sequence[Goal]) -> set[str]:
    """Names of the analyses that goals name, by default the first, and of those that they rest on."""
    names = [one.name for one in scene.analysis]
    found = {goal.analysis if goal.analysis in names else names[0] for goal in goals} or {names[0]}
    for one in reversed(scene.analysis):  # each rests on earlier ones only
        if one.name in found and one.source is not None:
            found.add(one.source)
    return {str(name) for name in found}
