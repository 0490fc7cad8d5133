"""What planar scenes can say and scenes in space cannot: THE list; each is refused by name where it is found."""

from __future__ import annotations

from collections.abc import Iterator

from ....common.validation import quoted
from ...joints.joint import JointRecord
from ...joints.moving_joint import MovingJoint
from ..mechanism import MechanismKeys


def not_carried(scene: MechanismKeys) -> Iterator[str]:
    """What the embedding in space leaves no way to say, a line each with its key."""
    yield from _trajectories(scene)
    if scene.motors == "frame":
        yield from _coordinates_of_frames(scene)
    yield from _floating(scene)


def _trajectories(scene: MechanismKeys) -> Iterator[str]:
    """An orientation in space is three rows, of which the plane needs one: the others count as too many."""
    for trajectory in scene.trajectory:
        if trajectory.angle is not None:
            yield (
                f'trajectory "{trajectory.name}": angle: expected points and joints that follow trajectories in 3D,'
                f' found the angle of "{trajectory.angle}"'
            )


def _coordinates_of_frames(scene: MechanismKeys) -> Iterator[str]:
    """Coordinates of joints are of sections in space, also with motors = "frame"; where links bend they are others."""
    rigid = {"ground", *(body.name for body in scene.body if body.rigid is not None)}
    turning = [joint for joint in scene.joint if joint.type == "revolute"]
    bent = {joint.name: joint for joint in turning if not rigid.issuperset(joint.bodies)}
    named = [(f'trajectory "{path.name}": joint', path.joint) for path in scene.trajectory]
    named += [(f"load no. {k}: joint", load.joint) for k, load in enumerate(scene.load, 1)]
    for key, name in named:
        if name in bent:
            yield _of_sections(key, f'the coordinate of "{name}"')
    for joint in bent.values():
        for key in _along_its_coordinate(joint):
            yield _of_sections(f"{joint.label}: {key}", "it in a joint of links that bend")


def _along_its_coordinate(joint: JointRecord) -> Iterator[str]:
    if isinstance(joint, MovingJoint):
        keys = ("viscous_friction", "coulomb_friction", "rotor_inertia")
        yield from (key for key in keys if getattr(joint, key))


def _of_sections(key: str, found: str) -> str:
    return f'{key}: expected motors = "section", as joints turn sections in 3D, found {found} and motors = "frame"'


def _floating(scene: MechanismKeys) -> Iterator[str]:
    """In space a body without any joint is free from the origin on; what else floats would need a free joint."""
    topology = scene.topology
    joined = {body for joint in scene.joint for body in joint.bodies}
    turned = {body for of in (scene.guessed_angles, scene.guessed_rates) for body, value in of.items() if value}
    floating = [body.name for body in scene.body if body.name not in topology.grounded]
    if together := [name for name in floating if name in joined]:
        yield f"joint: expected joints that lead to the ground in 3D, found {quoted(together)} without"
    for name in floating:
        if name in turned and name not in joined:
            yield f'initial: expected bodies without joints to start at angle and rate 0 in 3D, not so of "{name}"'
