"""Forces of the user's that depend on how a point moves: functions of Python, or compiled ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.errors import InputError
from .._core import StateFunction
from .functions import called, name_of


def state_function(function: object) -> StateFunction:
    """A force (N, global axes) and moment (N·m) on a point: f(t, position (2,), velocity (2,)) → (x, y[, moment]).

    One that has been compiled (`numba.cfunc` and its like, with an `address`) is
    `void(double t, const double *x_y_angle, const double *rates, double *x_y_moment)`, and runs at the speed of the
    core. Raises `ValueError` for anything else.
    """
    address = getattr(function, "address", None)
    if isinstance(address, int):
        return StateFunction.compiled(address)
    if not callable(function):
        raise ValueError(f"expected a function of t, position and velocity, found {function!r}")
    return StateFunction.python(_checked(function))


def _checked(function: Callable[..., object]) -> Callable[..., tuple[float, float, float]]:
    def force(t: float, x: float, y: float, v_x: float, v_y: float) -> tuple[float, float, float]:
        values = called(function, t, t, np.array([x, y]), np.array([v_x, v_y]))
        if values.shape not in ((2,), (3,)):
            raise InputError(
                f"{name_of(function)}: expected a force (x, y), or (x, y, moment), found an array of shape"
                f" {values.shape} at t = {t:g} s"
            )
        moment = float(values[2]) if len(values) == 3 else 0.0
        return float(values[0]), float(values[1]), moment

    return force
