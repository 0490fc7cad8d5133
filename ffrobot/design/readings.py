"""Responses, scalars read from results, and their values in results of a changed scene.

The derivative of a peak by a parameter is that of the history at its time and column (envelope theorem, Danskin 1966),
as long as no other peak exceeds it. The time is that of the top itself, between outputs.
"""

import re
from typing import Literal

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, did_you_mean
from ..common.peaks import root_mean_square, top_at
from ..common.structs import struct
from ..results.file import Results, dataset_and_column
from ..results.joints import unit_of
from ..results.peaks import MEAN_POWER, RMS_POWER
from ..results.peaks import POWER as PEAK_POWER
from ..sweep.runs import by_dots, is_vector


@struct
class Reading:
    """Value of a response in some results; of a peak also its time and column."""

    value: float  # value in `unit`, which is empty if it is unknown
    unit: str = ""
    time: float = np.nan  # time of a peak, s; NaN for other responses
    # "first" or "last" if the peak is at an end of the run, which may move
    edge: Literal["", "first", "last"] = ""
    # column of the history with the peak, and sign of the value there
    column: int = 0
    sign: float = 1.0
    mode: str = ""  # family of a frequency's mode, and number in the family
    coarse: float = np.nan  # value of a peak by every second output; NaN for other responses
    # value by outputs alone of a peak or mean that lies between outputs; NaN otherwise
    missed_by: float = np.nan
    doubt: str = ""  # reason why the value is uncertain, or empty
    # text on the largest value, if it is another peak than the followed one; otherwise empty
    elsewhere: str = ""

    def in_words(self, digits: int = 6) -> str:
        """The value with its unit."""
        return f"{self.value:.{digits}g} {self.unit}".rstrip()

    @property
    def is_between(self) -> bool:
        """Whether outputs miss the value: then it has no time and column, and runs are compared by the value alone."""
        return bool(np.isfinite(self.missed_by))

    @property
    def remark(self) -> str:
        """Note on a value between outputs, or on its uncertainty; empty without either."""
        if not self.is_between:
            return self.doubt
        values = f"found {self.missed_by:.6g} near outputs, {self.value:.6g} between them, which counts"
        return f"{values}: with a smaller output_step histories have it, too"


class Response:
    """One scalar result to differentiate, optimize or limit; `text` is the user's name for it.

    Attributes:
        name: name of its history, if it has one.
        needs_motion: whether it depends on histories of an analysis.
        is_of_rest: whether its default analysis is the first one over time, rather than the first of all.
    """

    text: str
    name: str = ""
    needs_motion = True
    is_of_rest = False

    @property
    def analysis(self) -> str:
        """First part of the history's name, which may be an analysis."""
        return self.name.replace("/", ".").partition(".")[0]

    def read(self, results: Results) -> Reading:
        """Return the response in `results`. Raises `InputError` if they do not contain it."""
        raise NotImplementedError

    def follow(self, results: Results, nominal: Reading) -> Reading:
        """Return the response in `results` of a changed scene: at the time, column or mode of `nominal`, if any."""
        return self.read(results)


JOINT = re.compile(r"[^/]+/joints/[^/]+")
POWER = "power"
"""History of joints in addition to their datasets: power of their motors, W."""

SAME = 1e-6  # of an output step: times that are one
MISSED = 1e-3  # of a peak, or of a mean's RMS: change by values between outputs from which they count
UNCERTAIN = "uncertain, as outputs, which alone count here, miss a part of the history: take a smaller output_step"
SUPPORT = 6  # outputs that a value between outputs is made from


@struct
class History:
    """A dataset over T outputs: `values` (T, columns) in `unit` at `time` (T,), s; of vectors the length, one column.

    `largest`, `rms`, `mean`: over all columns and all time steps, also between outputs; NaN if unknown.
    `is_in_doubt`: for one component of a vector, these are unknown, and outputs miss a part of the vector's length.
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

        `every` = 2 uses every second output alone, without the one nearest to t.
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
    """Return the history `name`; without an analysis in front, that of the first analysis of the results.

    Raises `InputError`, which begins with `option`, where there is none.
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
    """Return the history `name` of one column. Raises `InputError`, with `option` in front, otherwise."""
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


COARSE = 2  # every second output: peaks by these show how well all resolve them
NOISE = 1e-6  # of a peak: a valley that is less deep lies between no two peaks


@struct
class Peak(Response):
    """The largest absolute value of a history, of any of its columns; of vectors their length."""

    text: str
    name: str

    def read(self, results: Results) -> Reading:
        """Return the value of the peak, its time, and its column."""
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
        """Return the value at time, column and sign of the `nominal` peak; the largest value if outputs miss that."""
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
