"""What a URDF does not carry of a scene: printed at export."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ...common.errors import quoted
from ...mbs.joints.moving_joint import MovingJoint
from ...mbs.model.tree import KinematicTree
from ...run.loaded_body import LoadedBody
from ...scene.scene import Scene
from .scene import GRAVITY
from .steps import STEPS


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
