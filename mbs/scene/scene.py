"""A scene file as a whole; its tables are records of their own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from ...common.validation import Record
from ..fields.field_types import NotEmpty, Vector2
from .actuator_records import ActuationPoints, PztLayout
from .analysis_records import Analysis
from .mechanism_records import Body, Initial, Joint, Load, Payload, Trajectory


class SceneKeys(Record):
    """Everything a scene file may contain; lists of tables keep the singular name they have in the file.

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
    pzt: tuple[PztLayout, ...] = ()
    actuation_points: tuple[ActuationPoints, ...] = ()
    load: tuple[Load, ...] = ()
    payload: tuple[Payload, ...] = ()
    initial: Initial = Initial()
    analysis: Annotated[tuple[Analysis, ...], NotEmpty]


class Scene(SceneKeys):
    """A validated scene, with the absolute `path` of its file and the raw `text` that results files carry."""

    path: Path
    text: str

    def __repr__(self) -> str:
        names = {
            "bodies": [body.name for body in self.body],
            "joints": [joint.name for joint in self.joint],
            "trajectories": [trajectory.name for trajectory in self.trajectory],
            "analyses": [analysis.name for analysis in self.analysis],
        }
        parts = [f"{kind} {', '.join(members)}" for kind, members in names.items() if members]
        return f"Scene({self.name!r}): {'; '.join(parts)}"

    __str__ = __repr__
