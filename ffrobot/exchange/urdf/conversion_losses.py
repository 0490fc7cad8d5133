"""Joints of scenes as chains of joints that URDF has, and what a URDF does not carry of a scene: printed at export."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.errors import quoted
from ...mbs.joints.joint import JointRecord
from ...mbs.joints.moving_joint import MovingJoint
from ...mbs.joints.screw import ScrewJoint
from ...mbs.model.tree import KinematicTree
from ...run.loaded_body import LoadedBody
from ...scene.scene import Scene
from .scene import GRAVITY


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


def conversion_losses(
    scene: Scene, loaded: Mapping[str, LoadedBody], tree: KinematicTree, size: float
) -> Iterator[str]:
    """A line for each; `size` of the robot (m) stands for ranges that URDF wants and the scene does not give."""
    if flexible := [name for name, body in loaded.items() if body.modal is not None]:
        yield f"{quoted(flexible)}: rigid in the URDF, undeformed"
    if scene.payload:
        yield "payloads are part of the <inertial> of their links"
    if tree.loops:
        yield f"{quoted(joint.name for joint in tree.loops)}: left out: URDF has trees only, loops are open there"
    yield from _of_types(tree)
    yield from _of_keys(tree, size)
    if list(scene.gravity) != GRAVITY:
        yield f"gravity {list(scene.gravity)} left out: `ffrobot import` takes {GRAVITY}"
    tables = {"[[trajectory]]": scene.trajectory, "[[load]]": scene.load, "[[pzt]]": scene.pzt,
              "[initial]": scene.initial.model_fields_set, "[[analysis]]": scene.analysis}  # fmt: skip
    yield f"left out: {', '.join(name for name, entries in tables.items() if entries)}"


def _of_types(tree: KinematicTree) -> Iterator[str]:
    """Joints that are several there, and those whose coordinates are others."""
    for node in tree.nodes:
        joint, count = node.joint, len(STEPS[node.joint.type])
        if count > 1:
            what = f"{joint.label}: {count} joints instead of a {joint.type} one, with links without mass between"
            angles = "; angles about x, y, z instead of its orientation" if joint.type == "spherical" else ""
            yield f"{what}: for viewers, `ffrobot import` rejects them{angles}"
        elif node.backwards and joint.type in ("planar", "free"):
            yield f"{joint.label}: its coordinates there are those of its first side on its second"


def _of_keys(tree: KinematicTree, size: float) -> Iterator[str]:
    """Keys of joints."""
    joints = [node.joint for node in tree.nodes]
    sliding = [joint for joint in joints if joint.type in ("prismatic", "cylindrical")]
    if endless := [joint.name for joint in sliding if np.isinf(joint.position_limits[-1]).any()]:
        yield f"{quoted(endless)}: a range of ±{size:.4g} m, the size of the robot: URDF wants one, the scene has none"
    if rotors := [joint.name for joint in joints if getattr(joint, "rotor_inertia", 0.0)]:
        yield f"{quoted(rotors)}: rotor_inertia and compliance of gears left out"
    if powers := [joint.name for joint in joints if any(np.isfinite(each.power) for each in joint.motor_limits)]:
        yield f"{quoted(powers)}: power_limit left out"
    moving = [joint for joint in joints if isinstance(joint, MovingJoint)]
    if smooth := [joint.name for joint in moving if "friction_speed" in joint.model_fields_set]:
        yield f"{quoted(smooth)}: friction_speed left out"
    several = [joint for joint in moving if len(joint.units) > 2 and (joint.motor_limits or joint.frictions)]
    if lost := [joint.name for joint in several if joint.model_fields_set & LIMITS]:
        yield f"{quoted(lost)}: limits and friction of a planar joint left out"


LIMITS = {"position_limit", "moment_limit", "speed_limit", "viscous_friction", "coulomb_friction"}
