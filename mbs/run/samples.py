"""Where a run is looked at between its outputs: what is largest in it does not depend on where these are.

An integration keeps the ends of its steps, which resolve whatever rings above its tolerance, and times between them
where steps are long. A prescribed motion is known at any time: it is looked at where its paths and loads change.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from ...common.arrays import Array, Booleans, Indices, as_floats
from .. import _core
from .._core import TimeFunction
from ..posture.posture import misfits
from ..scene.analysis import IntegratedAnalysis
from ..scene.trajectories import Trajectory

FEWEST = 2000  # intervals of a run
KEPT = 16_777_216  # numbers of the states of an integration at most, 128 MiB
PARTS_OF_STEP = 4  # of integrations that others repeat
ALL_LOOKED_AT = 16_384  # states of a loop; of more, those from which others follow; of repeated runs as many a part
FOLLOWS = 1e-4  # of the largest value, by which linear interpolation may miss one
MANY = 65_536  # of these samples, and those that are looked at at once
THINNED = 0.98  # of the samples, from one pass over them to the next
LOOKED_AT = 2000  # of these, those at which steps have to end, and all others next to the largest values
HIGHEST = 4  # local maxima of each quantity
MOST = 20_000  # times of a prescribed motion
RESOLVED = 1e-6  # of the largest value or rate of a path: what the trapezoidal rule may miss between two times
SEEN = 1e-3  # likewise, of rigid robots
MOST_BEND = 4.0  # see `_bends`
ROUNDS = 30  # of halving
SHORTEST = 1e-9  # of a run, between two times
SAME = 1e-13  # of the latest time, by which equal ones differ at most
BRIEF, FAR = 0.01, 20.0  # of a run; times the longest way of a piece in the time of the run: see `stops`
PARTS = 16  # of such a piece
DENSE, HUMP, FEW = 8, 0.02, 0.1  # times within an interval, of the range, of the intervals: see `_humps`


def new_samples(times: Array, analysis: IntegratedAnalysis, size: int) -> _core.Samples | None:
    """Samples for an integration over the output `times` (T,), s; None where there is nothing to integrate.

    `size`: numbers of a state, 0 of a robot that cannot move. Runs whose differences count have more samples: their
    peaks have to be known as well as their derivatives.
    """
    duration, parts = float(times[-1] - times[0]), PARTS_OF_STEP if analysis.keep_steps or analysis.is_repeated else 1
    return _core.Samples(duration / FEWEST, max(KEPT // size, FEWEST), parts) if size and duration > 0.0 else None


def reached_samples(samples: _core.Samples | None, time: Array) -> tuple[Array, Array] | None:
    """Times (k,), s, and states (k, n) of those before the last output, of `time` (T,); None where there are none."""
    if samples is None or not len(time):
        return None
    times = samples.times  # ascending
    reached = int(np.searchsorted(times, time[-1], side="right"))
    return (times[:reached], samples.states.reshape(len(times), -1)[:reached]) if reached else None


def some_of(times: Array, rates: Array, ends: Array, most: int) -> Indices:
    """Numbers of some of the samples at `times` (k,), s, at `most` and about the highest of `rates` (k, n_v).

    The first, the last, and those at which steps have to end are among them.
    """
    count = len(times)
    at_ends = np.flatnonzero(np.isin(times, ends))
    some = np.unique(np.concatenate([np.arange(0, count, -(-count // most)), at_ends, [count - 1]]))
    return some if len(some) == count else np.union1d(some, about_highest(np.arange(count), rates, 2))


def telling(times: Array, values: Array, sizes: Array) -> Indices:
    """Numbers of the samples at `times` (k,), s, between which `values` (k, columns) are linear.

    But for `FOLLOWS` of their `sizes` (columns,). The ends of `LOOKED_AT` intervals are among them. Of what rings all
    the time there are too many: then those about the highest values, and some at even distances for the means.
    """
    chain, misses = np.arange(len(times)), FOLLOWS * sizes
    while len(chain) > 2:
        middle = np.arange(1, len(chain) - 1, 2)
        before, at, after = (chain[middle + shift] for shift in (-1, 0, 1))
        share = ((times[at] - times[before]) / (times[after] - times[before]))[:, None]
        off = np.abs(values[at] - (1.0 - share) * values[before] - share * values[after])
        left = np.delete(chain, middle[(off <= misses).all(axis=1)])
        if len(left) > THINNED * len(chain):
            break
        chain = left
    if len(chain) > MANY:
        chain = np.union1d(chain[:: -(-len(chain) // MANY)], about_highest(np.arange(len(times)), values, 2))
    return np.union1d(chain, np.arange(0, len(times), -(-len(times) // LOOKED_AT)))


def about_highest(some: Indices, quantities: Array, beside: int = 1) -> Indices:
    """All samples about the highest of `quantities` (T, columns), which were found at `some` (T,).

    From `beside` of these before each to as many behind.
    """
    tops = sorted({k for column in np.abs(quantities).T for k in _highest(column)})
    about = [np.arange(some[max(k - beside, 0)], some[min(k + beside, len(some) - 1)] + 1) for k in tops]
    return np.unique(np.concatenate([some[:0], *about]))


def _highest(values: Array) -> list[int]:
    """Numbers of the highest local maxima of values (T,)."""
    inner = np.pad(values, 1, constant_values=-np.inf)
    tops = np.flatnonzero((values >= inner[:-2]) & (values >= inner[2:]) & (values > 0.0))
    return [int(k) for k in tops[np.argsort(-values[tops], kind="stable")[:HIGHEST]]]


def in_order(outputs: Array, samples: Array) -> Indices:
    """Rows of outputs (T,) with samples (k,) behind them, both in s and ascending, in the order of time.

    Of times that are equal to round-off the output alone: steps that end at samples of a controller meet outputs so.
    """
    times, after = np.concatenate([outputs, samples]), np.searchsorted(outputs, samples)
    padded = np.concatenate([[-np.inf], outputs, [np.inf]])
    apart = np.minimum(samples - padded[after], padded[after + 1] - samples) > SAME * np.abs(times).max(initial=0.0)
    rows = np.concatenate([np.arange(len(outputs)), len(outputs) + np.flatnonzero(apart)])
    return rows[np.unique(times[rows], return_index=True)[1]]


def stops(
    times: Array, paths: Iterable[Trajectory], loads: Iterable[TimeFunction], *, is_driven: bool, is_replay: bool
) -> Array:
    """Return times (n,), s, at which integration steps must end.

    Steps look at paths and loads at their stages alone, and might pass a pulse. So they end where conditions of paths
    and loads change, t < 0.1 at 0.1 s, and along parts of brief pieces in which a path moves far or conditions change.
    Steps of rigid robots may be as long as the run. `is_driven`: paths alone move the robot, and steps end where its
    forces have to be looked at. `is_replay`: forces follow from paths that steps do not know, and end where these bend.
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
            is_far = way * duration > FAR * last * way.max(initial=0.0)
            at.append(_parts(breaks, (last < BRIEF * duration) & is_far))
    # just before loads jump, too: a mean over time is by the values on both sides
    at += [np.array(load.switches()) - SHORTEST * duration for load in loads]
    if is_driven and duration > 0.0:
        grid = np.union1d(_even(ends), np.concatenate(at))
        at += [np.setdiff1d(_resolved(function, grid, SEEN), grid) for function in (*targets, *loads)]
    if is_replay and duration > 0.0:
        at += [_bends(target, _even(ends)) for target in targets]
    return _inside(np.concatenate(at), ends)


def _inside(times: Array, ends: Array) -> Array:
    """(n,) s: the times between the ends, ascending."""
    every = np.unique(times)
    return every[(every > ends[0]) & (every < ends[1])]


def _even(ends: Array) -> Array:
    """(n,) s: the fewest times from ends[0] to ends[1]."""
    return np.linspace(ends[0], ends[1], FEWEST + 1)


def _brief_parts(function: TimeFunction, ends: Array) -> Array:
    """Times (n,) s from ends[0] to ends[1] at which conditions of the function change, and parts of brief pieces."""
    pieces = np.union1d(np.clip(function.switches(), *ends), ends)
    return np.union1d(pieces, _parts(pieces, np.diff(pieces) < BRIEF * np.ptp(ends)))


def _humps(function: TimeFunction, ends: Array) -> Array:
    """Times (n,) s about places where a function comes and goes between two `_even` times; none where it does all over.

    Of times that are `DENSE` times as close those in such intervals and in the ones next to them. Jumps are left out:
    steps find them, and end at those that conditions tell.
    """
    times = np.linspace(ends[0], ends[1], FEWEST * DENSE + 1)
    values = np.nan_to_num(function.sample(times)[0])
    cells = values[np.arange(FEWEST)[:, None] * DENSE + np.arange(DENSE + 1)]
    change, range_ = cells[:, -1] - cells[:, 0], np.ptp(cells, axis=1)
    off = np.abs(cells - cells[:, :1] - change[:, None] * np.linspace(0.0, 1.0, DENSE + 1)).max(axis=1)
    steps = np.abs(np.diff(cells, axis=1)).max(axis=1)
    leaving = (off > HUMP * np.ptp(values)) & (np.minimum(np.abs(change), steps) < 0.5 * range_)
    if not 0 < np.count_nonzero(leaving) < FEW * FEWEST:
        return times[:0]
    about = np.convolve(leaving, np.ones(3), mode="same") > 0
    about &= np.histogram(function.switches(), times[::DENSE])[0] == 0
    return times[:-1][np.repeat(about, DENSE)]


def _bends(target: TimeFunction, grid: Array) -> Array:
    """Times (n,) s of the grid and between them, so that no step from one to the next passes more than half a period.

    That is h ∫ |f''| ≤ 4 of accelerations f over their range, as of the loads that steps know of (`step_limit.h`).
    """
    times = _resolved(target, grid, SEEN)
    f = np.nan_to_num(target.sample(times)[2])
    bend = np.concatenate([[0.0], np.abs(np.diff(np.diff(f) / np.diff(times))), [0.0]]).cumsum()
    most, at, last = MOST_BEND * float(np.ptp(f)), [], 0
    for k in range(1, len(times)):
        if (bend[k] - bend[last]) * (times[k] - times[last]) > most:
            last = max(last + 1, k - 1)
            at.append(times[last])
    return np.array(at)


def _parts(breaks: Array, chosen: Booleans) -> Array:
    """Ends of the parts of `chosen` (n,) pieces between `breaks` (n + 1,), s."""
    return np.linspace(breaks[:-1][chosen], breaks[1:][chosen], PARTS + 1).ravel()


def path_times(times: Array, paths: Iterable[Trajectory], end: float, others: Iterable[TimeFunction] = ()) -> Array:
    """Return times (T,), s: outputs `times`, and enough times between for `paths` from 0 to `end` (s).

    `others`: loads, and whatever else is prescribed.
    """
    paths, others, ends = list(paths), list(others), times[[0, -1]]
    functions = [*(target for path in paths for _, target in path.targets), *others]
    times = _with_others(times, _even(ends))
    of_paths = (path.path.breaks for path in paths if path.path is not None)
    of_pieces = (_brief_parts(function, ends) for function in functions)
    of_humps = (_humps(function, ends) for function in (*_formulas(paths), *others))
    times = _with_others(times, _inside(np.concatenate([ends, *of_paths, *of_pieces, *of_humps]), ends))
    moving = (times >= 0.0) & (times <= end)
    inside = times[moving]
    if len(inside) > 1:  # a run may end before the path begins
        for function in functions:
            inside = _resolved(function, inside)
    return np.union1d(times[~moving], inside)


def _with_others(times: Array, others: Array) -> Array:
    """(T,) s: `times`, and `others` that are not next to one of them: a spline through both would swing."""
    at = np.clip(np.searchsorted(times, others), 1, max(len(times) - 1, 1))
    gap = np.minimum(np.abs(others - times[at - 1]), np.abs(others - times[np.minimum(at, len(times) - 1)]))
    return np.union1d(times, others[gap > SHORTEST * np.ptp(times)])


def _formulas(paths: Iterable[Trajectory]) -> Iterator[TimeFunction]:
    """Targets of which no breaks are known."""
    yield from (target for path in paths if path.path is None for _, target in path.targets)


def _resolved(target: TimeFunction, times: Array, share: float = RESOLVED) -> Array:
    """The times with others between them, where value or rate change more than their derivatives at both ends say.

    By a `share` of their size.
    """
    for _ in range(ROUNDS):
        value, rate, _ = target.sample(times)
        sizes = float(np.ptp(value)), float(np.abs(rate).max())
        rough = np.zeros(len(times) - 1, dtype=bool)
        for order, size in enumerate(sizes):
            rough |= misfits(target, times, order) > share * size
        rough &= np.diff(times) > SHORTEST * (times[-1] - times[0])
        if not rough.any() or len(times) + np.count_nonzero(rough) > MOST:
            break
        times = np.sort(np.concatenate([times, as_floats(0.5 * (times[:-1] + times[1:])[rough])]))
    return times
