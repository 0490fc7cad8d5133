"""What records of a scene refer to: bodies, points of bodies, joints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from .field_types import GROUND, split_point


@dataclass(frozen=True)
class Reference:
    """One reference: `key` of the record where it stands, `name` "BODY", "BODY.POINT" or the joint's.

    "patches" are a layout of them, a "patched body" has some, an "elastic joint" has stiffness. Forces of the mechanism
    act at a point that is `loaded`.
    """

    key: str
    name: str
    kind: Literal["body", "flexible body", "patches", "patched body", "joint", "elastic joint"] = "body"
    loaded: bool = False

    @property
    def body_and_point(self) -> tuple[str, str] | None:
        """Its two parts; None where it names no point."""
        return split_point(self.name) if self.kind == "body" and "." in self.name else None


def loaded_reference(key: str, side: str | None) -> list[Reference]:
    """The reference to a point (or a body's frame) where forces act; none to the ground, or where nothing is given."""
    return [] if side is None or side == GROUND else [Reference(key, side, loaded=True)]


def body_of(side: str) -> str:
    """The body of "BODY.POINT" or "BODY"; the ground's name for the ground."""
    return side.partition(".")[0]


def under(label: str, references: Iterable[Reference]) -> Iterator[Reference]:
    """The references of a record that messages call `label`, with their full keys."""
    for found in references:
        yield replace(found, key=f"{label}: {found.key}" if found.key else label)
