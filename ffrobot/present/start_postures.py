"""Output of `ffrobot pose`: the posture at the start of a scene, and other possible ones."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array
from ..common.rotations import rpy_of
from ..mbs.model.model import Model
from ..mbs.posture.branches import branch_names, in_words, start_postures
from ..mbs.posture.start import undeformed_posture
from ..mbs.scene.space import SPACES
from ..results.file import Results
from ..run.prepare import prepare_scene
from ..run.watcher import Watcher
from ..scene.load import load_robot
from .lines import print_table

if TYPE_CHECKING:
    from rich.console import Console


def print_start(path: Path, watcher: Watcher, console: "Console") -> None:
    """Print joint positions at the start of a scene, points of paths, and lines of [initial] for other postures."""
    model = prepare_scene(load_robot(path), watcher).model
    first, *others = start_postures(model)
    print_table(console, ("joint", "start", "guess in [initial]", "limits"), _joints(model, first.q))
    columns = ("point", "at (m)", "roll, pitch, yaw")[: 2 + bool(model.scene.tool)]
    if points := [row[: len(columns)] for row in _points(model, first.q)]:
        print_table(console, columns, points)
    if first.branch:
        console.out(in_words(first.branch))
    if others:
        from ..mbs.posture.workspace import within_limits

        console.print(f"other starts: {len(others)} found; a line of [initial] chooses one")
    for other in others:
        beyond = "" if within_limits(model, other.q[None])[0] else " (beyond joint limits)"
        named = f", {in_words(other.branch)}" if other.branch else ""
        console.out(f"  {np.degrees(other.away):.0f}° away{beyond}{named}: {other.guess}")


def _joints(model: Model, q: Array) -> Iterator[tuple[str, ...]]:
    for joint in model.scene.joint:
        if joint.name not in model.tree.carried:
            yield joint.name, "closes a loop", "", ""
            continue
        values = model.tree.nodes[model.tree.carried[joint.name]].coordinates(q)
        guesses = np.atleast_1d(np.array(model.scene.initial.joints.get(joint.name, np.nan), dtype=float))
        for k, (value, unit) in enumerate(zip(values.tolist(), joint.units, strict=True)):
            guess = guesses[k] if k < len(guesses) else np.nan
            limits = joint.position_limits[k]
            known = f"{_in(limits[0], unit)} … {_in(limits[1], unit)}" if np.isfinite(limits).any() else ""
            yield (joint.name if k == 0 else ""), _in(value, unit), _in(guess, unit), known


def _in(value: float, unit: str) -> str:
    if np.isnan(value):
        return ""
    return f"{round(np.degrees(value), 6) + 0.0:.5g}°" if unit == "rad" else f"{value:.5g} m"


def _points(model: Model, q: Array) -> Iterator[tuple[str, str, str]]:
    """Points of paths, and tools with their orientation, in the plane by yaw alone."""
    tree, places, space = model.tree, model.tree.places(q[None]), SPACES[model.scene.space]
    tools = [tool.reference for tool in model.scene.tool]
    for point in dict.fromkeys([*model.scene.path_points, *tools]):
        pose = places.at(tree.section(point))
        angles = rpy_of(pose.F[0])[2 * space.is_plane :]
        turned = ", ".join(_in(angle, "rad") for angle in angles) if point in tools else ""
        yield point, ", ".join(f"{round(x, 9) + 0.0:.5g}" for x in space.along(pose.r[0])), turned


UNITS = {"revolute": ("°", 180 / np.pi), "prismatic": (" m", 1.0)}


def chosen_posture(results: Results, model: Model) -> str:
    """Return text on the start posture (joints, branch) that the program chose; "" if the scene specifies it."""
    scene = results.scene
    initial = scene.get("initial", {})
    named = any(initial.get(key) for key in ("angles", "joints", "branch"))
    if named or not any("point" in one for one in scene.get("trajectory", ())):
        return ""
    for analysis in results.analyses:
        others = [
            f"{joint['name']} {round(results[name].ravel()[0] * factor, 6) + 0.0:.4g}{unit}"
            for joint in scene.get("joint", ())
            if results.has(name := f"{analysis}/joints/{joint['name']}/coordinate") and len(results[name])
            for unit, factor in [UNITS.get(joint["type"], (None, 1.0))]
            if unit is not None
        ]
        if others:
            branch = branch_names(model, undeformed_posture(model).q)
            as_line = f" ({in_words(branch)})" if branch else ""
            return f"no guess in [initial]: {analysis} starts at {', '.join(others)}{as_line}"
    return ""
