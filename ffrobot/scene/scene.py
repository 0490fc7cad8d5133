"""A scene file as a whole, in 3D and, in the same records, in the plane; its tables are records of their own."""

from collections.abc import Iterator
from typing import Annotated

from ..actuation.patches.records import PztLayout
from ..actuation.points import ActuationPoints
from ..common.deferred import Table
from ..mbs.fields.field_types import NotEmpty, Reference, under
from ..mbs.scene.mechanism import MechanismKeys, MechanismScene
from .kinds import AnyKind


class SceneKeys(MechanismKeys):
    """Keys of a scene file. Names of lists of tables are singular, as in the file."""

    pzt: tuple[Table[PztLayout], ...] = ()
    """Layouts of piezoelectric patches; names distinguish several on one body."""
    actuation_points: tuple[Table[ActuationPoints], ...] = ()
    """Points of forces that replace the driving forces."""
    analysis: Annotated[tuple[AnyKind, ...], NotEmpty]
    """Analyses, in this order."""

    @property
    def read_joints(self) -> frozenset[str]:
        """Names of joints with sensors or controllers."""
        named = (reference for analysis in self.analysis for reference in analysis.references())
        return frozenset(reference.name for reference in named if reference.kind == "joint")

    def references(self) -> Iterator[Reference]:
        """Yield all references of the scene's records, with their full keys."""
        yield from super().references()
        for layout in self.pzt:
            yield from under(f'pzt "{layout.label}"', layout.references())
        for points in self.actuation_points:
            yield from under(f'actuation_points "{points.body}"', points.references())
        for analysis in self.analysis:
            yield from under(f'analysis "{analysis.name}"', analysis.references())


class Scene(SceneKeys, MechanismScene):
    """A validated scene, with the absolute `path` of its file and the raw `text` that results files carry."""

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
