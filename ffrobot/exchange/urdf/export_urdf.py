"""`ffrobot export SCENE.toml --format urdf`: a scene in space as a URDF, its links rigid, for viewers."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ...common.rotations import rpy_of
from ...mbs.fields.field_types import GROUND
from ...mbs.joints.joint import JointRecord
from ...mbs.joints.moving_joint import MovingJoint
from ...mbs.joints.screw import ScrewJoint
from ...mbs.model.model import build_model
from ...mbs.model.nodes import Node
from ...mbs.model.tree import KinematicTree
from ...mbs.posture.posture import robot_size
from ...run.bodies import LoadedBody, load_bodies
from ...scene.load import load_robot
from ...scene.scene import Scene
from .robot import Mimic, Names, Origin, Primitive, Robot, UrdfJoint, UrdfLink, inertial_of, three
from .scene import GRAVITY
from .shape_masses import SLENDER, bars, beam_visuals


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
    if left := [name for name, entries in tables.items() if entries]:
        yield f"left out: {', '.join(left)}"


def _of_types(tree: KinematicTree) -> Iterator[str]:
    for node in tree.nodes:
        joint, count = node.joint, len(STEPS[node.joint.type])
        if count > 1:
            what = f"{joint.label}: {count} joints instead of a {joint.type} one, with links without mass between"
            angles = "; angles about x, y, z instead of its orientation" if joint.type == "spherical" else ""
            yield f"{what}: for viewers, `ffrobot import` rejects them{angles}"
        elif node.backwards and joint.type in ("planar", "free"):
            yield f"{joint.label}: its coordinates there are those of its first side on its second"


def _of_keys(tree: KinematicTree, size: float) -> Iterator[str]:
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


logger = logging.getLogger(__name__)

ORIGIN = np.zeros(3)


def scene_as_urdf(path: Path) -> tuple[str, str, tuple[str, ...]]:
    """Text of the URDF, a few words on it, and what it does not carry.

    Raises:
        InputError: the scene is wrong, or planar.
    """
    scene = load_robot(path)
    if scene.is_planar:
        raise InputError(
            f'{path}: --format urdf: expected a scene with space = "spatial", found a planar one, which has no'
            " moments of inertia about x and y"
        )
    bodies = load_bodies(scene, lambda stage: logger.info("%s", stage))
    loaded = {body.name: part for body, part in zip(scene.body, bodies, strict=True)}
    made = UrdfOfScene(scene, loaded)
    counts = f"{len(scene.body)} bodies and {len(scene.joint) - len(made.tree.loops)} joints of {scene.name}"
    return urdf_text(made.robot, made.visuals), counts, tuple(conversion_losses(scene, loaded, made.tree, made.size))


class UrdfOfScene:
    """A scene as a URDF: the frame of a link has the axes of its body, its origin at the joint that carries it.

    Attributes:
        tree: of the scene.
        robot: links and joints, with the coordinates of the scene where URDF has them.
        visuals: by link.
        size: of the robot, m.
    """

    def __init__(self, scene: Scene, loaded: Mapping[str, LoadedBody]) -> None:
        self._scene, self._loaded = scene, loaded
        without = scene.model_copy(update={"payload": ()})  # they are part of their links
        model = build_model(without, [loaded[body.name].carrying for body in scene.body])
        self.tree, self.size = model.tree, robot_size(model)
        self._link_names = Names((GROUND, *(body.name for body in scene.body)))
        self._joint_names = Names(joint.name for joint in scene.joint)
        self._links = {GROUND: UrdfLink(GROUND, None)}
        self._joints = dict[str, UrdfJoint]()
        self.visuals = dict[str, list[Primitive]]()
        for node in self.tree.nodes:
            self._add_body(node)
        for node in self.tree.nodes:
            self._add_joint(node)
            self._add_frames(node)
        self.robot = Robot(scene.name, self._links, self._joints, GROUND)

    # Bodies

    def _add_body(self, node: Node) -> None:
        body, at = node.body, _anchor(node)
        self._links[body.name] = UrdfLink(body.name, inertial_of(body, at))
        modal = self._loaded[body.name].modal
        if modal is not None and modal.kind == "beam":
            self.visuals[body.name] = list(beam_visuals(modal, at))
        else:
            places = [place - at for place in _own_points(self._loaded[body.name]).values()]
            self.visuals[body.name] = list(bars(places, self.size / SLENDER))

    def _add_frames(self, node: Node) -> None:
        """Points that carry nothing, such as tools: links without mass."""
        body, at = node.body, _anchor(node)
        taken = {other.inner.point for other in self.tree.nodes if other.inner.body == self.tree.index[body.name]}
        for point, place in _own_points(self._loaded[body.name]).items():
            if point not in taken and np.any(place - at):
                name = self._link_names[f"{body.name}.{point}"]
                self._links[name] = UrdfLink(name, None)
                joint = self._joint_names[f"{name}.fixed"]
                origin = Origin(three(place - at), three(rpy_of(body.points[point].triad)))
                self._joints[joint] = UrdfJoint(joint, "fixed", body.name, name, origin)

    # Joints

    def _add_joint(self, node: Node) -> None:
        """The steps of a joint one after the other, with links without mass in between."""
        joint, origin = node.joint, self._origin(node)
        parent = GROUND if node.inner.body < 0 else self.tree.nodes[node.inner.body].body.name
        steps = steps_outward(joint, node.backwards)
        own = node.body.points[node.outer.point].triad if node.outer.point else np.eye(3)
        for number, (step, axis) in enumerate(steps, 1):
            name = self._joint_names[f"{joint.name}.{step.label}"] if step.label else self._name(node)
            child = node.body.name if number == len(steps) else self._link_names[f"{name}.link"]
            self._links.setdefault(child, UrdfLink(child, None))
            rise = follows(joint, step)
            self._joints[name] = UrdfJoint(
                name, self._type(joint, step), parent, child, origin, three(own @ axis), self._limits(joint, step),
                _dynamics(joint, step), None if rise is None else Mimic(joint.name, rise, 0.0),
            )  # fmt: skip
            parent, origin = child, Origin()

    def _name(self, node: Node) -> str:
        """That of the scene; a body without any joint gets one."""
        return node.joint.name if node.joint in self._scene.joint else self._joint_names[f"{node.body.name}.free"]

    def _origin(self, node: Node) -> Origin:
        """The child's link in the parent's where the coordinates are zero."""
        at = node.inner.position
        if node.inner.body >= 0:
            carrier = self.tree.nodes[node.inner.body]
            at = carrier.body.points[node.inner.point].position - _anchor(carrier)
        if self.tree.tools.keys() & {*node.joint.between}:
            return Origin(three(at), three(rpy_of(node.inner.triad @ node.outer.triad.T)))
        rpy = rpy_of(node.joint.orientation.T) if node.backwards else node.joint.rpy
        return Origin(three(at), three(rpy))

    def _type(self, joint: JointRecord, step: Step) -> str:
        has_end = step.coordinate >= 0 and np.all(np.isfinite(joint.position_limits[step.coordinate]))
        return "continuous" if step.type == "revolute" and not has_end else step.type

    def _limits(self, joint: JointRecord, step: Step) -> dict[str, float]:
        """URDF wants them of all joints but continuous ones: 0 stands for no limit of effort and velocity."""
        if step.type not in ("revolute", "prismatic"):
            return {}
        low, high = joint.position_limits[step.coordinate] if step.coordinate >= 0 else (-np.inf, np.inf)
        limits = dict[str, float]()
        if np.isfinite([low, high]).all():
            limits = {"lower": low, "upper": high}
        elif step.type == "prismatic":
            limits = {"lower": -self.size, "upper": self.size}
        motor = joint.motor_limits[step.coordinate] if joint.motor_limits and step.coordinate >= 0 else None
        found = (np.inf, np.inf) if motor is None else (motor.moment, motor.speed)
        effort, velocity = (value if np.isfinite(value) else 0.0 for value in found)
        return {**limits, "effort": effort, "velocity": velocity} if limits or effort or velocity else {}


def _dynamics(joint: JointRecord, step: Step) -> dict[str, float]:
    if not joint.frictions or step.coordinate < 0:
        return {}
    friction = joint.frictions[step.coordinate]
    return {"damping": friction.viscous, "friction": friction.coulomb}


def _anchor(node: Node) -> Array:
    """Where the joint that carries a body sits on it (3,), m: the origin of its link."""
    return node.body.points[node.outer.point].position if node.outer.point else ORIGIN


def _own_points(loaded: LoadedBody) -> dict[str, Array]:
    """Points that the file of a body names, and tools with axes of their own, by name: (3,) m, body axes."""
    points, modal = loaded.spatial.points, loaded.modal
    return {
        name: at.position for name, at in points.items() if modal is None or name in modal.interfaces or at.is_turned
    }


Element = ElementTree.Element


def urdf_text(robot: Robot, visuals: Mapping[str, Sequence[Primitive]]) -> str:
    """The file, numbers with all their digits; `visuals` by link, in axes of the link."""
    root = Element("robot", name=robot.name)
    for link in robot.links.values():
        element = ElementTree.SubElement(root, "link", name=link.name)
        if link.inertial is not None:
            inertial, J = _add(element, "inertial"), link.inertial.inertia
            _add_origin(inertial, Origin(three(link.inertial.center)))
            _add(inertial, "mass", value=link.inertial.mass)
            _add(inertial, "inertia", ixx=J[0, 0], ixy=J[0, 1], ixz=J[0, 2], iyy=J[1, 1], iyz=J[1, 2], izz=J[2, 2])
        for visual in visuals.get(link.name, ()):
            _add_visual(element, visual)
    for joint in robot.joints.values():
        _add_joint(root, joint)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add(parent: Element, tag: str, **values: float | str) -> Element:
    return ElementTree.SubElement(
        parent, tag, {key: value if isinstance(value, str) else repr(float(value)) for key, value in values.items()}
    )


def _triple(values: Sequence[float]) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)  # no −0.0


def _add_origin(parent: Element, origin: Origin) -> None:
    if any(origin.xyz) or any(origin.rpy):
        _add(parent, "origin", xyz=_triple(origin.xyz), rpy=_triple(origin.rpy))


def _add_visual(link: Element, visual: Primitive) -> None:
    element = _add(link, "visual")
    _add_origin(element, visual.origin)
    geometry = _add(element, "geometry")
    if visual.shape == "box":
        _add(geometry, "box", size=_triple(visual.size))
    elif visual.shape == "cylinder":
        _add(geometry, "cylinder", radius=visual.size[0], length=visual.size[1])
    else:
        _add(geometry, "sphere", radius=visual.size[0])


def _add_joint(root: Element, joint: UrdfJoint) -> None:
    element = _add(root, "joint", name=joint.name, type=joint.type)
    _add_origin(element, joint.origin)
    _add(element, "parent", link=joint.parent)
    _add(element, "child", link=joint.child)
    if joint.type not in ("fixed", "floating"):
        _add(element, "axis", xyz=_triple(joint.axis))
    for tag, values in (("limit", joint.limits), ("dynamics", joint.dynamics)):
        if values:
            _add(element, tag, **values)
    if (mimic := joint.mimic) is not None:
        _add(element, "mimic", joint=mimic.joint, multiplier=mimic.multiplier, offset=mimic.offset)
