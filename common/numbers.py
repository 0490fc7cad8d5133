"""Types of keys that are numbers or counts, with limits inside which nothing overflows or runs out of memory.

The largest number is the same for all keys: see `tables.beyond_limits`.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from .tables import SMALLEST as SMALLEST

MOST_OUTPUTS = 10_000_000  # of an analysis; samples of a closed loop likewise
MOST_STEPS = 10**12
MOST_MODES = 1000
MOST_PATCHES = 1000  # on one link
MOST_RUNS = 100_000  # of a sweep


def _not_too_small(value: float) -> float:
    if 0.0 < value < SMALLEST:
        raise ValueError(f"expected a number of at least {SMALLEST:g}, found {value:g}")
    return value


Positive = Annotated[float, Field(gt=0.0), AfterValidator(_not_too_small)]
NotNegative = Annotated[float, Field(ge=0.0), AfterValidator(_not_too_small)]
Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
ModeCount = Annotated[int, Field(gt=0, le=MOST_MODES)]
PatchCount = Annotated[int, Field(gt=0, le=MOST_PATCHES)]
