"""Where the points of an analysis should be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array
from ..results.file import Results

PLACES = ("x", "y", "z")  # components of trajectories that are places


@dataclass(frozen=True)
class Target:
    """Where a point should be: the `columns` (0 for x, 1 for y, 2 for z) of its position, (T, m) in m."""

    trajectory: str
    point: str
    columns: tuple[int, ...]
    wanted: Array

    @property
    def places(self) -> Array:
        """(T, 3) m, zero where it specifies nothing."""
        found = np.zeros((len(self.wanted), 3))
        found[:, self.columns] = self.wanted
        return found


def targets(results: Results, analysis: str) -> list[Target]:
    """The target of every trajectory of a point, over the first outputs of the analysis.

    A forward analysis does not hold trajectories: its targets are those of the analysis its actuation comes from.
    """
    found = []
    time = results.time(analysis)
    holders = (analysis, str(results.attributes(analysis).get("actuation", "")))
    for trajectory in results.scene.get("trajectory", []):
        groups = {holder: f"{holder}/trajectories/{trajectory['name']}" for holder in holders}
        holder = next((h for h, group in groups.items() if results.has(f"{group}/target")), None)
        if holder is None or "point" not in trajectory:
            continue
        wanted, common = results.data(f"{groups[holder]}/target"), min(len(results.time(holder)), len(time))
        if np.allclose(time[:common], results.time(holder)[:common], rtol=0, atol=1e-12):
            components = [str(c) for c in results.attributes(groups[holder])["components"]]
            columns = tuple(PLACES.index(c) for c in components if c in PLACES)
            found.append(Target(trajectory["name"], trajectory["point"], columns, wanted[:common, : len(columns)]))
    return found
