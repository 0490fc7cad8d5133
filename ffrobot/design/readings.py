"""What a goal is: a scalar by results, which is followed to those of a changed scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..results.file import Results


@dataclass(frozen=True)
class Reading:
    """A goal's value by results. Of a peak also where it is.

    Attributes:
        value: of the goal.
        unit: empty where it is not known.
        time: of a peak, s; NaN of all else.
        edge: "first" or "last" where that is an end of the run, which may move.
        column, sign: of its history, and of the value there.
        mode: of a frequency, the family and its number in it.
        coarse: of a peak, its value by every second output; NaN of all else.
    """

    value: float
    unit: str = ""
    time: float = float("nan")
    edge: Literal["", "first", "last"] = ""
    column: int = 0
    sign: float = 1.0
    mode: str = ""
    coarse: float = float("nan")


@dataclass(frozen=True)
class Followed:
    """The value of a goal by other results, a peak at its own place; `elsewhere`: where the largest value is now.

    `coarse`: as of `Reading`.
    """

    value: float
    elsewhere: str = ""
    coarse: float = float("nan")


class Goal:
    """One scalar; `text` is what the user calls it."""

    text: str
    analysis: str | None = None
    """Name that its history begins with, where that may be one of an analysis."""
    needs_motion = True
    """Whether an analysis has to be run for it."""

    def read(self, results: Results) -> Reading:
        """Its value. Raises `InputError` where the results do not have it."""
        raise NotImplementedError

    def follow(self, results: Results, nominal: Reading) -> Followed:
        """Its value by results of a changed scene."""
        return Followed(self.read(results).value)
