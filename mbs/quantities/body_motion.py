"""How bodies and their points move: what results files have of them, in the plane (d = 2) and in 3D (d = 3)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...common.arrays import Array
from ..scene.space import Space


@dataclass(frozen=True)
class BodyMotion:
    """Motion of a body's frame and modes, one row per output, in global axes.

    Attributes:
        position: (T, d) R, m.
        orientation: in the plane (T,) θ, rad; in 3D (T, 4) quaternions of continuous sign.
        velocity: (T, d) m/s.
        angular_velocity: in the plane (T,), in 3D (T, 3), rad/s.
        modal, modal_velocity: (T, n), in the modes of the modal body file; of planar bodies with fewer modes in the
            coordinates of the equations.
    """

    position: Array
    orientation: Array
    velocity: Array
    angular_velocity: Array
    modal: Array
    modal_velocity: Array

    @property
    def datasets(self) -> dict[str, Array]:
        """By their names in results files."""
        return _named(vars(self))

    def within(self, space: Space, angle: Array) -> BodyMotion:
        """Of a motion in 3D what `space` has of it; in the plane `angle` (T,) stands for the quaternions."""
        return replace(
            self,
            position=space.along(self.position),
            orientation=angle if space.is_plane else self.orientation,
            velocity=space.along(self.velocity),
            angular_velocity=space.about(self.angular_velocity),
        )


@dataclass(frozen=True)
class PointMotion:
    """Motion of a point of a body: position (T, d) m, deflection Φ p (T, d) m in body axes.

    `orientation` (T, 4) of the section there in 3D, quaternions of continuous sign; None in the plane.
    """

    position: Array
    deflection: Array
    orientation: Array | None = None

    @property
    def datasets(self) -> dict[str, Array]:
        """By their names in results files."""
        return _named({key: values for key, values in vars(self).items() if values is not None})

    def within(self, space: Space) -> PointMotion:
        """Of a motion in 3D what `space` has of it."""
        turned = None if space.is_plane else self.orientation
        return PointMotion(space.along(self.position), space.along(self.deflection), turned)


def _named(found: dict[str, Array]) -> dict[str, Array]:
    """With an orientation as angle or quaternion."""
    kinds = {1: "angle", 2: "quaternion"}
    return {kinds[values.ndim] if key == "orientation" else key: values for key, values in found.items()}
