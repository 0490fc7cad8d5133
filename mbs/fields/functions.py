"""Functions of time that a user gives in Python, and the check that any of them exists when it is needed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.tables import shown
from .._core import TimeFunction


def user_function(function: object) -> TimeFunction:
    """A function of t (s) from Python: it returns (value, rate, acceleration); the value is enough for loads.

    One that has been compiled (`numba.cfunc` and its like, with an `address`) writes the three numbers to its second
    argument, `void(double t, double *out)`, and runs at the speed of the core. Raises `ValueError` for anything else.
    """
    address = getattr(function, "address", None)
    if isinstance(address, int):
        return TimeFunction.compiled(address)
    if not callable(function):
        raise ValueError(f"expected a function of t, found {function!r}")

    def three(t: float) -> tuple[float, float, float]:
        values = called(function, t, t)
        if values.shape not in ((), (3,)):
            raise InputError(
                f"{name_of(function)}: expected (value, rate, acceleration), or the value of a load, found an array of"
                f" shape {values.shape} at t = {t:g} s"
            )
        value, rate, acceleration = (float(values), np.nan, np.nan) if values.ndim == 0 else map(float, values)
        return value, rate, acceleration

    return TimeFunction.python(three)


def called(function: Callable[..., object], t: float, *arguments: object) -> Array:
    """What a user's function returns, as numbers; errors that it raises carry a note with its name and the time t.

    Raises `InputError` where it returns something else than numbers.
    """
    try:
        returned = function(*arguments)
    except Exception as error:
        error.add_note(f"raised by {name_of(function)}, a function of the scene, at t = {t:g} s")
        raise
    try:
        return np.asarray(returned, dtype=float)
    except (TypeError, ValueError):
        raise InputError(
            f"{name_of(function)}: expected numbers, found {shown(repr(returned))} at t = {t:g} s"
        ) from None


def name_of(function: object) -> str:
    """What messages call a user's function."""
    return str(getattr(function, "__qualname__", function))


def check_domain(function: TimeFunction, times: Array, describe: str, derivatives: int = 2) -> None:
    """Make sure `function` and its first `derivatives` time derivatives exist at all `times` (T,), in s.

    Raises `InputError`, starting with `describe` (file and key), at the first time where one is missing or infinite: a
    domain error, an overflow, or a time that the waypoints do not cover.
    """
    samples = function.sample(np.ascontiguousarray(times, dtype=np.float64))[: derivatives + 1]
    bad = np.flatnonzero(~np.isfinite(samples).all(axis=0))
    if bad.size == len(times) and np.isfinite(samples[0]).all() and np.isnan(samples[1:]).all():
        raise InputError(
            f"{describe}: expected a function of t that returns (value, rate, acceleration), found one that returns the"
            " value alone"
        )
    if bad.size:
        first = bad[0]
        order = int(np.flatnonzero(~np.isfinite(samples[:, first]))[0])
        quantity = ("value", "velocity", "acceleration")[order]
        raise InputError(
            f"{describe}: expected a finite {quantity} during the whole run, found none at t = {times[first]:.9g} s"
            " (a domain error, an overflow, or a time that the waypoints do not cover)"
        )
