"""The axes of the plane and of 3D: which components the vectors of a motion have in each.

Motions are computed in 3D; those of a scene with `space = "planar"` stay in the plane z = 0 and turn about z.
"""

from collections.abc import Mapping
from types import MappingProxyType

from ...common.arrays import Array
from ...common.structs import struct


@struct
class Space:
    """A space by its axes among x, y, z (0, 1, 2)."""

    translations: tuple[int, ...]  # along which points move and forces act
    rotations: tuple[int, ...]  # about which bodies turn and moments act

    @property
    def is_plane(self) -> bool:
        """Whether the space is a plane, where one angle is a body's orientation."""
        return len(self.rotations) == 1

    def along(self, vectors: Array) -> Array:
        """Components (…, d) along the space's axes of positions, velocities or forces (…, 3), any unit."""
        return vectors[..., list(self.translations)]

    def about(self, vectors: Array) -> Array:
        """Components about the space's axes of vectors (…, 3), rad/s or N·m: (…, 3), planar (…)."""
        return vectors[..., self.rotations[0]] if self.is_plane else vectors[..., list(self.rotations)]


PLANE = Space((0, 1), (2,))
SPACES: Mapping[str, Space] = MappingProxyType({"planar": PLANE, "spatial": Space((0, 1, 2), (0, 1, 2))})
"""By what the key `space` of a scene says."""
