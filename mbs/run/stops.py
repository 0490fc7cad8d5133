"""Where steps of an integration must end, and at which times a prescribed motion is looked at.

A prescribed motion is known at any time: it is looked at where its paths and loads change, often enough that cubics
between the times miss values and rates by at most `resolved` of the largest. Steps see paths and loads at their stages
alone, so they end where these change briefly: a pulse that lasts 1.5e-4 of the run is in the peaks to 1e-3
(tests/mbs/test_peaks_between_outputs.py).
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans
from .._core import TimeFunction
from ..fields.expressions import ZERO
from ..posture.posture import misfits
from ..scene.analysis import TimedAnalysis
from ..scene.loads import Load
from ..scene.trajectories import Trajectory


class _Ends(NamedTuple):
    """The search for places where a function of time changes."""

    intervals: int = 2000  # of a run, even ones, from which the search begins
    most: int = 20_000  # times of a prescribed motion: what halving may make of 2000
    resolved: float = 1e-6  # of the largest value or rate of a path: what the trapezoidal rule may miss
    seen: float = 1e-3  # likewise, of rigid robots, whose peaks alone count
    bend: float = 4.0  # h ∫ |f''| of a step over the range of f: half a period of a sine (mbs/core: step_limit.h)
    rounds: int = 30  # of halving: 2^-30 of 1/2000 of the run is less than `shortest`
    shortest: float = 1e-9  # of a run, between two times: a spline through closer ones would swing
    unseen: float = 1e-11  # of a run: before a jump, where a load acts that begins at the end of the step
    brief: float = 0.01  # of a run: pieces of a path or load that are shorter end steps in `parts` of them
    far: float = 20.0  # times the longest way of a piece in the time of the run: what a brief piece has to move
    parts: int = 16  # of such a piece
    dense: int = 8  # times within an even interval: a hump of a quarter of it is met by two
    hump: float = 0.02  # of the range of a function, by which it has to leave the straight line in an interval
    few: float = 0.1  # of the intervals: a function with more humps oscillates, and steps find that


ENDS = _Ends()


@np.errstate(over="ignore", invalid="ignore")  # infinite loads end runs and are named as the cause
def stops(
    times: Array, paths: Iterable[Trajectory], loads: Iterable[TimeFunction], *, is_driven: bool, is_replay: bool
) -> Array:
    """Times (n,), s, at which integration steps must end in a run with outputs at `times` (T,), s.

    Steps end where a condition such as t < 0.1 changes in paths and loads, and in brief pieces in which a path moves
    far or conditions change.
    `is_driven`: paths alone move the robot; steps also end where its forces have to be looked at. `is_replay`: forces
    follow from other paths; steps also end where these bend.
    """
    ends, paths, loads = times[[0, -1]], list(paths), list(loads)
    targets = [target for path in paths for _, target in path.targets]
    duration = ends[1] - ends[0]
    at = [ends, *(_brief_parts(function, ends) for function in (*targets, *loads))]
    at += [_humps(function, ends) for function in (*_formulas(paths), *loads)]
    for path in paths:
        if path.path is not None and duration > 0.0:
            breaks = path.path.breaks
            way = np.abs(np.diff(path.path.sample(breaks), axis=0)).max(axis=1, initial=0.0)
            last = np.diff(breaks)
            is_far = way * duration > ENDS.far * last * way.max(initial=0.0)
            at.append(_parts(breaks, (last < ENDS.brief * duration) & is_far))
    for load in loads:  # just before jumps, too: means over time are by the values on both sides
        switches, jumps = np.array(load.switches()), _jumps(load, ends)
        at += [switches, switches - ENDS.shortest * duration, jumps, jumps - ENDS.unseen * duration]
    if is_driven and duration > 0.0:
        grid = np.union1d(_even(ends), np.concatenate(at))
        at += [np.setdiff1d(_resolved(function, grid, ENDS.seen), grid) for function in (*targets, *loads)]
    if is_replay and duration > 0.0:
        at += [_bends(target, _even(ends)) for target in targets]
    return _inside(np.concatenate(at), ends)


def _inside(times: Array, ends: Array) -> Array:
    """(n,) s: the times between the ends, ascending."""
    every = np.unique(times)
    return every[(every > ends[0]) & (every < ends[1])]


def _even(ends: Array, dense: int = 1) -> Array:
    """(n,) s: times from ends[0] to ends[1], `dense` in each of the even intervals."""
    return np.linspace(ends[0], ends[1], ENDS.intervals * dense + 1)


def _brief_parts(function: TimeFunction, ends: Array) -> Array:
    """Times (n,) s from ends[0] to ends[1] at which conditions of the function change, and parts of brief pieces."""
    pieces = np.union1d(np.clip(function.switches(), *ends), ends)
    return np.union1d(pieces, _parts(pieces, np.diff(pieces) < ENDS.brief * np.ptp(ends)))


def _humps(function: TimeFunction, ends: Array) -> Array:
    """Times (n,) s about places where a function comes and goes between two `_even` times; none where it does all over.

    Of times that are `ENDS.dense` times as close those in such intervals and in the ones next to them. Jumps are left
    out, but those back in one of the next two intervals: steps find them, and end at those that conditions tell.
    """
    times = _even(ends, ENDS.dense)
    values = np.nan_to_num(function.sample(times)[0])
    if ENDS.dense * np.abs(np.diff(values)).max() <= ENDS.hump * np.ptp(values):
        return times[:0]  # no interval has that much of the range
    off = np.abs(values - np.interp(times, times[:: ENDS.dense], values[:: ENDS.dense]))
    three = np.arange(ENDS.intervals - 2)[:, None] * ENDS.dense + np.arange(3 * ENDS.dense + 1)
    cells, off = values[three], off[three].max(axis=1)
    change, range_ = cells[:, -1] - cells[:, 0], np.ptp(cells, axis=1)
    steps = np.abs(np.diff(cells, axis=1)).max(axis=1)
    leaving = (off > ENDS.hump * np.ptp(values)) & (np.minimum(np.abs(change), steps) < 0.5 * range_)
    if not 0 < np.count_nonzero(leaving) < ENDS.few * ENDS.intervals:
        return times[:0]
    about = np.convolve(leaving, np.ones(5))[1:-1] > 0
    about &= np.histogram(function.switches(), times[:: ENDS.dense])[0] == 0
    return times[:-1][np.repeat(about, ENDS.dense)]


def _jumps(load: TimeFunction, ends: Array) -> Array:
    """Times (n,) s behind jumps of a load, but at its switches."""
    a = _even(ends, ENDS.dense)
    at = misfits(load, a, 0) > ENDS.hump * np.ptp(load.sample(a)[0])
    at &= np.histogram(load.switches(), a)[0] == 0
    a, b = a[:-1][at], a[1:][at]
    left, right = load.sample(a)[0], load.sample(b)[0]
    for _ in range(ENDS.rounds):
        middle = (a + b) / 2
        value = load.sample(middle)[0]
        a, b = np.where(np.abs(value - left) < np.abs(value - right), (middle, b), (a, middle))
    return b[2 * np.abs(load.sample(b)[0] - load.sample(a)[0]) > np.abs(right - left)]


def _bends(target: TimeFunction, grid: Array) -> Array:
    """Times (n,) s of the grid and between them, so that no step from one to the next passes more than half a period.

    That is h ∫ |f''| ≤ 4 of accelerations f over their range, as of the loads that steps know of (`step_limit.h`).
    """
    times = _resolved(target, grid, ENDS.seen)
    f = np.nan_to_num(target.sample(times)[2])
    bend = np.concatenate([[0.0], np.abs(np.diff(np.diff(f) / np.diff(times))), [0.0]]).cumsum()
    most, at, last = ENDS.bend * float(np.ptp(f)), [], 0
    for k in range(1, len(times)):
        if (bend[k] - bend[last]) * (times[k] - times[last]) > most:
            last = max(last + 1, k - 1)
            at.append(times[last])
    return np.array(at)


def _parts(breaks: Array, chosen: Booleans) -> Array:
    """Ends of the parts of `chosen` (n,) pieces between `breaks` (n + 1,), s."""
    return np.linspace(breaks[:-1][chosen], breaks[1:][chosen], ENDS.parts + 1).ravel()


def path_times(times: Array, paths: Iterable[Trajectory], end: float, others: Iterable[TimeFunction] = ()) -> Array:
    """Times (n,), s: outputs `times` (T,), and times between that resolve `paths` from 0 to `end` (s).

    `others`: loads and other prescribed functions, which are resolved, too.
    """
    paths, others, ends = list(paths), list(others), times[[0, -1]]
    functions = [*(target for path in paths for _, target in path.targets), *others]
    times = with_others(times, _even(ends))
    of_paths = (path.path.breaks for path in paths if path.path is not None)
    of_pieces = (_brief_parts(function, ends) for function in functions)
    of_humps = (_humps(function, ends) for function in (*_formulas(paths), *others))
    times = with_others(times, _inside(np.concatenate([ends, *of_paths, *of_pieces, *of_humps]), ends))
    moving = (times >= 0.0) & (times <= end)
    inside = times[moving]
    if len(inside) > 1:  # a run may end before the path begins
        for function in functions:
            inside = _resolved(function, inside)
    return np.union1d(times[~moving], inside)


def with_others(times: Array, others: Array) -> Array:
    """(T,) s: `times`, and `others` that are not next to one of them: a spline through both would swing."""
    at = np.clip(np.searchsorted(times, others), 1, max(len(times) - 1, 1))
    gap = np.minimum(np.abs(others - times[at - 1]), np.abs(others - times[np.minimum(at, len(times) - 1)]))
    return np.union1d(times, others[gap > ENDS.shortest * np.ptp(times)])


def _formulas(paths: Iterable[Trajectory]) -> Iterator[TimeFunction]:
    """Targets of which no breaks are known."""
    yield from (target for path in paths if path.path is None for _, target in path.targets)


def _resolved(target: TimeFunction, times: Array, share: float = ENDS.resolved) -> Array:
    """The times with others between them, where value or rate change more than their derivatives at both ends say.

    By a `share` of their size.
    """
    for _ in range(ENDS.rounds):
        value, rate, _ = target.sample(times)
        sizes = float(np.ptp(value)), float(np.abs(rate).max())
        rough = np.zeros(len(times) - 1, dtype=bool)
        for order, size in enumerate(sizes):
            rough |= misfits(target, times, order) > share * size
        rough &= np.diff(times) > ENDS.shortest * (times[-1] - times[0])
        if not rough.any() or len(times) + np.count_nonzero(rough) > ENDS.most:
            break
        times = np.sort(np.append(times, 0.5 * (times[:-1] + times[1:])[rough]))
    return times


MISSED = 1.5  # times the largest rate at outputs: faster motion between them
SLOWER = 1e-9  # relative
STILL = 0.5  # of a run, in which way points are over: the other part is rest


def unseen_loads(loads: Iterable[Load], ends: Array) -> Iterator[str]:
    """Yield notes on `loads` of which nothing is seen from ends[0] to ends[1], s."""
    times = _even(ends, ENDS.dense)
    for number, load in enumerate(loads, 1):
        for key, function in load.components.items():
            if function is not ZERO and not any(function.sample(part)[0].any() for part in np.array_split(times, 32)):
                yield f"load no. {number}: {key} is 0 at all {len(times)} sampled times; it may have briefer pulses"


def path_warnings(analysis: object, times: Array, paths: Iterable[Trajectory]) -> Iterator[str]:
    """Yield warnings on features of `paths` that outputs of the `analysis` at `times` (T,), s, miss."""
    if not isinstance(analysis, TimedAnalysis) or np.count_nonzero((times >= 0.0) & (times <= analysis.end)) < 2:
        return  # it ended before the path began
    for path in paths:
        yield from _outside(path, analysis)
        if path.path and path.stopping and path.path.end > (1 + SLOWER) * path.stopping.end:
            yield (
                f'trajectory "{path.name}": blend = {path.blend:g} takes until t = {path.path.end:.4g} s, stops at all'
                f" places {path.stopping.end:.4g} s: one corner is too fast for the limits, and all path segments are"
                " slower for it"
            )
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
