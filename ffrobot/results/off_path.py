"""How far points are off their paths, in results files: replays, controlled tips, open loops."""

from __future__ import annotations

from collections.abc import Iterator

import h5py
import numpy as np

from ..common.peaks import largest, root_mean_square
from ..mbs.quantities.motion import point_motion
from ..run.result import AnalysisResult
from ..run.solution import Solution
from .actuators import read_unsupplied
from .joints import Scene
from .kinds import own_results
from .verdict import ToolError

AXES = "xyz"
SAME = 1e-9  # of a time: what differs by less is round-off
SAME_TIME = 9  # digits of output times (s) that count


def write_off_path(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Write off_path/: distance of a replay from the paths of its actuation, at outputs and between."""
    source, run = str(group.attrs["actuation"]), result.histories.run
    if source not in solution.analyses or own_results(group).is_controlled or not len(run.time):
        return
    of, last = group.parent[source], solution.analyses[source].analysis.last_time
    both = (run.time >= of["time"][0]) & (run.time <= of["time"][-1] * (1.0 + SAME))
    inside = np.clip(run.time[both], 0.0, last)
    for trajectory in run.model.scene.trajectory:
        if f"trajectories/{trajectory.name}/target" in of and trajectory.point is not None and trajectory.components:
            position = point_motion(run, trajectory.point).position[both]
            off = [position[:, "xyz".index(axis)] - f.sample(inside)[0] for axis, f in trajectory.components.items()]
            distance = np.linalg.norm(off, axis=0)
            entry = group.create_group(f"off_path/{trajectory.name}")
            entry.attrs["point"], entry.attrs["distance"] = trajectory.point, largest(run.time[both], distance)[0]
            entry.attrs["distance_rms"] = root_mean_square(run.time[both], distance)


def tool_error(group: h5py.Group, scene: Scene, *, feasible: bool | None) -> ToolError:
    """Return the tool error of an analysis; `feasible` is that of its verdict."""
    own = own_results(group)
    if own.is_controlled and (about := own.about(group)):
        return ToolError(controlled=float(about["tip_error_max"]))
    if (replayed := max((most for _, most, _ in off_path(group, scene)), default=None)) is not None:
        return ToolError(open_loop=replayed)
    missed = read_unsupplied(group["feasibility"]) if "feasibility" in group else None
    if missed is not None and missed.point:
        growth = missed.growth if np.isfinite(missed.growth) else 0.0
        return ToolError(missed.angles_kept, missed.moments_repeated, growth)
    if feasible and missed is None:
        return ToolError(max((most for _, most, _ in _apart(group, group, scene)), default=None))
    return ToolError()


def off_path(group: h5py.Group, scene: Scene) -> Iterator[tuple[str, float, float]]:
    """Yield each point of a replay with its largest and RMS distance (m) from the path, over their common time.

    Of points whose path was given, along the axes for which it was; of old files at outputs that both have.
    """
    if "off_path" in group:
        for one in group["off_path"].values():
            yield str(one.attrs["point"]), float(one.attrs["distance"]), float(one.attrs["distance_rms"])
        return
    name = str(group.attrs.get("actuation", ""))  # of an analysis that takes none: empty
    if not name or own_results(group).is_controlled:
        return
    if (source := group.parent.get(name)) is not None:
        yield from _apart(group, source, scene)


def _apart(group: h5py.Group, source: h5py.Group, scene: Scene) -> Iterator[tuple[str, float, float]]:
    """Points of `group` from the paths that `source` follows."""
    times, path_times = (one["time"][()].round(SAME_TIME) for one in (group, source))
    shared, now, then = np.intersect1d(times, path_times, return_indices=True)
    for record in scene.get("trajectory", ()):
        point, path = f"points/{record.get('point')}/position", f"trajectories/{record['name']}"
        if not len(shared) or point not in group or f"{path}/target" not in source:
            continue
        places = [(k, AXES.index(axis)) for k, axis in enumerate(source[path].attrs["components"]) if axis in AXES]
        target, position = source[f"{path}/target"][()][then], group[point][()][now]
        off = np.sqrt(sum((position[:, axis] - target[:, k]) ** 2 for k, axis in places))
        if places:
            yield str(record["point"]), float(off.max()), float(np.sqrt(np.mean(off**2)))
