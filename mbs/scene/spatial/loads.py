"""Given loads of a scene in space, key by key. SI units."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import model_validator

from ....common.validation import Record
from ..._core import TimeFunction
from ...fields.field_types import Expression, PointReference, one_of, only, present
from ...fields.references import Reference, marker_reference

OF_POINT = ("x", "y", "z", "mx", "my", "mz")


class SpatialLoad(Record):
    """A given load: force (N) and moment (N·m) on a section, in global axes, or the moment of a joint."""

    point: PointReference | None = None
    """Where it acts, "BODY.POINT"."""
    joint: str | None = None
    """Joint along whose coordinate it acts."""
    x: Expression | None = None
    """Force along the ground's x axis, N; expression in t."""
    y: Expression | None = None
    """Force along the ground's y axis, N; expression in t."""
    z: Expression | None = None
    """Force along the ground's z axis, N; expression in t."""
    mx: Expression | None = None
    """Moment about the ground's x axis on the section, N·m; expression in t."""
    my: Expression | None = None
    """Moment about the ground's y axis on the section, N·m; expression in t."""
    mz: Expression | None = None
    """Moment about the ground's z axis on the section, N·m; expression in t."""
    moment: Expression | None = None
    """On the second side of the joint along its coordinate, N·m (N where it slides); expression in t."""

    @model_validator(mode="after")
    def _consistent(self) -> SpatialLoad:
        subject = one_of(self, ("point", "joint"))
        only(self, subject, OF_POINT if subject == "point" else ("moment",), (*OF_POINT, "moment"))
        return self

    def references(self) -> Iterator[Reference]:
        """Where it acts."""
        yield from marker_reference("point", self.point, loaded=True)
        if self.joint is not None:
            yield Reference("joint", self.joint, "joint")

    @property
    def components(self) -> dict[str, TimeFunction]:
        """The given functions of time by component."""
        of_point = present(x=self.x, y=self.y, z=self.z, mx=self.mx, my=self.my, mz=self.mz)
        return of_point | present(moment=self.moment)
