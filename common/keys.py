"""Types of keys of files: names, and numbers with limits inside which nothing overflows or runs out of memory.

The largest number is the same for all keys: see `tables.beyond_limits`.
"""

import unicodedata
from typing import Annotated

from pydantic import AfterValidator, Field

from .tables import SMALLEST as SMALLEST
from .tables import shown

LONGEST_NAME = 100  # characters
LONGEST_PATH = 4096  # what Linux opens
_UNSEEN = ("Cc", "Cs", "Co", "Cn", "Zl", "Zp")  # control characters, line breaks, what is no character at all


def check_title(value: str, most: int = LONGEST_NAME) -> str:
    """Return `value`. Raises `ValueError` if empty, longer than `most`, or with line breaks or control characters."""
    if not value.strip():
        raise ValueError(f'expected text that is not empty, found "{shown(value)}"')
    if len(value) > most:
        raise ValueError(f'expected a name of at most {most} characters, found {len(value)}: "{shown(value)}"')
    if any(unicodedata.category(character) in _UNSEEN for character in value):
        raise ValueError(f'expected a name without line breaks and control characters, found "{shown(value)}"')
    return value


def check_name(value: str) -> str:
    """Return `value`. Raises `ValueError` if it is no title (`check_title`), and for "/", "." and blanks around it."""
    if not value or value != value.strip() or "/" in value or "." in value:
        raise ValueError(f'expected a name without "/", "." and blanks around it, found "{shown(value)}"')
    return check_title(value)


Title = Annotated[str, AfterValidator(check_title)]
PathName = Annotated[str, AfterValidator(lambda value: check_title(value, LONGEST_PATH))]
Name = Annotated[str, AfterValidator(check_name)]

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


def _directed(vector: tuple[float, ...]) -> tuple[float, ...]:
    if not any(vector):
        raise ValueError(f"expected a direction, found {[0] * len(vector)}")
    return vector


Direction = Annotated[Vector3, AfterValidator(_directed)]
"""Of any length but 0."""
DirectionInPlane = Annotated[Vector2, AfterValidator(_directed)]
ModeCount = Annotated[int, Field(gt=0, le=MOST_MODES)]
PatchCount = Annotated[int, Field(gt=0, le=MOST_PATCHES)]
