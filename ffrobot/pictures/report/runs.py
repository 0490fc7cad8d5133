"""What a report is about: the analyses of one results file, or of several, each with a name of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os.path import abspath
from pathlib import Path

from ...results.file import Results


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
