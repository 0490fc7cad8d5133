"""How many modes of the links a scene needs for its tolerance: more and more are tried.

The first solves are cheap: few modes leave out the high frequencies, which hold the steps down.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array
from ..common.structs import struct
from ..mbs.model.body import Body

if TYPE_CHECKING:
    from ..scene.scene import Scene

Errors = Mapping[str, Mapping[str, float]]
"""By analysis and kind of quantity, relative to peaks."""


@struct
class ModeChoice:
    """Result of the search for the number of modes.

    Attributes:
        errors: estimated error that leaving out modes makes of the largest quantity of each kind, relative to its peak,
            by analysis and kind; 0 where all modes of the files were needed.
        before: likewise, how much the last solve differs from the one before it.
        tried: numbers of modal coordinates of all bodies together in the solves; the last is the one kept.
        seconds: of the solves before the last.
        highest: ω (rad/s) of the highest mode kept, and of the highest there is.
    """

    errors: Errors
    before: Errors
    tried: tuple[int, ...]
    seconds: float
    highest: tuple[float, float]


Reported = Mapping[str, Mapping[str, Array]]
"""Quantities of an analysis by kind and name, (T, …)."""

LEAST_RATIO = 0.1  # of two differences one after the other: better ones are luck
MARGIN = 0.5  # part of the tolerance that an estimate has to meet: it may be too small
SMALLEST = 1e-3  # of the largest peak of its kind: quantities below are measured against that


@dataclass
class ErrorEstimate:
    """Errors of the last of several solves with more and more modes, from the differences of the last three.

    Where these shrink by a ratio ρ from one to the next, the last solve is off by ρ/(1 − ρ) times the last difference.
    The largest ratio of any kind counts for all kinds of an analysis, and more than the difference is never assumed.
    """

    last: Mapping[str, Reported] = field(default_factory=dict)
    differences: Errors = field(default_factory=dict)
    errors: Errors = field(default_factory=dict)
    ratio: float | None = None

    def add(self, reported: Mapping[str, Reported]) -> None:
        """Add the results of the next solve, by analysis."""
        before, self.differences = self.differences, {}
        if self.last:
            self.differences = {name: difference(of, self.last[name]) for name, of in reported.items()}
        self.last = reported
        ratios = {name: _ratio(of, before[name]) for name, of in self.differences.items() if name in before}
        self.ratio = max(ratios.values(), default=None)
        self.errors = {
            name: {kind: d * _remaining(ratios.get(name, 1.0)) for kind, d in of.items()}
            for name, of in self.differences.items()
        }

    def meets(self, tolerances: Mapping[str, float]) -> bool:
        """Whether all errors, by analysis, are well within tolerance; needs at least two differences."""
        return self.ratio is not None and self._excess(tolerances) <= MARGIN

    def is_hopeless(self, tolerances: Mapping[str, float], more: int) -> bool:
        """Whether `more` further solves are not expected to meet the tolerances at the pace so far."""
        return self.ratio is not None and self._excess(tolerances) * self.ratio**more > MARGIN

    def _excess(self, tolerances: Mapping[str, float]) -> float:
        return max(max(of.values(), default=0.0) / tolerances[name] for name, of in self.errors.items())


def _ratio(now: Mapping[str, float], before: Mapping[str, float]) -> float:
    """Of two differences one after the other, the largest of all kinds."""
    return max((now[kind] / max(before[kind], 1e-300) for kind in now if now[kind] > 0.0), default=LEAST_RATIO)


def _remaining(ratio: float) -> float:
    """What is left to come, as a part of the last difference: a geometric series."""
    ratio = max(ratio, LEAST_RATIO)
    return min(1.0, ratio / (1.0 - ratio)) if ratio < 1.0 else 1.0


def difference(now: Reported, before: Reported) -> dict[str, float]:
    """Return, by kind, the largest difference of two solves relative to the peak of its quantity."""
    errors = {}
    for kind, quantities in now.items():
        peaks = {name: np.abs(values).max(initial=0.0) for name, values in quantities.items()}
        floor = max(SMALLEST * max(peaks.values(), default=0.0), 1e-300)
        changes = [
            float(np.abs(values - before[kind][name]).max(initial=0.0) / max(peaks[name], floor))
            for name, values in quantities.items()
        ]
        errors[kind] = max(changes, default=0.0)
    return errors


class ModeSearch:
    """Search for a sufficient number of modes.

    `tolerances` by analysis; `levels`: bodies with more and more modes, the last with all (`mode_levels`).
    """

    def __init__(self, tolerances: Mapping[str, float], levels: Sequence[Mapping[str, Body]]) -> None:
        self._tolerances = tolerances
        self._levels: Sequence[Mapping[str, Body]] = levels
        self._estimate, self._tried = ErrorEstimate(), list[int]()
        self.is_over = False  # whether the last solve is the one to keep
        self._level, self._completed = 0, False
        self._began = self._last = time.perf_counter()

    @property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies to solve with next; those of the solve to keep once it is over."""
        return self._levels[self._level]

    def add(self, reported: Mapping[str, Reported] | None, *, last: bool) -> None:
        """Add the results, by analysis, of a solve with `bodies`; None where some of them did not complete.

        It is the `last` one in any case where that is said.
        """
        self._tried.append(sum(body.n_modes for body in self.bodies.values()))
        self._completed = reported is not None
        if reported is not None:
            self._estimate.add(reported)
        enough = self._completed and self._estimate.meets(self._tolerances)
        self.is_over = not self._more or last or enough
        if not self.is_over:
            hopeless = not self._completed or self._estimate.is_hopeless(self._tolerances, self._more - 1)
            self._level = len(self._levels) - 1 if hopeless else self._level + 1
            self._last = time.perf_counter()

    @property
    def _more(self) -> int:
        return len(self._levels) - 1 - self._level

    def choice(self) -> ModeChoice:
        """Return numbers of modes tried, the kept ones and their estimated errors."""
        errors = self._estimate.errors if self._completed else {}
        if not self._more:
            errors = {name: dict.fromkeys(of, 0.0) for name, of in errors.items()}
        kept, every = (
            max(float(np.sqrt(b.stiffness.max(initial=0.0))) for b in level.values())
            for level in (self._levels[self._level], self._levels[-1])
        )
        seconds = self._last - self._began
        return ModeChoice(errors, self._estimate.differences, tuple(self._tried), seconds, (kept, every))


def error_tolerances(scene: Scene) -> dict[str, float]:
    """Return the error tolerance of each analysis; default of algebraic ones: the tightest of the integrated ones."""
    tightest = min((analysis.tolerance for analysis in scene.analysis if analysis.is_resumable), default=None)
    return {
        analysis.name: tightest
        if tightest is not None and not analysis.is_resumable and "tolerance" not in analysis.model_fields_set
        else analysis.tolerance
        for analysis in scene.analysis
    }
