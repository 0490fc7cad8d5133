"""Functions of time, and forces by the motion of a point, that a user gives in Python; the checks of their values."""

from collections.abc import Callable, Sequence
from typing import Annotated

import numpy as np
from pydantic import ValidationInfo

from ...common.arrays import Array, Booleans
from ...common.deferred import ReadBy
from ...common.errors import InputError
from ...common.tables import shown
from ...common.validation import space_of
from .._core import StateFunction, TimeFunction
from .spelling import SPATIAL


def user_function(function: object) -> TimeFunction:
    """Make a function of t (s) from one in Python that returns (value, rate, acceleration); loads need the value alone.

    A compiled one (`numba.cfunc` and its like, with an `address`) writes the three numbers to its second argument,
    `void(double t, double *out)`, and runs at the speed of the core. Raises `ValueError` for anything else.
    """
    address = getattr(function, "address", None)
    if isinstance(address, int):
        _compiled.append(function)
        return TimeFunction.compiled(address)
    if not callable(function):
        raise ValueError(f"expected a function of t, found {function!r}")

    def three(t: float) -> tuple[float, float, float]:
        values = called(function, t, t)
        if values.shape not in ((), (3,)):
            raise InputError(
                f"{_name_of(function)}: expected (value, rate, acceleration), or the value of a load",
                f"an array of shape {values.shape} at t = {t:g} s",
            )
        value, rate, acceleration = (float(values), np.nan, np.nan) if values.ndim == 0 else map(float, values)
        return value, rate, acceleration

    return TimeFunction.python(three)


_compiled = list[object]()  # machine code must outlive the scenes that know its address


def called(function: Callable[..., object], t: float, *arguments: object) -> Array:
    """The numbers, of any shape and unit, of a user's function; its errors get a note with its name and t (s).

    Raises `InputError` where it returns something else than numbers.
    """
    try:
        returned = function(*arguments)
    except Exception as error:
        error.add_note(f"raised by {_name_of(function)}, a function of the scene, at t = {t:g} s")
        raise
    try:
        return np.asarray(returned, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{_name_of(function)}: expected numbers", f"{shown(repr(returned))} at t = {t:g} s") from None


def _name_of(function: object) -> str:
    return str(getattr(function, "__qualname__", function))


def check_domain(function: TimeFunction, times: Array, describe: str, derivatives: int) -> None:
    """Raise `InputError` unless `function` and its first `derivatives` time derivatives exist at all `times` (T,), s.

    The message starts with `describe` (file and key) and has the first time with a domain error or an overflow, or
    beyond the waypoints.
    """
    samples = function.sample(np.ascontiguousarray(times, dtype=np.float64))[: derivatives + 1]
    bad = np.flatnonzero(~np.isfinite(samples).all(axis=0))
    if bad.size == len(times) and np.isfinite(samples[0]).all() and np.isnan(samples[1:]).all():
        raise InputError(
            f"{describe}: expected a function of t that returns (value, rate, acceleration)",
            "one that returns the value alone",
        )
    if bad.size:
        first = bad[0]
        order = int(np.flatnonzero(~np.isfinite(samples[:, first]))[0])
        quantity = ("value", "velocity", "acceleration")[order]
        raise InputError(
            f"{describe}: expected a finite {quantity} during the whole run",
            f"none at t = {times[first]:.9g} s (a domain error, an overflow, or a time that the waypoints do not"
            " cover)",
        )


INSTANTS = 13  # at which is looked
STEPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)  # of differences, relative to the time that the function is needed for
AGREED = 1e-5  # two differences that differ by less know the derivative; relative to its largest value
WRONG = 1e-3  # error of a derivative, likewise
ROUND_OFF = 1e-8  # of the largest value over the time: differences of less are round-off
GOLDEN = 0.6180339887498949  # its multiples fall on no grid, so on no instant at which accelerations jump


def check_derivatives(function: TimeFunction, end: float, describe: str) -> None:
    """Raise `InputError`, starting with `describe`, where rate or acceleration contradict differences before `end` (s).

    Differences of value and rate with several steps h count where those with h/2 agree: few or none do beside a jump
    of the acceleration, or where values are rounded, or vibrate faster than a step. The function is wrong where all
    that count contradict it.
    """
    times = end * (0.02 + 0.96 * ((GOLDEN * np.arange(1, INSTANTS + 1)) % 1.0))
    given = function.sample(times)
    with np.errstate(all="ignore"):  # poles: nothing is known there
        once, twice = (np.stack([_differences(function, times, h * part * end) for h in STEPS]) for part in (1.0, 0.5))
    for order, quantity in ((1, "rate"), (2, "acceleration")):
        slope = twice[:, order - 1]
        least = ROUND_OFF * np.abs(given[order - 1]).max() / end
        known, wrong = _judged(once[:, order - 1], slope, given[order], least)
        if wrong.any():
            k = int(np.flatnonzero(wrong)[0])
            said = slope[np.flatnonzero(known[:, k])[0], k]
            raise InputError(
                f"{describe}: expected the derivatives of the value, (value, rate, acceleration)",
                f"the {quantity} {given[order, k]:.6g} at t = {times[k]:.6g} s, where differences of the"
                f" {('value', 'rate')[order - 1]} are {said:.6g}",
            )


def _differences(function: TimeFunction, times: Array, h: float) -> Array:
    """(2, T) derivatives of value and rate at `times` (T,) by central differences of fourth order with the step h."""
    before2, before, after, after2 = (function.sample(times + k * h)[:2] for k in (-2, -1, 1, 2))
    return (before2 - 8 * before + 8 * after - after2) / (12 * h)


def _judged(once: Array, twice: Array, given: Array, round_off: float) -> tuple[Booleans, Booleans]:
    """Which differences (steps, T), with h and h/2, know the derivative, and where (T,) all of these contradict it."""
    with np.errstate(all="ignore"):
        size = max(np.abs(given).max(), np.abs(twice).min(axis=0).max()) + round_off
        known = np.abs(once - twice) <= AGREED * size
        wrong = known.any(axis=0) & np.all(~known | (np.abs(twice - given) > WRONG * size + round_off), axis=0)
    return known, wrong


def state_function(function: object, *, is_planar: bool = True) -> StateFunction:
    """Make a force (N, global axes) and moment (N·m) on a point from f(t, position, velocity) in s, m, m/s.

    Position and velocity have the shape (2,) in the plane, where f returns (x, y) or (x, y, moment); in space (3,), and
    f returns (x, y, z) or (x, y, z, mx, my, mz). A compiled function (`numba.cfunc` and its like, with an `address`) is
    `void(double t, const double *position, const double *rates, double *force)`, runs at the speed of the core, and has
    the numbers of mbs/core/recursion/constrained_aba/point_force.h. Raises `ValueError` for all else.
    """
    address = getattr(function, "address", None)
    if isinstance(address, int):
        _compiled.append(function)
        return StateFunction.compiled(address, is_planar)
    if not callable(function):
        raise ValueError(f"expected a function of t, position and velocity, found {function!r}")
    return StateFunction.python(_checked(function, is_planar=is_planar), is_planar)


def _checked(
    function: Callable[..., object], *, is_planar: bool
) -> Callable[[float, Sequence[float], Sequence[float]], Sequence[float]]:
    components = ("x", "y", "moment") if is_planar else ("x", "y", "z", "mx", "my", "mz")
    linear, all_of_them = (2, 3) if is_planar else (3, 6)

    def force(t: float, position: Sequence[float], velocity: Sequence[float]) -> list[float]:
        values = called(function, t, t, np.array(position), np.array(velocity))
        if values.shape not in ((linear,), (all_of_them,)):
            raise InputError(
                f"{_name_of(function)}: expected a force ({', '.join(components[:linear])}), or"
                f" ({', '.join(components)})",
                f"an array of shape {values.shape} at t = {t:g} s",
            )
        return [*map(float, values), *[0.0] * (all_of_them - len(values))]

    return force


def _named(value: object, info: ValidationInfo) -> StateFunction:
    if isinstance(value, StateFunction):
        return value
    objects = (info.context or {}).get("objects", {})
    if not isinstance(value, str) or value not in objects:
        raise ValueError(
            "expected a function of t, position and velocity, in scenes made in Python (expressions in t are the keys"
            f" x, y and their like), found {value!r}"
        )
    return state_function(objects[value], is_planar=space_of(info) != SPATIAL)


StateForce = Annotated[StateFunction, ReadBy(_named, str)]
