"""How far points are off the paths that they had in the analysis whose findings a forward one carries out."""

from __future__ import annotations

from collections.abc import Iterator

import h5py
import numpy as np

from .joints import Scene

AXES = "xyz"
SAME_TIME = 9  # digits of output times (s) that count


def off_path(group: h5py.Group, scene: Scene) -> Iterator[tuple[str, float, float]]:
    """Of a replay: each point with its largest distance (m) from the path and the RMS, at outputs that both have.

    Of points whose path was given, along the axes for which it was.
    """
    name = str(group.attrs.get("actuation", ""))  # of an analysis that takes none: empty
    if not name or "control" in group:
        return
    source = group.parent.get(name)
    if source is None:
        return
    times, path_times = (one["time"][()].round(SAME_TIME) for one in (group, source))
    shared, now, then = np.intersect1d(times, path_times, return_indices=True)
    for record in scene.get("trajectory", ()):
        point, path = f"points/{record.get('point')}/position", f"trajectories/{record['name']}"
        if not len(shared) or point not in group or path not in source:
            continue
        places = [(k, AXES.index(axis)) for k, axis in enumerate(source[path].attrs["components"]) if axis in AXES]
        target, position = source[f"{path}/target"][()][then], group[point][()][now]
        off = np.sqrt(sum((position[:, axis] - target[:, k]) ** 2 for k, axis in places))
        if places:
            yield str(record["point"]), float(off.max()), float(np.sqrt(np.mean(off**2)))


def off_path_in_words(group: h5py.Group, scene: Scene) -> str:
    """As text; empty where there is nothing of that kind."""
    found = off_path(group, scene)
    return ", ".join(
        f"{name} off its path by {1e3 * most:.4g} mm at most, {1e3 * rms:.4g} mm RMS" for name, most, rms in found
    )
