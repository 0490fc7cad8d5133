"""What a scene says of a mechanism: bodies, joints, trajectories, loads, and the state it starts from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from ...common.validation import Record
from ..fields.field_types import GROUND, NotEmpty, Vector2
from ..fields.references import Reference, marker_reference
from .mechanism_records import Body, Initial, Joint, Load, Payload, Trajectory


class MechanismKeys(Record):
    """The keys of a scene file that concern the mechanism; lists of tables keep the singular name they have there.

    `geometric_stiffening` "auto": where the loads of a run change the stiffness of a mode by more than 1 %.
    """

    name: Annotated[str, Field(min_length=1)]
    space: Literal["planar", "spatial"] = "planar"
    gravity: Vector2
    motors: Literal["section", "frame"] = "section"
    geometric_stiffening: bool | Literal["auto"] = False
    body: Annotated[tuple[Body, ...], NotEmpty]
    joint: tuple[Joint, ...] = ()
    trajectory: tuple[Trajectory, ...] = ()
    load: tuple[Load, ...] = ()
    payload: tuple[Payload, ...] = ()
    initial: Initial = Initial()

    def references(self) -> Iterator[Reference]:
        """All that records of the scene refer to, with their full keys."""
        for joint in self.joint:
            for k, side in enumerate(joint.between):
                if side != GROUND:
                    yield Reference(f'joint "{joint.name}": between[{k}]', side, needs_marker=True, loaded=True)
        for trajectory in self.trajectory:
            key = f'trajectory "{trajectory.name}"'
            yield from marker_reference(f"{key}: point", trajectory.point, loaded=True)
            yield from marker_reference(f"{key}: angle", trajectory.angle, loaded=True)
            if trajectory.joint is not None:
                yield Reference(f"{key}: joint", trajectory.joint, "joint")
        for k, load in enumerate(self.load, 1):
            for found in load.references():
                yield Reference(f"load no. {k}: {found.key}", found.name, found.kind, found.needs_marker, found.loaded)
        for k, payload in enumerate(self.payload, 1):
            yield Reference(f"payload no. {k}: point", payload.point)
        for table, guesses in (("angles", self.initial.angles), ("rates", self.initial.rates)):
            for body in guesses:
                yield Reference(f"initial.{table}", body)


class MechanismScene(MechanismKeys):
    """A validated scene, with the absolute `path` of its file and the raw `text` that results files carry."""

    path: Path
    text: str
