"""Bodies on the joints that carry them, and sections of bodies: what trees are made of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from ..joints.joint import JointRecord
from .body import Body


class Section(NamedTuple):
    """A triad (3, 3), columns, on a section of body number `body`, or standing at `position` (m) on the ground (−1).

    `still`: about its z it turns with the frame of the body, not with the section.
    """

    body: int
    point: str
    triad: Array
    position: Array
    still: bool = False

    def turned(self, rotation: Array) -> Array:
        """What modes turn it by, of rotations (…, 3, n) of the section, or (…, 3) with a last axis of length one."""
        if not self.still:
            return rotation
        z = self.triad[:, 2]
        return rotation - z[:, None] * np.einsum("i,...ij->...j", z, rotation)[..., None, :]


@struct
class Node:
    """A body on the joint that carries it."""

    body: Body  # its constants
    # that carries it; where the scene has none a free one at the origin, in planar scenes a planar one
    joint: JointRecord
    backwards: bool  # whether the joint's first side is on this body
    inner: Section  # the joint's triad on what carries it
    outer: Section  # its triad on this body
    q: slice  # where the joint's coordinates stand in q
    p_q: slice  # and those of the modes
    v: slice  # likewise in v
    p_v: slice

    @property
    def sign(self) -> float:
        """−1 where the tree has the joint's coordinates the other way round."""
        return -1.0 if self.backwards else 1.0

    def coordinates(self, q: Array) -> Array:
        """Those of the joint (…, k) as the scene counts them, at q (…, n_q)."""
        found = self.joint.coordinates(q[..., self.q])
        return self.joint.turned_around(found) if self.backwards else found


def rotor(node: Node) -> tuple[float, float]:
    """Inertia J (kg·m²) of the rotor in the joint that carries a body, 0 without one, and its ratio N."""
    return float(getattr(node.joint, "rotor_inertia", 0.0)), float(getattr(node.joint, "gear_ratio", 1.0))
