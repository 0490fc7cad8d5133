"""Keys of a scene file that concern linear models and what is designed with them. Lengths in m."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ...common.validation import Record
from ..fields.field_types import Positive


class Placement(Record):
    """Where on one link the patches of its [[pzt]] should be, `count` of them.

    `criterion` "controllability": they reach the `modes` lowest modes of the robot with its motors held; "voltage":
    the largest voltage, relative to its limit, by which they produce the forces of the `modes` lowest modes of the link
    over the inverse analysis `about`. `measure` says which reach counts: of the worst mode, on average, or the product.
    Centers are sought every `spacing`, by trying all sets where that is at most `most_sets`, by evolution otherwise.
    """

    body: str
    count: Annotated[int, Field(gt=0)] | None = None
    criterion: Literal["controllability", "voltage"] = "controllability"
    measure: Literal["worst", "mean", "product"] = "worst"
    modes: Annotated[int, Field(gt=0)] | None = None
    spacing: Positive | None = None
    most_sets: Annotated[int, Field(gt=0)] = 100_000
