"""Derivatives of responses from values beside a point, with errors.

The derivative is that of the polynomial through the values (Fornberg, Mathematics of Computation 51, 1988): with steps
h, h/2 and h/4 to both sides Richardson's extrapolation, of order h⁶.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from itertools import combinations
from typing import Any, Literal, NamedTuple

import numpy as np

from ..common.arrays import Array
from ..common.structs import struct
from ..sweep.sweep import Key
from .designs import Point, moved
from .readings import Reading, Response

LEVELS = 3  # sizes of steps that one extrapolation takes at most
NOISE = 3.0  # times a divided difference, which may be small by chance
ROUND_OFF = float(np.finfo(np.float64).eps)


class Derivative(NamedTuple):
    """A derivative, its estimated error, and the largest step used; NaN where there is none."""

    value: float
    error: float
    step: float


def weights(offsets: Array) -> Array:
    """Return weights w (n,), 1/unit of x, of f'(0) ≈ Σ w_i f(x_i) at `offsets` x (n,): exact for degrees below n."""
    size = np.abs(offsets).max()
    powers = np.vander(offsets / size, increasing=True).T
    return np.linalg.solve(powers, np.eye(len(offsets))[1]) / size


def derivative(offsets: Array, values: Array) -> Derivative:
    """Return the derivative at 0 from `values` (n,), at `offsets` (n,), both in any unit; NaN values are omitted.

    Steps are taken two and three sizes at a time; those with the least estimated error make the derivative
    (Ridders, Advances in Engineering Software 4, 1982). One side is enough, at a lower order.
    """
    known = np.isfinite(values)
    offsets, values = offsets[known], values[known]
    sizes = np.unique(np.abs(offsets[offsets != 0.0]))[::-1]
    best = Derivative(np.nan, np.nan, np.nan)
    for first, last in combinations(range(sizes.size + 1), 2):
        if not 2 <= last - first <= LEVELS:
            continue
        largest = sizes[first]
        taken = np.isin(np.abs(offsets), [0.0, *sizes[first:last]])
        x, f = offsets[taken], values[taken]
        inner = np.abs(x) < largest
        f = f - f[np.argmin(np.abs(x))]  # round-off of differences, not of values
        apart = (x[:, None] - x) / largest + np.eye(x.size)
        w, highest = weights(x), 1.0 / np.prod(apart, axis=1)
        whole, truncation = float(w @ f), abs(float(w @ f - weights(x[inner]) @ f[inner]))
        noise = NOISE * abs(float(highest @ f)) / float(np.abs(highest).sum())
        noise += ROUND_OFF * float(np.abs(values[taken]).max())
        error = truncation + noise * float(np.abs(w).sum())
        if not error >= best.error:
            best = Derivative(whole, error, float(largest))
    return best


AIM = 1e-5  # estimated error, of a response's largest percent per percent or 1, that is small enough
RESOLVING = 8.0  # least ratio of errors between outputs: with every second output, and with all
ROUGH = 1e-2  # of a derivative: beyond, the response is hardly smooth


@struct
class Base:
    """Point of differentiation: k `keys` with their values `point`, and g `responses` with their `readings`.

    `steps` (k): largest change of each key. `again`: changes of a scene with which a run reuses the time steps of the
    scene's own run; `repeats` is then the tolerance of these runs, else 0.
    """

    responses: tuple[Response, ...]
    readings: tuple[Reading, ...]
    keys: tuple[Key, ...]
    point: Point
    steps: tuple[float, ...]
    repeats: float = 0.0
    again: Mapping[Key, Any] = field(default_factory=dict)

    def moved(self, k: int, offset: float) -> Point:
        """Return the point with entry k changed by `offset`."""
        return moved(self.point, k, self.point[k] + offset)


@struct
class Sample:
    """A run with key number `k` changed by `offset`: its responses, or none and the message of its `failure`."""

    k: int
    offset: float
    responses: tuple[Reading, ...]
    failure: str = ""


Method = Literal["differences", "repeated steps", "one-sided", "none"]
"""Method of a derivative; "repeated steps": differences of runs with the same time steps."""


@struct
class Entry:
    """∂response/∂key with its estimated error, both in SI units, NaN where there is none.

    `step`: largest change of the key; `notes`: restrictions; `unresolved`: the part of the error due to the time
    between outputs, which no other step reduces.
    """

    derivative: float
    error: float
    step: float
    method: Method
    notes: tuple[str, ...] = ()
    unresolved: float = 0.0


def entries(base: Base, samples: Sequence[Sample]) -> tuple[tuple[Entry, ...], ...]:
    """Return derivatives as rows by response and columns by key."""
    return tuple(tuple(_entry(base, g, k, samples) for k in range(len(base.keys))) for g in range(len(base.responses)))


def rough_keys(base: Base, samples: Sequence[Sample], *, smaller: bool) -> list[int]:
    """Return numbers of keys with errors above `AIM` where a smaller (or larger) step may lower the error."""
    rough = set()
    for g, row in enumerate(entries(base, samples)):
        largest = max((_relative(one.derivative, base, g, k) for k, one in enumerate(row)), key=np.nan_to_num)
        for k, one in enumerate(row):
            sizes = sorted({abs(each.offset) for each in samples if each.k == k and each.responses}, reverse=True)
            is_good = _relative(one.error - one.unresolved, base, g, k) <= AIM * max(1.0, np.nan_to_num(largest))
            if sizes and not is_good and np.isclose(abs(one.step), sizes[-LEVELS:][0] if smaller else sizes[0]):
                rough.add(k)
    return sorted(rough)


def _entry(base: Base, g: int, k: int, all_samples: Sequence[Sample]) -> Entry:
    samples = [one for one in all_samples if one.k == k]
    whole = [one for one in samples if one.responses and np.isfinite(one.responses[g].value)]
    offsets = np.array([0.0, *(one.offset for one in whole)])
    nominal, beside = base.readings[g], [one.responses[g] for one in whole]
    slope = derivative(offsets, np.array([nominal.value, *(one.value for one in beside)]))
    by_coarse = derivative(offsets, np.array([nominal.coarse, *(one.coarse for one in beside)])).value
    unresolved = abs(by_coarse - slope.value) / RESOLVING if np.isfinite(by_coarse) else 0.0
    # Runs with the same steps have equal errors, which differences do not show.
    size = abs(nominal.value) / (abs(base.point[k]) or 1.0)
    slope = slope._replace(error=slope.error + unresolved + base.repeats * max(abs(slope.value), size))
    method: Method = "repeated steps" if base.repeats else "differences"
    if not offsets.min() < 0.0 < offsets.max():
        method = "one-sided"
    if np.isnan(slope.value):
        method = "none"
    notes = list(_notes(base, g, k, samples))
    for error, note in (
        (slope.error - unresolved, "not smooth, or noisy: half of the step yields another derivative"),
        (unresolved, "the peak lies between outputs that are too far apart: take a smaller output_step"),
    ):
        if _relative(error, base, g, k) > ROUGH and error > ROUGH * abs(slope.value):
            notes.append(note)
    return Entry(*slope, method, tuple(notes), unresolved)


def _notes(base: Base, g: int, k: int, samples: Sequence[Sample]) -> Iterator[str]:
    nearest = sorted(samples, key=lambda one: abs(one.offset))
    name = ".".join(base.keys[k])

    def at(one: Sample) -> str:
        return f"with {name} = {base.point[k] + one.offset:.6g}"

    if failed := next((one for one in nearest if one.failure), None):
        yield f"{at(failed)}: {failed.failure}"
    if jump := next((one for one in nearest if one.responses and one.responses[g].elsewhere), None):
        yield f"a kink: {at(jump)} the largest value is {jump.responses[g].elsewhere}"


def _relative(error: float, base: Base, g: int, k: int) -> float:
    """|`error`| of percent per percent; of a response or a key that is 0 in its unit."""
    return abs(error) * (abs(base.point[k]) or 1.0) / (abs(base.readings[g].value) or 1.0)
