"""Joints of scenes in space as chains of joints that URDF has: each step moves along or about one axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...mbs.joints.joint import JointRecord
from ...mbs.joints.screw import ScrewJoint


@dataclass(frozen=True)
class Step:
    """One joint of a URDF.

    Attributes:
        type: in URDF; "revolute" turns without end where the scene has no limit: then it is "continuous".
        axis: number of the axis, of the joint's triad.
        coordinate: number of the scene's coordinate that it has, −1 where it has none.
        label: added to the joint's name where it has several steps.
    """

    type: str
    axis: int = 2
    coordinate: int = 0
    label: str = ""


STEPS: Mapping[str, tuple[Step, ...]] = {
    "revolute": (Step("revolute"),),
    "prismatic": (Step("prismatic"),),
    "weld": (Step("fixed", coordinate=-1),),
    "planar": (Step("planar", coordinate=-1),),
    "free": (Step("floating", coordinate=-1),),
    "cylindrical": (Step("revolute", 2, 0, "angle"), Step("prismatic", 2, 1, "way")),
    "screw": (Step("revolute", 2, 0), Step("prismatic", 2, -1, "way")),
    "universal": (Step("revolute", 0, 0, "first"), Step("revolute", 1, 1, "second")),
    "spherical": (Step("revolute", 0, -1, "x"), Step("revolute", 1, -1, "y"), Step("revolute", 2, -1, "z")),
}
"""By the type of joint in scenes, from the first side to the second."""


def steps_outward(joint: JointRecord, backwards: bool) -> list[tuple[Step, Array]]:
    """The steps from the inner side, each with its axis (3,) in the axes of the outer side where coordinates are zero.

    Coordinates are those of the scene: where the second side carries the first, `backwards`, steps come in the other
    order, about axes the other way.
    """
    steps, sign = STEPS[joint.type], -1.0 if backwards else 1.0
    triad = sign * joint.triads()[0 if backwards else 1]
    triad = np.where(np.abs(triad) < np.finfo(float).eps, 0.0, triad)  # axes of the scene without rounding
    return [(step, triad[:, step.axis]) for step in (reversed(steps) if backwards else steps)]


def follows(joint: JointRecord, step: Step) -> float | None:
    """Way per angle (m/rad) of a screw's step that goes along with its turn; None of others."""
    return joint.rise if isinstance(joint, ScrewJoint) and step.coordinate < 0 else None
