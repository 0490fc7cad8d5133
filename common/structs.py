"""Classes that hold values: a solve loads 120, and the interpreter makes a frozen dataclass in four times the time."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import wraps
from typing import TypeVar, dataclass_transform

T = TypeVar("T")
R = TypeVar("R")


@dataclass_transform(eq_default=False, frozen_default=True, field_specifiers=(field,))
def struct(cls: type[T]) -> type[T]:
    """Make `cls` a dataclass whose objects are compared by identity; type checkers refuse to set their fields."""
    made = dataclass(eq=False, repr=False)(cls)
    if made.__repr__ is object.__repr__:
        made.__repr__ = _shown  # type: ignore[method-assign]
    return made


def _shown(self: object) -> str:
    values = (f"{one.name}={getattr(self, one.name)!r}" for one in fields(self) if one.repr)  # type: ignore[arg-type]
    return f"{type(self).__qualname__}({', '.join(values)})"


def kept(function: Callable[[T], R]) -> Callable[[T], R]:
    """Have a `function` of one object compute its result once for each object, which keeps it."""
    name = f"{function.__module__}.{function.__qualname__}"

    @wraps(function)
    def once(of: T) -> R:
        known = vars(of)
        if name in known:
            return known[name]
        result = function(of)
        if result is not of:  # which would not be deleted until cycles are searched for
            known[name] = result
        return result

    return once
