"""The keys of a scene in space for a robot read from a URDF."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...common.errors import quoted
from ...common.rotations import rpy_of
from ...common.tables import shown
from ...mbs.fields.field_types import GROUND
from .bodies import Mechanism, MergedLinks
from .flexible import ImportedLink
from .robot import HERE, MeshFile, Names, Origin, Primitive, Robot, UrdfJoint, three

GRAVITY = [0.0, 0.0, -9.81]
SCENE_TYPE = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "planar": "planar",
    "floating": "free",
    "fixed": "weld",
}
WITH_AXIS = ("revolute", "continuous", "prismatic", "planar")
SINGLE = ("revolute", "continuous", "prismatic")  # types with one coordinate
ORIGIN = "origin"  # point of a rigid body where the joint that carries it is


class SceneOfRobot:
    """Scene made from a URDF: `keys` of the file, and `remarks` on what it could not keep."""

    def __init__(
        self, robot: Robot, mechanism: Mechanism, flexible: Mapping[str, ImportedLink], meshes: Mapping[str, str]
    ) -> None:
        """`meshes` are files from the folder of the scene on, by the names that the URDF has for them."""
        self.robot, self.mechanism, self.flexible, self.meshes = robot, mechanism, flexible, meshes
        self.remarks = [*robot.remarks, *mechanism.remarks]
        self.bodies, self.joints = Names((GROUND,)), Names()
        self.points = {body.top: Names((ORIGIN,)) for body in mechanism.bodies}
        joints = [self._joint(joint) for joint in mechanism.joints]  # first: they name points
        self.keys: dict[str, Any] = {
            "name": " ".join("".join(c if c.isprintable() else " " for c in robot.name).split())[:100] or "robot",
            "space": "spatial",
            "gravity": GRAVITY,
            "body": [self._body(body) for body in mechanism.bodies],
            "joint": joints,
        }
        if tools := list(self._tool_records()):
            self.keys["tool"] = tools
        self._remark_on_ground()
        changed = self.bodies.changed | self.joints.changed
        self.remarks += [f'"{shown(old)}" is called "{new}" in the scene' for old, new in changed.items()]

    def _remark_on_ground(self) -> None:
        still = [name for name, body in self.mechanism.body_of.items() if body.stands_still]
        mass = sum(inertial.mass for name in still if (inertial := self.robot.links[name].inertial) is not None)
        if still:
            names = quoted(map(shown, still))
            said = "are fixed to the ground and are" if len(still) > 1 else "is fixed to the ground and is"
            self.remarks.append(f"{names} (mass {mass:g} kg) {said} no body of the scene")

    def _body(self, body: MergedLinks) -> dict[str, Any]:
        name = self.bodies[body.top]
        if body.flexible:
            return {"name": name, "link": self.flexible[body.top].file_name}
        points = {ORIGIN: [0.0, 0.0, 0.0]}
        of_body = self.points[body.top]
        for joint in self.mechanism.joints:
            if self.mechanism.body_of.get(joint.parent) is body:
                points[of_body[joint.name]] = _numbers((body.members[joint.parent] @ joint.origin.place).d)
        for link, place in body.members.items():  # frames of tools and sensors keep their names
            if link != body.top and link not in self._tools(body):
                points[self._frame(body, link)] = _numbers(place.d)
        inertial = body.inertial
        J = (inertial.inertia + inertial.inertia.T) / 2  # symmetric to the last digit
        is_principal = not np.any(J - np.diag(np.diag(J)))
        inertia = _numbers(np.diag(J)) if is_principal else [_numbers(row) for row in J]
        rigid = {
            "mass": inertial.mass,
            "center": _numbers(inertial.center),
            "inertia": inertia,
            "points": points,
        }
        if visuals := list(self._visuals(body)):
            rigid["visual"] = visuals
        return {"name": name, "rigid": rigid}

    def _tools(self, body: MergedLinks) -> list[str]:
        """Links of a rigid body that carries no other: its frames with axes of their own, ends of fixed joints."""
        carries = any(self.mechanism.body_of.get(joint.parent) is body for joint in self.mechanism.joints)
        if carries or body.flexible or body.stands_still:
            return []
        return [
            link
            for link, place in body.members.items()
            if link != body.top and not self.robot.joints_of(link) and not np.array_equal(place.C, np.eye(3))
        ]

    def _frame(self, body: MergedLinks, link: str) -> str:
        return self.points[body.top][f"link {link}" if link in self.robot.joints else link]

    def _tool_records(self) -> Iterator[dict[str, Any]]:
        for body in self.mechanism.bodies:
            for link in self._tools(body):
                place, keys = body.members[link], {"name": self._frame(body, link)}
                keys |= {"point": f"{self.bodies[body.top]}.{ORIGIN}"}
                yield {**keys, "at": _numbers(place.d), "rpy": rpy_of(place.C)}

    def _visuals(self, body: MergedLinks) -> Iterator[dict[str, Any]]:
        """Shapes of all its links, in the body's axes; meshes as far as their files are there."""
        for link, place in body.members.items():
            for shape in (part for whole in self.robot.links[link].visual for part in _shown(whole)):
                at = place @ shape.origin.place
                if isinstance(shape, MeshFile):
                    if shape.filename not in self.meshes:
                        continue
                    keys: dict[str, Any] = {"mesh": self.meshes[shape.filename]}
                    if shape.scale != (1.0, 1.0, 1.0):
                        keys["scale"] = list(shape.scale)
                elif all(size > 0 for size in shape.size):
                    keys = {shape.shape: shape.size[0] if shape.shape == "sphere" else list(shape.size)}
                else:
                    continue
                if np.any(at.d):
                    keys["at"] = _numbers(at.d)
                if any(rpy := rpy_of(at.C)):
                    keys["rpy"] = rpy
                yield keys

    def _joint(self, joint: UrdfJoint) -> dict[str, Any]:
        parent, child = self.mechanism.body_of.get(joint.parent), self.mechanism.body_of[joint.child]
        place = joint.origin.place if parent is None else parent.members[joint.parent] @ joint.origin.place
        keys: dict[str, Any] = {"name": self.joints[joint.name], "type": SCENE_TYPE[joint.type]}
        on_ground = parent is None or parent.stands_still
        first = GROUND if parent is None or on_ground else f"{self.bodies[parent.top]}.{self._point(parent, joint)}"
        second = "root" if child.flexible else ORIGIN
        keys["between"] = [first, f"{self.bodies[child.top]}.{second}"]
        if on_ground and np.any(place.d):
            keys["at"] = _numbers(place.d)
        if joint.type in WITH_AXIS:
            keys["axis"] = _numbers(place.C @ np.array(joint.axis))
        # The URDF's own numbers where nothing is merged in between.
        is_plain = parent is None or (parent.members[joint.parent] is HERE and child.members[joint.child] is HERE)
        rpy = list(joint.origin.rpy) if is_plain else rpy_of(place.C @ child.members[joint.child].C.T)
        if any(rpy):
            keys["rpy"] = rpy
        self._remark_on_mimic(joint)
        return keys | self._limits(joint) | self._friction(joint)

    def _point(self, body: MergedLinks, joint: UrdfJoint) -> str:
        if body.flexible:
            return self.flexible[body.top].point_of[joint.name]
        return self.points[body.top][joint.name]

    def _limits(self, joint: UrdfJoint) -> dict[str, Any]:
        keys: dict[str, Any] = {}
        label, limits = f'joint "{shown(joint.name)}"', dict(joint.limits)
        if joint.type == "continuous":
            limits = {key: value for key, value in limits.items() if key in ("effort", "velocity")}
        if joint.type not in SINGLE:
            if limits:
                self.remarks.append(f"{label}: limits of a {joint.type} joint left out")
            return {}
        lower, upper = limits.get("lower", 0.0), limits.get("upper", 0.0)
        if lower < upper:
            keys["position_limit"] = [lower, upper]
        elif joint.type != "continuous":
            told = f"range {lower:g} … {upper:g} left out: nothing lies between"
            has_range = bool({"lower", "upper"} & limits.keys())
            self.remarks.append(f"{label}: {told if has_range else 'no <limit> with a range: it moves without end'}")
        for key, ours in (("effort", "moment_limit"), ("velocity", "speed_limit")):
            if limits.get(key, 0.0) > 0:
                keys[ours] = limits[key]
            elif key in limits:
                self.remarks.append(f"{label}: {key} limit {limits[key]:g} left out: expected it greater than 0")
        return keys

    def _remark_on_mimic(self, joint: UrdfJoint) -> None:
        if (mimic := joint.mimic) is None:
            return
        leader, name = self.robot.joints[mimic.joint], f'joint "{shown(joint.name)}"'
        if leader.type == "fixed":
            self.remarks.append(
                f'{name} follows "{shown(mimic.joint)}", which is fixed: its position is {mimic.offset:g}; give it a'
                " trajectory of that value"
            )
        elif leader not in self.mechanism.joints:
            self.remarks.append(f'{name} follows "{shown(mimic.joint)}", which is left out: give it its own trajectory')
        else:
            self.remarks.append(
                f'{name} follows "{shown(mimic.joint)}": give it a separate trajectory,'
                f" {mimic.multiplier:g} times that one plus {mimic.offset:g}; the motor of that one then has to supply"
                f" {mimic.multiplier:g} times this one's torque in addition to its own"
            )

    def _friction(self, joint: UrdfJoint) -> dict[str, Any]:
        keys: dict[str, Any] = {}
        for key, ours in (("damping", "viscous_friction"), ("friction", "coulomb_friction")):
            value = joint.dynamics.get(key, 0.0)
            label = f'joint "{shown(joint.name)}": {key} {value:g} left out'
            if value < 0:
                self.remarks.append(f"{label}: expected a value ≥ 0")
            elif value and joint.type not in SINGLE:
                self.remarks.append(f"{label}, of a {joint.type} joint")
            elif value:
                keys[ours] = value
        return keys


def _shown(shape: MeshFile | Primitive) -> Iterator[MeshFile | Primitive]:
    """Shapes that scenes have: of a capsule its cylinder and two spheres."""
    if not isinstance(shape, Primitive) or shape.shape != "capsule":
        yield shape
        return
    (radius, length), place = shape.size, shape.origin.place
    yield replace(shape, shape="cylinder")
    for end in (-length / 2, length / 2):
        yield Primitive("sphere", (radius,), Origin(three(place.d + end * place.C[:, 2])))


def _numbers(vector: Iterable[float]) -> list[float]:
    return [float(value) + 0.0 for value in vector]  # no −0.0
