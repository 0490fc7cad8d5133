"""Whether the outputs of a run show how its paths move, and whether the run is as long as its paths."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ...common.arrays import Array
from .._core import TimeFunction
from ..run.stops import path_times
from ..scene.analysis import TimedAnalysis
from ..scene.trajectories import Trajectory

MISSED = 1.5  # times the largest rate at outputs: faster motion between them
SLOWER = 1e-9  # relative
STILL = 0.5  # of a run, in which way points are over: the other part is rest


def path_warnings(analysis: object, times: Array, paths: Iterable[Trajectory]) -> Iterator[str]:
    """Yield warnings on features of `paths` that outputs at `times` (T,), s, of the `analysis` miss."""
    if not isinstance(analysis, TimedAnalysis) or np.count_nonzero((times >= 0.0) & (times <= analysis.end)) < 2:
        return  # it ended before the path began
    for path in paths:
        yield from _outside(path, analysis)
        yield from _slower_than_stops(path)
        yield from _unseen(path, times, analysis)


def _outside(path: Trajectory, analysis: TimedAnalysis) -> Iterator[str]:
    """Way points that the run does not come to, and a table that is over early."""
    if path.path is None:
        return
    begin, over, end = path.path.begin, path.path.end, analysis.end
    where, by_round_off = f'trajectory "{path.name}"', 1e-9 * end
    if begin < -by_round_off:
        yield f"{where}: begins at t = {begin:g} s, and the run at 0: what is before is left out"
    if over > end + by_round_off:
        share = f"{max(0.0, 100 * end / over):.3g} % of its time"
        yield f'{where}: is over at t = {over:g} s, beyond the end of "{analysis.name}" at {end:g} s, which has {share}'
    elif path.waypoints is not None and over < STILL * end:
        yield f'{where}: its waypoints are over at t = {over:g} s, and "{analysis.name}" rests until {end:g} s'


def _slower_than_stops(path: Trajectory) -> Iterator[str]:
    """A rounded path that takes longer than one with stops: where one corner passes a limit, all legs are slower."""
    if path.path is None or path.stopping is None or path.path.end <= (1 + SLOWER) * path.stopping.end:
        return
    yield (
        f'trajectory "{path.name}": blend = {path.blend:g} takes until t = {path.path.end:.4g} s, stops at all places'
        f" {path.stopping.end:.4g} s: one corner is too fast for the limits, and all path segments are slower for it"
    )


def _unseen(path: Trajectory, times: Array, analysis: TimedAnalysis) -> Iterator[str]:
    """The fastest of its components that moves faster between outputs than at any of them."""
    every = path_times(times, [path], analysis.end)
    between, seen = (some[(some >= 0.0) & (some <= analysis.end)] for some in (every, times))
    for _, target in path.targets:
        rate = np.abs(target.sample(between)[1])
        k = int(rate.argmax())
        if rate[k] > MISSED * (at_outputs := float(np.abs(target.sample(seen)[1]).max())):
            yield (
                f'trajectory "{path.name}": moves between outputs, at t = {between[k]:.4g} s with a rate of'
                f" {rate[k]:.4g}, but at outputs at most {at_outputs:.4g} (SI units). Peaks and verdicts include it,"
                f" histories and figures do not; an output_step of {_enough(target, between, k):.1g} s shows it"
            )
            return


def _enough(target: TimeFunction, times: Array, k: int) -> float:
    """A fifth of the time (s) for which the rate about times[k] is at least half as large."""
    slow = np.abs(target.sample(times)[1]) < 0.5 * abs(target.sample(times[[k]])[1][0])
    before, after = times[:k][slow[:k]], times[k:][slow[k:]]
    return float((after[0] if len(after) else times[-1]) - (before[-1] if len(before) else times[0])) / 5.0
