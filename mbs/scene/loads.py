"""Given loads of a scene file, key by key. SI units; planar (x, y)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from pydantic import model_validator

from ...common.validation import Record, quoted
from .. import _core
from .._core import TimeFunction
from ..fields.field_types import Expression, PointReference, one_of, only, present
from ..fields.references import Reference, marker_reference
from ..fields.state_forces import StateForce
from ..joints.measure import GROUND_FRAME, Measure, marker_at

_ALONG = {"x": _core.MeasureKind.x, "y": _core.MeasureKind.y, "moment": _core.MeasureKind.angle}


class Load(Record):
    """A prescribed load: force (N, global axes) and moment (N·m) at a point, joint torque, or voltages (V).

    `force` on a point, in scenes made in Python: a function of its motion, see `state_forces.state_function`.
    """

    point: PointReference | None = None
    """Loaded point, "BODY.POINT"."""
    joint: str | None = None
    """Joint that it acts on, along its coordinate."""
    pzt: str | None = None
    """Body with the driven patches."""
    x: Expression | None = None
    """Force along the ground's x axis, N; expression in t."""
    y: Expression | None = None
    """Force along the ground's y axis, N; expression in t."""
    moment: Expression | None = None
    """Counter-clockwise moment on the point, or on the second body of the joint, N·m; expression in t."""
    force: StateForce | None = None
    """Function of t, position and velocity that returns force (N) and moment (N·m); in scenes made in Python only."""
    voltage: tuple[Expression, ...] | None = None
    """Voltages, V: one expression in t per patch."""

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        subject = one_of(self, ("point", "joint", "pzt"))
        allowed = {"point": ("x", "y", "moment", "force"), "joint": ("moment",), "pzt": ("voltage",)}[subject]
        found = only(self, subject, allowed, ("x", "y", "moment", "force", "voltage"))
        if self.force is not None and len(found) > 1:
            raise ValueError(f'expected "force" alone with "point", found {quoted(found)}')
        return self

    def references(self) -> Iterator[Reference]:
        """Where it acts."""
        yield from marker_reference("point", self.point, loaded=True)
        if self.joint is not None:
            yield Reference("joint", self.joint, "joint")
        if self.pzt is not None:
            yield Reference("pzt", self.pzt, "patches")

    def measures(self, coordinate_of: Callable[[str], Measure]) -> Iterator[tuple[Measure, TimeFunction]]:
        """Along what it acts, and its magnitude (N or N·m) over time; nothing of voltages and forces of the state.

        `coordinate_of` gives the coordinate of a joint by its name.
        """
        if self.joint is not None:
            yield coordinate_of(self.joint), self.components["moment"]
        elif self.point is not None:
            label, marker = f'load on "{self.point}"', marker_at(self.point)
            for component, magnitude in self.components.items():
                yield Measure(label, _ALONG[component], GROUND_FRAME, marker), magnitude

    @property
    def components(self) -> dict[str, TimeFunction]:
        """The given functions of time by component: "x", "y", "moment", or "voltage[k]"."""
        voltages = {f"voltage[{k}]": function for k, function in enumerate(self.voltage or ())}
        return present(x=self.x, y=self.y, moment=self.moment) | voltages
