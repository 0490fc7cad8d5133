"""`ffrobot export SCENE.toml --format urdf`: a 3D scene as a URDF, its links rigid, for viewers."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, quoted
from ...common.rotations import rpy_of
from ...mbs.fields.field_types import GROUND
from ...mbs.joints.joint import JointRecord
from ...mbs.joints.joints import ScrewJoint
from ...mbs.model.build import build_model
from ...mbs.model.nodes import Node
from ...mbs.model.tree import KinematicTree
from ...run.bodies import LoadedBody, load_bodies
from ...scene.load import load_robot
from ...scene.scene import Scene
from .robot import Names, inertial_of
from .scene import GRAVITY
from .shape_masses import SLENDER, bars, beam_visuals

logger = logging.getLogger(__name__)

Element = ElementTree.Element
ORIGIN = np.zeros(3)
LIMITS = {"position_limit", "moment_limit", "speed_limit", "viscous_friction", "coulomb_friction"}


class Step(NamedTuple):
    """One of the URDF's joints that replace a joint of the scene."""

    type: str  # in URDF; "revolute" is written as "continuous" where the scene has no limit
    axis: int = 2  # number of the axis in the joint's triad
    coordinate: int = 0  # number of the coordinate of the scene's joint, −1 for none
    label: str = ""  # added to the joint's name where several steps replace it


STEPS: Mapping[str, tuple[Step, ...]] = {
    "revolute": (Step("revolute"),),
    "prismatic": (Step("prismatic"),),
    "weld": (Step("fixed", coordinate=-1),),
    "planar": (Step("planar", coordinate=-1),),
    "free": (Step("floating", coordinate=-1),),
    "cylindrical": (Step("revolute", 2, 0, "angle"), Step("prismatic", 2, 1, "way")),
    "screw": (Step("revolute"), Step("prismatic", 2, -1, "way")),
    "universal": (Step("revolute", 0, 0, "first"), Step("revolute", 1, 1, "second")),
    "spherical": (Step("revolute", 0, -1, "x"), Step("revolute", 1, -1, "y"), Step("revolute", 2, -1, "z")),
}
"""Steps of each type of joint in scenes, from its first side to the second."""


def _steps_outward(joint: JointRecord, backwards: bool) -> list[tuple[Step, Array]]:
    """The steps from the inner side, each with its axis (3,) in axes of the outer side at coordinates of zero.

    If the second side carries the first, `backwards`, steps and axes are reversed.
    """
    steps, sign = STEPS[joint.type], -1.0 if backwards else 1.0
    triad = sign * joint.triads()[0 if backwards else 1]
    triad = np.where(np.abs(triad) < np.finfo(float).eps, 0.0, triad)  # axes of the scene without round-off
    return [(step, triad[:, step.axis]) for step in (reversed(steps) if backwards else steps)]


def _losses(scene: Scene, loaded: Mapping[str, LoadedBody], tree: KinematicTree, size: float) -> Iterator[str]:
    """A line for each; `size` of the robot (m) replaces ranges that URDF needs and the scene lacks."""
    if flexible := [name for name, body in loaded.items() if body.modal is not None]:
        yield f"{quoted(flexible)}: rigid in the URDF, undeformed"
    if scene.payload:
        yield "payloads are part of the <inertial> of their links"
    if tree.loops:
        yield f"{quoted(joint.name for joint in tree.loops)}: left out: URDF has trees only, loops are open there"
    for node in tree.nodes:
        joint, count = node.joint, len(STEPS[node.joint.type])
        if count > 1:
            what = f"{joint.label}: {count} joints instead of a {joint.type} one, with links without mass between"
            angles = "; angles about x, y, z instead of its orientation" if joint.type == "spherical" else ""
            yield f"{what}: for viewers, `ffrobot import` rejects them{angles}"
        elif node.backwards and joint.type in ("planar", "free"):
            yield f"{joint.label}: its coordinates there are those of its first side on its second"
    yield from _of_keys(tree, size)
    if list(scene.gravity) != GRAVITY:
        yield f"gravity {list(scene.gravity)} left out: `ffrobot import` takes {GRAVITY}"
    tables = {
        "[[trajectory]]": scene.trajectory,
        "[[load]]": scene.load,
        "[[pzt]]": scene.pzt,
        "[initial]": scene.initial.model_fields_set,
        "[[analysis]]": scene.analysis,
    }
    if left := [name for name, entries in tables.items() if entries]:
        yield f"left out: {', '.join(left)}"


def _of_keys(tree: KinematicTree, size: float) -> Iterator[str]:
    range_of = f"a range of ±{size:.4g} m, the size of the robot: URDF wants one, the scene has none"
    of = dict[str, list[str]]()
    for joint in (node.joint for node in tree.nodes):
        steps, keys = STEPS[joint.type], joint.model_fields_set
        slides = [step.coordinate for step in steps if step.type == "prismatic" and step.coordinate >= 0]
        is_planar = steps[0].type == "planar" and (joint.motor_limits or joint.frictions)
        for text, holds in {
            range_of: any(np.isinf(joint.position_limits[slide]).any() for slide in slides),
            "rotor_inertia and compliance of gears left out": getattr(joint, "rotor_inertia", 0.0),
            "power_limit left out": any(np.isfinite(each.power) for each in joint.motor_limits),
            "friction_speed left out": "friction_speed" in keys,
            "limits and friction of a planar joint left out": is_planar and keys & LIMITS,
        }.items():
            if holds:
                of.setdefault(text, []).append(joint.name)
    yield from (f"{quoted(names)}: {text}" for text, names in of.items())


def scene_as_urdf(path: Path) -> tuple[str, str, tuple[str, ...]]:
    """Return a scene file as text of a URDF, a summary, and remarks on losses. Raises `InputError` for 2D scenes."""
    scene = load_robot(path)
    if scene.is_planar:
        raise InputError(
            f'{path}: --format urdf: expected a scene with space = "spatial"',
            "a planar one, which has no moments of inertia about x and y",
        )
    loaded = load_bodies(scene, lambda stage: logger.info("%s", stage))
    urdf = UrdfOfScene(scene, loaded)
    counts = f"{len(scene.body)} bodies and {len(scene.joint) - len(urdf.tree.loops)} joints of {scene.name}"
    ElementTree.indent(urdf.root)
    text = '<?xml version="1.0"?>\n' + ElementTree.tostring(urdf.root, encoding="unicode") + "\n"
    return text, counts, tuple(_losses(scene, loaded, urdf.tree, urdf.size))


class UrdfOfScene:
    """A scene as a URDF: the frame of a link has the axes of its body, its origin at the joint that carries it.

    Attributes:
        root: the element <robot>.
        tree: joint tree of the scene.
        size: size of the robot, m.
    """

    def __init__(self, scene: Scene, loaded: Mapping[str, LoadedBody]) -> None:
        self._scene, self._loaded = scene, loaded
        without = scene.model_copy(update={"payload": ()})  # they are part of their links
        model = build_model(without, [loaded[body.name].carrying for body in scene.body])
        self.tree, self.size = model.tree, model.size
        self._link_names = Names((GROUND, *(body.name for body in scene.body)))
        self._joint_names = Names(joint.name for joint in scene.joint)
        self.root, self._joints = Element("robot", name=scene.name), list[Element]()
        _add(self.root, "link", name=GROUND)
        for node in self.tree.nodes:
            self._add_body(node)
        for node in self.tree.nodes:
            self._add_joint(node)
            self._add_frames(node)
        self.root.extend(self._joints)

    def _add_body(self, node: Node) -> None:
        link, at = _add(self.root, "link", name=node.body.name), _anchor(node)
        part = inertial_of(node.body, at)
        inertial, J = _add(link, "inertial"), part.inertia
        _add_origin(inertial, part.center)
        _add(inertial, "mass", value=part.mass)
        _add(inertial, "inertia", ixx=J[0, 0], ixy=J[0, 1], ixz=J[0, 2], iyy=J[1, 1], iyz=J[1, 2], izz=J[2, 2])
        modal = self._loaded[node.body.name].modal
        if modal is not None and modal.stations.outline is not None:
            shapes = beam_visuals(modal, at)
        else:
            places = [place - at for place in _own_points(self._loaded[node.body.name]).values()]
            shapes = bars(places, self.size / SLENDER)
        for shape in shapes:
            visual = _add(link, "visual")
            _add_origin(visual, shape.origin.xyz, shape.origin.rpy)
            sizes: dict[str, Any] = dict(zip(("radius", "length"), shape.size, strict=False))
            if shape.shape == "box":
                sizes = {"size": _triple(shape.size)}
            _add(_add(visual, "geometry"), shape.shape, **sizes)

    def _add_frames(self, node: Node) -> None:
        """Points that carry nothing, such as tools: links without mass."""
        body, at = node.body, _anchor(node)
        taken = {other.inner.point for other in self.tree.nodes if other.inner.body == self.tree.index[body.name]}
        for point, place in _own_points(self._loaded[body.name]).items():
            if point not in taken and np.any(place - at):
                name = self._link_names[f"{body.name}.{point}"]
                _add(self.root, "link", name=name)
                triad = body.points[point].triad
                self._joint(self._joint_names[f"{name}.fixed"], "fixed", body.name, name, place - at, rpy_of(triad))

    def _add_joint(self, node: Node) -> None:
        """The steps of a joint one after the other, with links without mass in between."""
        joint, (xyz, rpy) = node.joint, self._origin(node)
        parent = GROUND if node.inner.body < 0 else self.tree.nodes[node.inner.body].body.name
        steps = _steps_outward(joint, node.backwards)
        own = node.body.points[node.outer.point].triad if node.outer.point else np.eye(3)
        is_named = joint in self._scene.joint  # a body without any joint gets one
        for number, (step, axis) in enumerate(steps, 1):
            name, child = joint.name if is_named else self._joint_names[f"{node.body.name}.free"], node.body.name
            if step.label:
                name = self._joint_names[f"{joint.name}.{step.label}"]
            if number < len(steps):
                child = self._link_names[f"{name}.link"]
                _add(self.root, "link", name=child)
            has_end = step.coordinate >= 0 and np.all(np.isfinite(joint.position_limits[step.coordinate]))
            kind = "continuous" if step.type == "revolute" and not has_end else step.type
            element = self._joint(name, kind, parent, child, xyz, rpy)
            if kind not in ("fixed", "floating"):
                _add(element, "axis", xyz=_triple(own @ axis))
            if limits := self._limits(joint, step):
                _add(element, "limit", **limits)
            if joint.frictions and step.coordinate >= 0:
                friction = joint.frictions[step.coordinate]
                _add(element, "dynamics", damping=friction.viscous, friction=friction.coulomb)
            if isinstance(joint, ScrewJoint) and step.coordinate < 0:  # it goes along with the turn, m/rad
                _add(element, "mimic", joint=joint.name, multiplier=joint.rise, offset=0.0)
            parent, xyz, rpy = child, ORIGIN, ()

    def _joint(
        self, name: str, kind: str, parent: str, child: str, xyz: Sequence[float] | Array, rpy: Sequence[float]
    ) -> Element:
        self._joints.append(element := Element("joint", name=name, type=kind))
        _add_origin(element, xyz, rpy)
        _add(element, "parent", link=parent)
        _add(element, "child", link=child)
        return element

    def _origin(self, node: Node) -> tuple[Array, Sequence[float]]:
        """Place and angles of the child's link in the parent's where the coordinates are zero."""
        at = node.inner.position
        if node.inner.body >= 0:
            carrier = self.tree.nodes[node.inner.body]
            at = carrier.body.points[node.inner.point].position - _anchor(carrier)
        if self.tree.tools.keys() & {*node.joint.between}:
            return at, rpy_of(node.inner.triad @ node.outer.triad.T)
        return at, rpy_of(node.joint.orientation.T) if node.backwards else node.joint.rpy

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
        effort = velocity = 0.0
        if joint.motor_limits and step.coordinate >= 0:
            motor = joint.motor_limits[step.coordinate]
            effort, velocity = (value if np.isfinite(value) else 0.0 for value in (motor.moment, motor.speed))
        return {**limits, "effort": effort, "velocity": velocity} if limits or effort or velocity else {}


def _anchor(node: Node) -> Array:
    """Where the joint that carries a body sits on it (3,), m: the origin of its link."""
    return node.body.points[node.outer.point].position if node.outer.point else ORIGIN


def _own_points(loaded: LoadedBody) -> dict[str, Array]:
    """Points that the file of a body names, and tools with axes of their own, by name: (3,) m, body axes."""
    points, modal = loaded.spatial.points, loaded.modal
    return {
        name: at.position for name, at in points.items() if modal is None or name in modal.interfaces or at.is_turned
    }


def _add(parent: Element, tag: str, **values: float | str) -> Element:
    """A new element inside `parent`, its numbers with all their digits."""
    return ElementTree.SubElement(
        parent, tag, {key: value if isinstance(value, str) else repr(float(value)) for key, value in values.items()}
    )


def _triple(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)  # no −0.0


def _add_origin(parent: Element, xyz: Sequence[float] | Array, rpy: Sequence[float] = ()) -> None:
    if any(xyz) or any(rpy):
        _add(parent, "origin", xyz=_triple(xyz), rpy=_triple(rpy or ORIGIN))
