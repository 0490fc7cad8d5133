"""What a response is: a scalar by results, which is followed to those of a changed scene.

A peak belongs to a time and a column: its derivative by a parameter is that of the history there (envelope theorem,
Danskin 1966), as long as no other time overtakes it. The time is that of the top itself, where d/dt = 0, which lies
between outputs.
"""

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, did_you_mean
from ..common.peaks import root_mean_square, top_at
from ..results.file import Results, dataset_and_column
from ..results.joints import unit_of
from ..results.peaks import MEAN_POWER, RMS_POWER
from ..results.peaks import POWER as PEAK_POWER
from ..sweep.runs import by_dots, is_vector


@dataclass(frozen=True)
class Reading:
    """A response's value by results. Of a peak also where it is.

    Attributes:
        value: of the response, in `unit`, which is empty where it is not known.
        time: of a peak, s; NaN of all else.
        edge: "first" or "last" where that is an end of the run, which may move.
        column, sign: of its history, and of the value there.
        mode: of a frequency, the family and its number in it.
        coarse: of a peak, its value by every second output; NaN of all else.
        missed_by: of a peak or mean that outputs miss, its value by outputs alone; NaN of all else.
        doubt: why the value is uncertain; empty where it is not.
        elsewhere: of a peak followed at its own place, where the largest value is now; empty where it is there.
    """

    value: float
    unit: str = ""
    time: float = np.nan
    edge: Literal["", "first", "last"] = ""
    column: int = 0
    sign: float = 1.0
    mode: str = ""
    coarse: float = np.nan
    missed_by: float = np.nan
    doubt: str = ""
    elsewhere: str = ""

    def in_words(self, digits: int = 6) -> str:
        """The value with its unit."""
        return f"{self.value:.{digits}g} {self.unit}".rstrip()

    @property
    def is_between(self) -> bool:
        """Whether outputs miss the value: it has no time and column, and is compared as it is between runs."""
        return bool(np.isfinite(self.missed_by))

    @property
    def remark(self) -> str:
        """Note on a value between outputs, or on its uncertainty; empty without either."""
        if not self.is_between:
            return self.doubt
        values = f"found {self.missed_by:.6g} near outputs, {self.value:.6g} between them, which counts"
        return f"{values}: with a smaller output_step histories have it, too"


class Response:
    """One scalar result to optimize or limit; `text` is the user's name for it.

    Attributes:
        name: of its history, if it has one.
        needs_motion: whether an analysis has to be run for it.
        is_of_rest: whether that is by default the first which follows paths, rather than the first of all.
    """

    text: str
    name: str = ""
    needs_motion = True
    is_of_rest = False

    @property
    def analysis(self) -> str:
        """First part of the name of the history, which may be an analysis."""
        return self.name.replace("/", ".").partition(".")[0]

    def read(self, results: Results) -> Reading:
        """Return the response in `results`. Raises `InputError` if they do not contain it."""
        raise NotImplementedError

    def follow(self, results: Results, nominal: Reading) -> Reading:
        """Return the response in `results` of a changed scene: at the time, column or mode of `nominal`, if any."""
        return self.read(results)


JOINT = re.compile(r"[^/]+/joints/[^/]+")
POWER = "power"
"""What joints have besides their datasets: the power of their motors, W."""

SAME = 1e-6  # of an output step: times that are one
MISSED = 1e-3  # of a peak, or of the RMS of a mean: how much values between outputs change it where they count
UNCERTAIN = "uncertain, as outputs, which alone count here, miss a part of the history: take a smaller output_step"
SUPPORT = 6  # outputs that a value between outputs is made from


@dataclass(frozen=True)
class History:
    """A dataset over time: `values` (T, columns) at `time` (T,), s; the length of a vector as one column.

    `largest`, `rms`, `mean`: of all columns and of all times that the run looked at; NaN where that is not known.
    `is_in_doubt`: whether that is so of a part of a vector whose length outputs miss.
    """

    name: str
    unit: str
    time: Array
    values: Array
    largest: float = np.nan
    rms: float = np.nan
    mean: float = np.nan
    is_in_doubt: bool = False

    def at(self, t: float, column: int, every: int = 1) -> float:
        """Value at t (s), in `unit`: that of an output, or of the polynomial through the six nearest (Lagrange).

        With `every` = 2 every second of those about t alone is known, without the one next to it.
        """
        values, time = self.values[:, column], self.time
        if every > 1 and time.size > every * SUPPORT:
            first = (int(np.argmin(np.abs(time - t))) + 1) % every
            values, time = values[first::every], time[first::every]
        nearest = int(np.argmin(np.abs(time - t)))
        step = time[1] - time[0] if time.size > 1 else 1.0
        if abs(time[nearest] - t) <= SAME * step:
            return float(values[nearest])
        first = int(np.clip(np.searchsorted(time, t) - SUPPORT // 2, 0, max(0, time.size - SUPPORT)))
        x, y = time[first : first + SUPPORT], values[first : first + SUPPORT]
        parts = [yk * np.prod([(t - xj) / (xk - xj) for xj in x if xj != xk]) for xk, yk in zip(x, y, strict=True)]
        return float(sum(parts))


def read_history(results: Results, name: str, option: str) -> History:
    """The history that `name` means; without an analysis in front it is of the first one that the results have.

    Raises `InputError`, with the `option` that names it, where there is none.
    """
    wanted, k = dataset_and_column(name)
    datasets = _known(results)
    dataset = datasets.get(wanted.replace("/", "."))
    if dataset is None:
        known = sorted((key for key in datasets if "." in key), key=lambda key: not key.startswith("joints."))
        raise InputError(
            f'{option}: expected the name of a history, such as "{next(iter(known), "tip_error")}"',
            f'"{wanted}"{did_you_mean(wanted.replace("/", "."), known)}',
        )
    is_power = dataset.endswith(f"/{POWER}")
    values = _power(results, dataset) if is_power else results.data(dataset)
    about = results.attributes(dataset.removesuffix(f"/{POWER}"))
    names = (PEAK_POWER, RMS_POWER, MEAN_POWER) if is_power else ("peak", "rms", "mean")
    sizes = [np.atleast_1d(about.get(key, np.nan)) for key in names]
    time, in_doubt = results.time(dataset), False
    if k is not None:
        if k >= values.shape[1]:
            raise InputError(f'{option}: expected a column below {values.shape[1]} of "{wanted}"', k)
        if len(sizes[1]) < values.shape[1]:  # those of a vector's length
            length = root_mean_square(time, np.linalg.norm(values, axis=1))
            in_doubt = bool(abs(sizes[1][0] - length) > MISSED * sizes[1][0])
            sizes = [np.array([np.nan])] * len(names)
        else:
            sizes = [one[k : k + 1] if len(one) == values.shape[1] else np.array([np.nan]) for one in sizes]
        values = values[:, k : k + 1]
    elif is_vector(results, dataset, values):
        values = np.linalg.norm(values, axis=1, keepdims=True)
    largest, rms, mean = (float(one.max()) for one in sizes)
    unit = "W" if is_power else unit_of(results.scene, dataset.partition("/")[2]).replace(" ", "·")
    return History(name, "" if "," in unit else unit, time, values, largest, rms, mean=mean, is_in_doubt=in_doubt)


def read_column(results: Results, name: str, option: str) -> History:
    """The history `name` as in `read_history`. Raises `InputError` also where it has several columns."""
    history = read_history(results, name, option)
    if (count := history.values.shape[1]) > 1:
        raise InputError(f'{option}: expected one column, such as "{name}[0]"', f'{count} of "{name}"')
    return history


def _known(results: Results) -> dict[str, str]:
    """Datasets over outputs, and of closed loops over samples, by the names they go by."""
    names: dict[str, None] = {}
    for analysis in results.analyses:
        control = results.names(f"{analysis}/control")
        samples = len(results[f"{analysis}/control/time"]) if control else 0
        of_loop = [f"control/{name}" for name in control if len(results[f"{analysis}/control/{name}"]) == samples]
        names |= dict.fromkeys(f"{analysis}/{name}" for name in (*results.histories(analysis), *of_loop))
    powers = [f"{m[0]}/{POWER}" for m in map(JOINT.match, names) if m and f"{m[0]}/moment" in results]
    return by_dots(results, [*names, *powers])


def _power(results: Results, name: str) -> Array:
    """(T, 1) W: force times rate, summed over the coordinates of the joint; of the motor where a gear gives."""
    joint = name.removesuffix(f"/{POWER}")
    rate = "motor_rate" if f"{joint}/motor_rate" in results else "rate"
    power = results.data(f"{joint}/moment") * results.data(f"{joint}/{rate}")
    return power.sum(axis=1, keepdims=True)


COARSE = 2  # every second output: what a peak is with these tells how well all of them resolve it
NOISE = 1e-6  # of a peak: a valley that is less deep lies between no two peaks


@dataclass(frozen=True)
class Peak(Response):
    """The largest absolute value of a history, of any of its columns; of vectors their length."""

    text: str
    name: str

    def read(self, results: Results) -> Reading:
        """The value, when it is reached, and in which column."""
        history = read_history(results, self.name, f'"{self.text}"')
        k, column = _largest(history.values)
        sign = -1.0 if history.values[k, column] < 0.0 else 1.0
        _, time = top_at(history.time, history.values[:, column], k)
        edge: Literal["", "first", "last"] = "first" if k == 0 else "last" if k == history.time.size - 1 else ""
        value, coarse = (sign * history.at(time, column, every) for every in (1, COARSE))
        if history.largest > value * (1.0 + MISSED):
            return Reading(history.largest, history.unit, missed_by=value)
        doubt = UNCERTAIN if history.is_in_doubt else ""
        return Reading(value, history.unit, time, edge, column, sign, coarse=coarse, doubt=doubt)

    def follow(self, results: Results, nominal: Reading) -> Reading:
        """Return the value at time, column and sign of the `nominal` peak; of one between outputs the largest value."""
        history = read_history(results, self.name, f'"{self.text}"')
        if nominal.is_between:
            return Reading(float(np.fmax(history.largest, np.abs(history.values).max())))
        time = float({"first": history.time[0], "last": history.time[-1]}.get(nominal.edge, nominal.time))
        if not history.time[0] <= time <= history.time[-1]:
            return Reading(np.nan, elsewhere=f"the run ends at t = {history.time[-1]:g} s")
        value, coarse = (nominal.sign * history.at(time, nominal.column, every) for every in (1, COARSE))
        k, column = _largest(history.values)
        now = history.values[k, column]
        between = (history.time - time) * (history.time - history.time[k]) <= 0.0
        valley = float(np.min(nominal.sign * history.values[between, nominal.column], initial=np.inf))
        moves = column == nominal.column and now * nominal.sign > 0.0 and valley >= value * (1.0 - NOISE)
        if abs(now) <= value * (1.0 + NOISE) or moves:  # the same peak
            return Reading(value, coarse=coarse)
        where = f", column {column}" if history.values.shape[1] > 1 else ""
        elsewhere = f"{abs(now):.6g} at t = {history.time[k]:g} s{where}"
        return Reading(value, coarse=coarse, elsewhere=elsewhere)


def _largest(values: Array) -> tuple[int, int]:
    """Output and column of the largest absolute value, the first one."""
    k, column = np.unravel_index(np.abs(values).argmax(), values.shape)
    return int(k), int(column)
