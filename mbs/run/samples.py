"""Which states of an integration are looked at between its outputs: what is largest in it does not depend on these.

An integration keeps the ends of its steps, which resolve whatever rings above its tolerance, and times between them
where steps are long. Those from which the others follow by straight lines are looked at, and all about the highest.

Peaks of an arm that rings are right to 1e-5, means over time to 1e-4, whatever the outputs are; those of smooth pulses
that last 1e-4 of the run to 1e-2 (tests/mbs/test_peaks_between_outputs.py).
"""

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices, in_parts
from .. import _core
from ..scene.analysis import IntegratedAnalysis


class _Looks(NamedTuple):
    """What is kept and looked at, in numbers."""

    intervals: int = 2000  # of a run, at least: a vibration of 10 periods is seen to (π 10/2000)²/2 of its amplitude
    kept: int = 16_777_216  # numbers of all states at most: 128 MiB
    parts_of_step: int = 4  # in runs whose differences count
    all_up_to: int = 16_384  # states of a loop; of more those from which others follow; of repeated runs as many a part
    follows: float = 1e-4  # of the largest value, by which a straight line may miss one: the error of means
    most: int = 1_048_576  # states, all of which are looked at where what rings leaves none out
    thinned: float = 0.98  # of the states, from one pass over them to the next: fewer passes than by the last few
    evenly: int = 2000  # states beside, for means over time
    highest: int = 4  # local maxima of each quantity about which all states are looked at: alike ones compete


LOOKS = _Looks()
AT_ONCE = 256  # states that are compared together: more leave the cache
SAME = 1e-13  # of the latest time, by which equal ones differ at most: round-off of k h and of sums of h


def new_samples(times: Array, analysis: IntegratedAnalysis, size: int) -> _core.Samples | None:
    """Samples for an integration over the output `times` (T,), s; None where there is nothing to integrate.

    `size`: length of a state, 0 of a robot that cannot move. Runs that are compared with repetitions have more samples.
    """
    duration = float(times[-1] - times[0])
    if not size or duration <= 0.0:
        return None
    parts = LOOKS.parts_of_step if analysis.keep_steps or analysis.is_repeated else 1
    most = max(min(LOOKS.kept // size, LOOKS.most), LOOKS.intervals)
    return _core.Samples(duration / LOOKS.intervals, most, parts)


def reached_samples(samples: _core.Samples | None, time: Array) -> tuple[Array, Array] | None:
    """Times (k,), s, and states (k, n_q + n_v) q, v, SI, of samples up to the end of `time` (T,), s; None if none."""
    if samples is None or not len(time):
        return None
    times = samples.times  # ascending
    reached = int(np.searchsorted(times, time[-1], side="right"))
    return (times[:reached], samples.states.reshape(len(times), -1)[:reached]) if reached else None


def some_of(times: Array, rates: Array, ends: Array, most: int) -> Indices:
    """Numbers of about `most` samples at `times` (k,), s, and of those about the highest of `rates` (k, n), any unit.

    The first, the last, and those at the times `ends`, s, are among them.
    """
    count = len(times)
    at_ends = np.flatnonzero(np.isin(times, ends))
    some = np.unique(np.concatenate([np.arange(0, count, -(-count // most)), at_ends, [count - 1]]))
    return some if len(some) == count else np.union1d(some, about_highest(np.arange(count), rates, 2))


def telling(times: Array, values: Array, sizes: Array) -> Indices:
    """Numbers of those samples at `times` (k,), s, between which `values` (k, columns) are nearly linear.

    Errors are at most `LOOKS.follows` times `sizes` (columns,), in the unit of the values. Every n-th sample, of
    `LOOKS.evenly` in all, is among them.
    """
    chain, misses = np.arange(len(times)), LOOKS.follows * sizes
    while len(chain) > 2:
        middle = np.arange(1, len(chain) - 1, 2)
        before, at, after = (chain[middle + shift] for shift in (-1, 0, 1))
        share = ((times[at] - times[before]) / (times[after] - times[before]))[:, None]
        linear = np.zeros(len(middle), dtype=bool)
        for k in in_parts(len(middle), AT_ONCE):
            off = values[at[k]] - (1.0 - share[k]) * values[before[k]] - share[k] * values[after[k]]
            linear[k] = (np.abs(off) <= misses).all(axis=1)
        left = np.delete(chain, middle[linear])
        if len(left) > LOOKS.thinned * len(chain):
            break
        chain = left
    return np.union1d(chain, np.arange(0, len(times), -(-len(times) // LOOKS.evenly)))


def about_highest(some: Indices, quantities: Array, beside: int = 1) -> Indices:
    """Numbers of all samples about the `LOOKS.highest` largest local maxima of `quantities` (T, columns), any unit.

    Quantities are known at the samples with numbers `some` (T,). Samples from `beside` of these before a maximum to as
    many after it count.
    """
    tops = sorted({k for column in np.abs(quantities).T for k in _highest(column)})
    about = [np.arange(some[max(k - beside, 0)], some[min(k + beside, len(some) - 1)] + 1) for k in tops]
    return np.unique(np.concatenate([some[:0], *about]))


def _highest(values: Array) -> list[int]:
    """Numbers of the highest local maxima of values (T,)."""
    inner = np.pad(values, 1, constant_values=-np.inf)
    tops = np.flatnonzero((values >= inner[:-2]) & (values >= inner[2:]) & (values > 0.0))
    return [int(k) for k in tops[np.argsort(-values[tops], kind="stable")[: LOOKS.highest]]]


def in_order(outputs: Array, samples: Array) -> Indices:
    """Numbers in (outputs (T,), samples (k,)), each ascending times in s, that put both in the order of time.

    Of times that are equal to round-off only the output counts.
    """
    times, after = np.concatenate([outputs, samples]), np.searchsorted(outputs, samples)
    padded = np.concatenate([[-np.inf], outputs, [np.inf]])
    apart = np.minimum(samples - padded[after], padded[after + 1] - samples) > SAME * np.abs(times).max(initial=0.0)
    rows = np.concatenate([np.arange(len(outputs)), len(outputs) + np.flatnonzero(apart)])
    return rows[np.unique(times[rows], return_index=True)[1]]
