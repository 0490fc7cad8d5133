"""About what a robot is linearised: an equilibrium, or instants of an earlier analysis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydantic import Field

from ...common.arrays import Array
from ...common.errors import InputError, did_you_mean, quoted
from ..fields.field_types import NotNegative
from ..scene.analysis import Analysis, Surroundings, TimedAnalysis
from .outcome import Outcome

STATIC = "static"  # instead of an analysis' name: about the static equilibrium
NEAR = 1e-9  # of the end of an analysis: how far from an output a time may be for rounding


class InstantAnalysis(Analysis):
    """`about` the static equilibrium (not given, or "static") or an earlier analysis at `times`."""

    about: str | None = None
    """Earlier analysis of a motion, or "static" (the default): the equilibrium at t = 0."""
    instants: tuple[NotNegative, ...] | None = Field(default=None, alias="times", min_length=1)
    """Instants of that analysis, s."""

    is_motion = False

    @property
    def times(self) -> Array:
        """The instants (T,), s; 0 where none are given."""
        return np.zeros(1) if self.instants is None else np.array(self.instants)

    @property
    def source(self) -> str | None:
        """Name of the analysis it is about; None for the equilibrium."""
        return None if self.about == STATIC else self.about

    @property
    def needs_times(self) -> bool:
        """Whether a motion is of use only at given times."""
        return True

    def problems(self, among: Surroundings) -> Iterator[str]:
        """Whether there is such a motion, and times that fit it."""
        if self.source is None:
            if self.instants is not None:
                yield f'times: expected none about "{STATIC}", found {quoted(f"{t:g}" for t in self.instants)}'
            return
        sources = {other.name: other for other in among.earlier if other.is_motion}
        source = sources.get(self.source)
        if source is None:
            known, hint = quoted((STATIC, *sources)), did_you_mean(self.source, sources)
            yield f'about: expected an earlier analysis of a motion, {known}, found "{self.source}"{hint}'
            return
        if self.instants is None and self.needs_times:
            yield f'times: expected the times of "{source.name}" about which to be linear, found none'
        for t in self.instants or ():
            if t - source.last_time > NEAR * source.last_time:
                yield f'times: expected at most {source.last_time!r}, where "{source.name}" ends, found {t!r}'


def of_earlier(source: Outcome, analysis: Analysis) -> Outcome:
    """The motion of `source` as that of `analysis`, which has made no steps of its own."""
    statistics = replace(source.statistics, steps=0, evaluations=0, wall_seconds=0.0, warnings=())
    return replace(source, analysis=analysis, statistics=statistics, prescribed=None, look_closer=None)


def row_at(path: Path, analysis: Analysis, source: Outcome, t: float) -> int:
    """The output of an earlier analysis at time t. Raises `InputError` where there is none."""
    row = int(np.abs(source.time - t).argmin())
    if abs(source.time[row] - t) > NEAR * source.analysis.last_time:
        every = f"every {source.analysis.output_step:g} s " if isinstance(source.analysis, TimedAnalysis) else ""
        raise InputError(
            f'{path}: analysis "{analysis.name}": times: expected output times of "{source.analysis.name}",'
            f" {every}up to {source.time[-1]:g} s, found {t:g}"
        )
    return row
