"""How far points are off the paths that they should follow: under control, and where torques act open loop."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import h5py
import numpy as np

from .actuators import read_unsupplied
from .joints import Scene
from .rounded import millimeters

AXES = "xyz"
SAME_TIME = 9  # digits of output times (s) that count


@dataclass(frozen=True)
class ToolError:
    """The largest distance of a point from its path in an analysis, m; None where the analysis does not ask for it.

    Attributes:
        controlled: with joints position-controlled on the computed angles, or in a closed loop; of analyses that
            prescribe the path and have actuators for it, the error of the computation.
        open_loop: with the computed torques applied open loop; beside `growth` an estimate for the first vibration.
        growth: 1/s, of the robot under these torques; 0 where it is not unstable or not known.
    """

    controlled: float | None = None
    open_loop: float | None = None
    growth: float = 0.0


def tool_error(group: h5py.Group, scene: Scene, *, feasible: bool | None) -> ToolError:
    """Of an analysis; `feasible` as its verdict says."""
    if "control" in group:
        return ToolError(controlled=float(group["control"].attrs["tip_error_max"]))
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
    """Of a replay: each point with its largest distance (m) from the path and the RMS, at outputs that both have.

    Of points whose path was given, along the axes for which it was.
    """
    name = str(group.attrs.get("actuation", ""))  # of an analysis that takes none: empty
    if not name or "control" in group:
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


def off_path_in_words(group: h5py.Group, scene: Scene) -> str:
    """As text; empty where there is nothing of that kind."""
    found = off_path(group, scene)
    return ", ".join(
        f"{name} off its path by {millimeters(most)} at most, {millimeters(rms)} RMS" for name, most, rms in found
    )
