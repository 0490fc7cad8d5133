"""What a report is about: the analyses of one results file, or of several, each with a name of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os.path import abspath
from pathlib import Path

import numpy as np

from ...common.arrays import Array
from ...results.file import Results

PLACES = ("x", "y", "z")  # components of trajectories that are places


@dataclass(frozen=True)
class Run:
    """One analysis of one results file.

    Attributes:
        label: of the run; `source` tells the file, and is empty where there is only one.
    """

    results: Results
    analysis: str
    source: str

    @property
    def label(self) -> str:
        """Its name on the page, unique."""
        return f"{self.source}: {self.analysis}" if self.source else self.analysis


def sources(files: Sequence[Results]) -> list[str]:
    """What tells the files apart: nothing for one, the names of their scenes, or where their paths differ."""
    if len(files) == 1:
        return [""]
    names = [results.name for results in files]
    return names if len(set(names)) == len(names) else distinct_parts([results.path for results in files])


def distinct_parts(paths: Sequence[Path]) -> list[str]:
    """Each path without what all have at start and end: `beam` and `solid` of `c/beam/r.h5` and `c/solid/r.h5`.

    The same file twice gets numbers.
    """
    parts = [Path(abspath(path)).parts for path in paths]  # without ".."
    shortest = min(len(p) for p in parts)
    start = next((k for k in range(shortest) if len({p[k] for p in parts}) > 1), shortest - 1)
    end = next((k for k in range(shortest - start) if len({p[-1 - k] for p in parts}) > 1), 0)
    labels = ["/".join(p[start : len(p) - end]) for p in parts]
    if len(set(labels)) == len(labels):
        return labels
    return [f"{label} ({k + 1})" for k, label in enumerate(labels)]


def runs(files: Sequence[Results]) -> list[Run]:
    """Every analysis of every file, in order."""
    return [
        Run(results, analysis, source)
        for results, source in zip(files, sources(files), strict=True)
        for analysis in results.analyses
    ]


@dataclass(frozen=True)
class Target:
    """Where a point of a run should be: the `columns` (0 for x, 1 for y, 2 for z) of its position, (T, m) in m."""

    trajectory: str
    point: str
    columns: tuple[int, ...]
    wanted: Array


def targets(run: Run) -> list[Target]:
    """The target of every trajectory of a point, over the first outputs of the run.

    A forward analysis does not hold trajectories: its targets are those of the analysis its actuation comes from.
    """
    results, found = run.results, []
    time = results.time(run.analysis)
    holders = (run.analysis, str(results.attributes(run.analysis).get("actuation", "")))
    for trajectory in results.scene.get("trajectory", []):
        groups = {holder: f"{holder}/trajectories/{trajectory['name']}" for holder in holders}
        holder = next((h for h, group in groups.items() if results.has(f"{group}/target")), None)
        if holder is None or "point" not in trajectory:
            continue
        wanted, common = results.data(f"{groups[holder]}/target"), min(len(results.time(holder)), len(time))
        if np.allclose(time[:common], results.time(holder)[:common], rtol=0, atol=1e-12):
            components = [str(c) for c in results.attributes(groups[holder])["components"]]
            columns = tuple("xyz".index(c) for c in components if c in PLACES)
            found.append(Target(trajectory["name"], trajectory["point"], columns, wanted[:common, : len(columns)]))
    return found
