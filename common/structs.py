"""Classes that hold values: a solve loads 120, and the interpreter makes a frozen dataclass in four times the time."""

from dataclasses import dataclass, field
from typing import TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(eq_default=False, frozen_default=True, field_specifiers=(field,))
def struct(cls: type[T]) -> type[T]:
    """A dataclass whose objects are neither compared nor printed; type checkers refuse to set their fields."""
    return dataclass(eq=False, repr=False)(cls)
