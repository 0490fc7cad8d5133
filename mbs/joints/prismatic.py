"""Prismatic joints: the second side slides along an axis of the first and does not turn on it."""

from typing import Annotated, Literal

from ..fields.field_types import Vector2, Vector3
from ..fields.spelling import Spelled, place
from .joint import GUIDED, NOT_TURNED, Along
from .moving_joint import GearedJoint


def _direction(axis: Vector2) -> Vector3:
    if not any(axis):
        raise ValueError(f"expected an axis that is not zero in a prismatic joint, found {list(axis)}")
    return place(axis)


class PrismaticJoint(GearedJoint):
    """The second point slides along `axis` by its coordinate, m; `rpy` is the orientation of the second side.

    In planar scenes the second side keeps the angle of the initial guess.

    Drivetrain: `rotor_inertia` J (kg·m²) of a rotor that turns by `gear_ratio` N (rad/m) times the coordinate: a mass J
    N² along it; the turning of the rotor by the first side is omitted. Between the gear of a motor and the second body
    a spring `stiffness` (N/m; default: rigid) and a damper `damping` (N·s/m).
    """

    type: Literal["prismatic"]
    axis: Annotated[Vector3, Spelled(Vector2, _direction)]
    """Axis of motion in the axes of the first of `between` (ground: global), of any length."""

    @classmethod
    def demand_key(cls, key: str) -> str:
        """Return the message for a missing axis; empty for other keys."""
        return "expected an axis that is not zero in a prismatic joint, found none" if key == "axis" else ""

    units = ("m",)
    axes = (2,)
    loop_equations = (*GUIDED, NOT_TURNED)
    along = (Along("slide", 2),)
