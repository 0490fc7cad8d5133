"""Parts of trees: bodies on their joints, sections of bodies, and constraint equations between these."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from .._core import TimeFunction
from ..fields.orientations import OrientationLaw
from ..joints.joint import JointRecord
from .body import Body


class Section(NamedTuple):
    """A triad (3, 3), unit columns, on `point` of body no. `body`, or at `position` (3,), m, on the ground (−1).

    `still`: about its z it turns with the frame of the body, not with the section.
    """

    body: int
    point: str
    triad: Array
    position: Array
    still: bool = False

    def turned(self, rotation: Array) -> Array:
        """The triad's `rotation` (…, 3, n), any unit, from the section's: without that about z if `still`."""
        if not self.still:
            return rotation
        z = self.triad[:, 2]
        return rotation - z[:, None] * np.einsum("i,...ij->...j", z, rotation)[..., None, :]


@struct
class Node:
    """A body with its inboard joint."""

    body: Body  # its constants
    # inboard joint; where the scene has none a free one at the origin, in planar scenes a planar one
    joint: JointRecord
    backwards: bool  # whether the joint's first side is on this body
    inner: Section  # the joint's triad on the parent
    outer: Section  # its triad on this body
    # places of the joint's coordinates in q and v, and of modal coordinates
    q: slice
    p_q: slice
    v: slice
    p_v: slice

    @property
    def sign(self) -> float:
        """−1 where the tree traverses the joint from its second side to its first, else 1."""
        return -1.0 if self.backwards else 1.0

    def coordinates(self, q: Array) -> Array:
        """The joint's coordinates (…, k), rad or m, in the scene's order, at q (…, n_q), rad and m."""
        own = self.joint.coordinates(q[..., self.q])
        return self.joint.turned_around(own) if self.backwards else own


def rotor(node: Node) -> tuple[float, float]:
    """The inertia J (kg·m²) of the rotor in the inboard joint of a body, 0 without one, and its gear ratio N."""
    return float(getattr(node.joint, "rotor_inertia", 0.0)), float(getattr(node.joint, "gear_ratio", 1.0))


ConstraintKind = Literal["point", "slide", "dot", "rotation", "turn", "coordinate"]


@struct
class ConstraintRow:
    """One constraint equation: a measure of section b relative to section a equals `target`, or 0."""

    owner: str  # the joint or trajectory
    # "point", f·(r_b − r_a) with f in global axes; "slide", the same with f in axes of a; "dot", f·g with f in axes of
    # a and g in axes of b; "rotation", the turn of b against a about f, global axes; "turn", the angle of g of b about
    # f of a, unit vectors across each other in axes of both; "coordinate", `sign` times the joint coordinate
    kind: ConstraintKind
    a: Section
    b: Section
    # f, g: (3,) unit vectors; 0 in "coordinate"
    f: Array
    g: Array
    is_trajectory: bool = True
    # index in v; "turn" and "slide" subtract this coordinate, if it is not −1
    coordinate: int = -1
    sign: float = 1.0
    target: TimeFunction | None = None  # of points, angles and coordinates
    # orientation over time: in "rotation" that of a, whose triad is then A(t); in "dot" that of b
    law: OrientationLaw | None = None


def rows_of_joint(
    owner: str, node: Node, columns: Array, targets: Sequence[TimeFunction | None], sign: float = 1.0
) -> list[ConstraintRow]:
    """Equations by which a node's joint coordinates at `columns` (k,) of v, times `sign`, follow k `targets`.

    For planar joints, whose axes turn, they are between sections, with `sign` 1.
    """
    if node.joint.type != "planar":
        row = ConstraintRow(owner, "coordinate", node.inner, node.outer, np.zeros(3), np.zeros(3), sign=sign)
        at = zip(columns.tolist(), targets, strict=True)
        return [replace(row, coordinate=k, target=target) for k, target in at]
    x, y, z = np.eye(3)
    measures: tuple[tuple[ConstraintKind, Array, Array], ...] = (("slide", x, x), ("slide", y, y), ("turn", z, x))
    return [
        ConstraintRow(owner, kind, node.inner, node.outer, f, g, target=target)
        for (kind, f, g), target in zip(measures, targets, strict=True)
    ]
