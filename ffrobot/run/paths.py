"""What is found of paths before the analyses: frequencies of shapers, and the fastest motion that actuators can do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from ..mbs.model.model import Model
from ..mbs.scene.motion_keys import Shaper
from ..mbs.solve.path_frequencies import PathFrequencies, frequencies_along
from ..scene.scene import Scene
from .fastest import Judge, fastest

Frequencies = Callable[[float, float, int], PathFrequencies]
"""Of so many of the lowest vibrations from one time to another, s."""
Notes = tuple[str, ...]


def with_paths(scene: Scene, model: Model, judge: Judge, stage: Callable[[str], None]) -> tuple[Scene, Notes]:
    """The scene with shapers for the robot's own frequencies, stretched as far as `fastest` asks for; what was found.

    `model` is what vibrates. Raises `InputError` where there are no such frequencies, or no motion keeps the limits.
    """
    scene, notes = _shaped(scene, partial(frequencies_along, model))
    if any(trajectory.fastest for trajectory in scene.trajectory):
        stage("fastest motion")
        scene, note = fastest(scene, judge)
        notes = (*notes, note)
    return scene, notes


def _shaped(scene: Scene, frequencies: Frequencies) -> tuple[Scene, Notes]:
    """The scene with shapers for frequencies of the robot where they ask for these; notes on them and on tables."""
    asking = {one.name: one.shaper for one in scene.trajectory if one.shaper and one.shaper.asks_robot}
    tables = (one.waypoints for one in scene.trajectory if one.waypoints is not None)
    of_tables: Notes = tuple(dict.fromkeys(remark for table in tables for remark in table.remarks))
    if not asking:
        return scene, of_tables
    begin, end = _span(scene)
    found = frequencies(begin, end, max(shaper.modes for shaper in asking.values()))
    shapers: Mapping[str, Shaper] = {name: _for_robot(shaper, found) for name, shaper in asking.items()}
    changed = [one.changed(shaper=shapers[one.name]) if one.name in shapers else one for one in scene.trajectory]
    of_shapers: Notes = tuple(f"{name}: {_in_words(shaper, found)}" for name, shaper in asking.items())
    return scene.model_copy(update={"trajectory": tuple(changed)}), (*of_tables, *of_shapers)


def _for_robot(shaper: Shaper, found: PathFrequencies) -> Shaper:
    """The shaper for the mean frequencies and damping along the path."""
    frequency = tuple(found.frequency[:, : shaper.modes].mean(axis=0).tolist())
    damping_ratio = float(found.damping_ratio[:, : shaper.modes].mean())
    given = shaper.damping_ratio
    return Shaper(kind=shaper.kind, frequency=frequency, damping_ratio=damping_ratio if given is None else given)


def _in_words(shaper: Shaper, found: PathFrequencies) -> str:
    ranges = (f"{f.mean():.4g} Hz ({f.min():.4g} to {f.max():.4g} along the path)" for f in found.frequency.T)
    return f"{shaper.kind} shaper for {', '.join(list(ranges)[: shaper.modes])}"


def _span(scene: Scene) -> tuple[float, float]:
    """When the first path begins and the last one is over, s."""
    paths = [one.path for one in scene.trajectory]
    ends = [path.end for path in paths if path is not None]
    begins = [path.begin for path in paths if path is not None]
    return min(begins), max(ends)
