"""Forces of the user's that depend on how a point moves: functions of Python, or compiled ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated

import numpy as np
from pydantic import PlainValidator, ValidationInfo

from ...common.errors import InputError
from ...common.validation import space_of
from .._core import StateFunction
from .functions import called, name_of
from .spelling import SPATIAL


def state_function(function: object, *, is_planar: bool = True) -> StateFunction:
    """A force (N, global axes) and moment (N·m) on a point: f(t, position, velocity) → force, or force and moment.

    Position and velocity have the shape (2,) in the plane, where f returns (x, y) or (x, y, moment); in space (3,), and
    f returns (x, y, z) or (x, y, z, mx, my, mz). One that has been compiled (`numba.cfunc` and its like, with an
    `address`) is `void(double t, const double *position, const double *rates, double *force)`, runs at the speed of the
    core, and has the numbers of mbs/core/recursion/constrained_aba/point_force.h. Raises `ValueError` for all else.
    """
    address = getattr(function, "address", None)
    if isinstance(address, int):
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
                f"{name_of(function)}: expected a force ({', '.join(components[:linear])}), or"
                f" ({', '.join(components)}), found an array of shape {values.shape} at t = {t:g} s"
            )
        return [*map(float, values), *[0.0] * (all_of_them - len(values))]

    return force


def _named(value: object, info: ValidationInfo) -> StateFunction:
    if isinstance(value, StateFunction):
        return value
    objects = (info.context or {}).get("objects", {})
    if not isinstance(value, str) or value not in objects:
        raise ValueError(f"expected a function of t, position and velocity, in scenes made in Python, found {value!r}")
    return state_function(objects[value], is_planar=space_of(info) != SPATIAL)


StateForce = Annotated[StateFunction, PlainValidator(_named, json_schema_input_type=str)]
