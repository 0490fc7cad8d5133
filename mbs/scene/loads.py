"""Given loads of a scene, key by key. SI units."""

from typing import Annotated, Self

from pydantic import ValidationInfo, model_validator

from ...common.errors import quoted
from .._core import TimeFunction
from ..fields.field_types import Expression, Expressions, PointReference, Referring, given_in, one_of, only
from ..fields.functions import StateForce
from ..fields.spelling import IN_SPACE, Spelled, is_planar, keys_here

OF_POINT = ("x", "y", "z", "mx", "my", "mz")


class Load(Referring):
    """A prescribed load: force (N) and moment (N·m) on a section in global axes, joint torque, or voltages (V).

    `force` on a point, in scenes made in Python: a function of its motion, see `functions.state_function`.
    """

    point: PointReference | None = None
    """Loaded point, "BODY.POINT"."""
    joint: str | None = None
    """Joint that it acts on, along its coordinate; behind a compliant gear on its motor, as that itself does."""
    pzt: str | None = None
    """Name of the layout with the driven patches (default: the name of the body)."""
    x: Expression | None = None
    """Force along global x, N; expression in t."""
    y: Expression | None = None
    """Force along global y, N; expression in t."""
    z: Annotated[Expression | None, IN_SPACE] = None
    """Force along global z, N; expression in t."""
    mx: Annotated[Expression | None, IN_SPACE] = None
    """Moment about global x on the section, N·m; expression in t."""
    my: Annotated[Expression | None, IN_SPACE] = None
    """Moment about global y on the section, N·m; expression in t."""
    mz: Annotated[Expression | None, IN_SPACE] = None
    """Moment about global z on the section, N·m; expression in t."""
    moment: Annotated[Expressions | None, Spelled(Expression)] = None
    """Torque on the second side of the joint (of a compliant gear: on its output, before the spring) along its
    coordinate, N·m (N along sliding coordinates); expression in t, or a list of them for several coordinates. In planar
    scenes also the counter-clockwise moment on a point."""
    force: StateForce | None = None
    """Function of t, position and velocity that returns force (N) and moment (N·m); in scenes made in Python only."""
    voltage: tuple[Expression, ...] | None = None
    """Voltages, V: one expression in t per patch of the layout."""

    refers_to = (("point", "loaded"), ("joint", "joint"), ("pzt", "patches"))

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> Self:
        subject = one_of(self, ("point", "joint", "pzt"))
        of_point = keys_here(self, (*OF_POINT, "force"), info)
        moment = ("moment",) if is_planar(info) else ()
        allowed = {"point": (*of_point, *moment), "joint": ("moment",), "pzt": ("voltage",)}[subject]
        given = only(self, subject, allowed, (*of_point, "moment", "voltage"))
        if self.force is not None and len(given) > 1:
            raise ValueError(f'expected "force" alone with "point", found {quoted(given)}')
        return self

    @property
    def components(self) -> dict[str, TimeFunction]:
        """The given functions of time by component; of lists "moment[k]", of voltages "voltage[k]"."""
        if self.point is not None and self.moments:  # in the plane: about its normal
            return given_in(self, ("x", "y")) | {"mz": self.moments[0]}
        voltages = {f"voltage[{k}]": function for k, function in enumerate(self.voltage or ())}
        key = "moment[{}]" if isinstance(self.moment, tuple) else "moment"
        moments = {key.format(k): function for k, function in enumerate(self.moments)}
        return given_in(self, OF_POINT) | moments | voltages

    @property
    def moments(self) -> tuple[TimeFunction, ...]:
        """Torques, N·m (or N), along each coordinate of the joint, as functions of time; empty of other loads."""
        if self.moment is None:
            return ()
        return self.moment if isinstance(self.moment, tuple) else (self.moment,)
