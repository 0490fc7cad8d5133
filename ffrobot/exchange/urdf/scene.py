"""From a URDF to a 3D scene: links that fixed joints connect are one body, the root is the ground."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, quoted, refuse
from ...common.rotations import rpy_of
from ...common.tables import shown
from ...mbs.fields.field_types import GROUND
from ...mbs.scene.bodies import ROUND_OFF, check_inertia
from .flexible import ImportedLink
from .robot import (
    HERE,
    MASSLESS,
    WITH_AXIS,
    Inertial,
    MeshFile,
    Names,
    Origin,
    Place,
    Primitive,
    Robot,
    UrdfJoint,
    three,
)


@dataclass(eq=False)
class MergedLinks:
    """Links that are one body of the scene, which has the axes of the link `top`, or of its link file if flexible."""

    top: str  # name of the link that carries the others
    stands_still: bool = False  # whether it is the ground
    flexible: bool = False  # whether a link file describes it; then it has no other member
    members: dict[str, Place] = field(default_factory=dict)  # poses of links in the body's axes
    inertial: Inertial = MASSLESS  # of all members

    @property
    def weighs(self) -> bool:
        """Whether the body has mass."""
        return self.flexible or self.inertial.mass > 0

    @property
    def label(self) -> str:
        """Name of the top link, with those fixed to it, for messages."""
        fixed = [name for name in self.members if name != self.top]
        return f'link "{shown(self.top)}"' + (f" with {quoted(fixed)} fixed to it" if fixed else "")


def _mechanism(
    robot: Robot, flexible: Mapping[str, Place], fix_inertia: bool
) -> tuple[list[MergedLinks], list[UrdfJoint], dict[str, MergedLinks], list[str]]:
    """Bodies in the order in which joints carry them, these joints, the body of each link, and remarks on losses.

    `flexible`: poses of the URDF frames of flexible links in axes of their link files.
    """
    ground = MergedLinks(robot.root, stands_still=True)
    bodies, joints, body_of = [ground], list[UrdfJoint](), dict[str, MergedLinks]()

    def add(body: MergedLinks, link: str, place: Place) -> None:
        body.members[link], body_of[link] = place, body
        if (inertial := robot.links[link].inertial) is not None:
            body.inertial = body.inertial + inertial.seen_from(place)

    def carry(joint: UrdfJoint) -> None:
        joints.append(joint)
        bodies.append(MergedLinks(joint.child, flexible=joint.child in flexible))
        add(bodies[-1], joint.child, flexible.get(joint.child, HERE))

    if robot.root in flexible:
        ground.members[""], body_of[""] = HERE, ground  # no link has this name
        carry(UrdfJoint(f"{robot.root}_fixed", "fixed", "", robot.root))
    else:
        add(ground, robot.root, HERE)
    outward = robot.joints_of(robot.root)
    for joint in outward:  # which grows
        outward += robot.joints_of(joint.child)
        parent = body_of[joint.parent]
        if joint.type == "fixed" and not parent.flexible and joint.child not in flexible:
            add(parent, joint.child, parent.members[joint.parent] @ joint.origin.place)
        else:
            carry(joint)
    kept, carried, remarks = _with_mass(robot, bodies, joints, body_of)
    remarks += _fixed(kept) if fix_inertia else []
    refuse(_wrong_inertias(kept))
    return kept, carried, body_of, remarks


def _with_mass(
    robot: Robot, bodies: list[MergedLinks], joints: list[UrdfJoint], body_of: Mapping[str, MergedLinks]
) -> tuple[list[MergedLinks], list[UrdfJoint], list[str]]:
    """Bodies and joints without those beyond which nothing has mass: frames of tools and sensors."""
    below = {body for body in bodies if body.weighs}
    for joint in reversed(joints):
        if body_of[joint.child] in below:
            below.add(body_of[joint.parent])
    kept = [body for body in bodies if not body.stands_still and body in below]
    if not kept:
        if any(link.inertial is not None and link.inertial.mass > 0 for link in robot.links.values()):
            raise InputError(f'expected a link with mass that moves on "{shown(robot.root)}"', "none")
        raise InputError(
            "expected links with mass",
            "no <inertial> with one in the whole file: it was made for viewers. Add <inertial> to its links, from CAD"
            " or a data sheet, take a description of the robot for dynamics, or estimate masses by --density",
        )
    refuse(
        f"{body.label}: expected a mass of a body that moves and carries others, found none: give it an <inertial>,"
        " make the joint that carries it fixed, or estimate masses by --density"
        for body in kept
        if not body.weighs
    )
    remarks = [
        f'{joint.label} and link "{shown(joint.child)}" left out: nothing there has mass'
        for joint in joints
        if body_of[joint.child] not in below
    ]
    return kept, [joint for joint in joints if body_of[joint.child] in below], remarks


def least_change(inertia: Array) -> Array:
    """Return the inertia (3, 3), kg·m², nearest to `inertia` (Frobenius norm) with principal moments J₃ ≤ J₁ + J₂.

    Principal axes stay; negative moments may stay negative.
    """
    moments, axes = np.linalg.eigh((inertia + inertia.T) / 2)
    excess = max(moments[2] - moments[0] - moments[1], 0.0)
    if excess == 0.0:
        return inertia
    fixed: Array = (axes * (moments + excess / 3 * np.array([1.0, 1.0, -1.0]))) @ axes.T
    return (fixed + fixed.T) / 2


def _fixed(bodies: list[MergedLinks]) -> list[str]:
    remarks = []
    for body in bodies:
        before = body.inertial.inertia
        if body.flexible or (after := least_change(before)) is before or is_possible(before):
            continue
        body.inertial = replace(body.inertial, inertia=after)
        then, now = (", ".join(f"{moment:.6g}" for moment in np.linalg.eigvalsh(J)) for J in (before, after))
        share = np.linalg.norm(after - before) / np.linalg.norm(before)
        remarks.append(
            f"{body.label}: principal moments of inertia {then} kg m², which no body has, are now {now}: changed by"
            f" {100 * share:.2g} %, the least that makes them possible"
        )
    return remarks


def is_possible(inertia: Array) -> bool:
    """Whether no principal moment of an inertia (3, 3), kg·m², exceeds the sum of the others beyond round-off."""
    moments = np.linalg.eigvalsh(inertia)
    return bool(moments[2] <= moments[0] + moments[1] + ROUND_OFF * np.abs(inertia).max())


def _wrong_inertias(bodies: list[MergedLinks]) -> Iterator[str]:
    for body in bodies:
        if body.flexible:
            continue
        J = body.inertial.inertia
        try:
            xx, yy, zz = map(three, J)
            check_inertia((xx, yy, zz))
        except ValueError as error:
            least, _, largest = np.linalg.eigvalsh(least_change(J))
            is_mended = not is_possible(J) and least >= -ROUND_OFF * largest
            way = ": --fix-inertia makes the least change" if is_mended else ""
            yield f"{body.label}: <inertia>: {error}{way}"


GRAVITY = [0.0, 0.0, -9.81]
SCENE_TYPE = {"continuous": "revolute", "floating": "free", "fixed": "weld"}  # others have the same name
SINGLE = WITH_AXIS[:3]  # types with one coordinate
ORIGIN = "origin"  # point of a rigid body where the joint that carries it is


class SceneOfRobot:
    """Scene made from a URDF: `keys` of the file, and `remarks` on losses.

    `flexible`: flexible links by name. `meshes`: files relative to the folder of the scene, by their names in the
    URDF. `fix_inertia`: whether to correct impossible inertias by `least_change`.

    Raises:
        InputError: a moving body has no mass but carries others, or has an impossible inertia.
    """

    def __init__(
        self, robot: Robot, flexible: Mapping[str, ImportedLink], meshes: Mapping[str, str], *, fix_inertia: bool
    ) -> None:
        self.robot, self.flexible, self.meshes = robot, flexible, meshes
        places = {name: link.place for name, link in flexible.items()}
        merged, self.carrying, self.body_of, left_out = _mechanism(robot, places, fix_inertia)
        self.remarks = [*robot.remarks, *left_out]
        self.bodies, self.joints = Names((GROUND,)), Names()
        self.points = {body.top: Names((ORIGIN,)) for body in merged}
        joints = [self._joint(joint) for joint in self.carrying]  # first: they name points
        self.keys: dict[str, Any] = {
            "name": " ".join("".join(c if c.isprintable() else " " for c in robot.name).split())[:100] or "robot",
            "space": "spatial",
            "gravity": GRAVITY,
            "body": [self._body(body) for body in merged],
            "joint": joints,
        }
        if tools := [self._tool(body, link) for body in merged for link in self._tools(body)]:
            self.keys["tool"] = tools
        if still := [name for name in robot.links if self.body_of[name].stands_still]:
            mass = sum(inertial.mass for name in still if (inertial := robot.links[name].inertial) is not None)
            said = "are fixed to the ground and are" if len(still) > 1 else "is fixed to the ground and is"
            self.remarks.append(f"{quoted(map(shown, still))} (mass {mass:g} kg) {said} no body of the scene")
        changed = self.bodies.changed | self.joints.changed
        self.remarks += [f'"{shown(old)}" is called "{new}" in the scene' for old, new in changed.items()]

    def _body(self, body: MergedLinks) -> dict[str, Any]:
        name = self.bodies[body.top]
        if body.flexible:
            return {"name": name, "link": self.flexible[body.top].file_name}
        points = {ORIGIN: [0.0, 0.0, 0.0]}
        of_body = self.points[body.top]
        for joint in self.carrying:
            if self.body_of[joint.parent] is body:
                points[of_body[joint.name]] = _numbers((body.members[joint.parent] @ joint.origin.place).d)
        for link, place in body.members.items():  # frames of tools and sensors keep their names
            if link != body.top and link not in self._tools(body):
                points[self._frame(body, link)] = _numbers(place.d)
        J = (body.inertial.inertia + body.inertial.inertia.T) / 2  # symmetric to the last digit
        is_principal = not np.any(J - np.diag(np.diag(J)))
        rigid = {
            "mass": body.inertial.mass,
            "center": _numbers(body.inertial.center),
            "inertia": _numbers(np.diag(J)) if is_principal else [_numbers(row) for row in J],
            "points": points,
        }
        if visuals := list(self._visuals(body)):
            rigid["visual"] = visuals
        return {"name": name, "rigid": rigid}

    def _tools(self, body: MergedLinks) -> list[str]:
        """Links at ends of fixed joints of a rigid body that carries no other: frames with other axes."""
        carries = any(self.body_of[joint.parent] is body for joint in self.carrying)
        if carries or body.flexible or body.stands_still:
            return []
        return [
            link
            for link, place in body.members.items()
            if link != body.top and not self.robot.joints_of(link) and not np.array_equal(place.C, np.eye(3))
        ]

    def _frame(self, body: MergedLinks, link: str) -> str:
        return self.points[body.top][f"link {link}" if link in self.robot.joints else link]

    def _tool(self, body: MergedLinks, link: str) -> dict[str, Any]:
        place, name = body.members[link], self._frame(body, link)
        point = f"{self.bodies[body.top]}.{ORIGIN}"
        return {"name": name, "point": point, "at": _numbers(place.d), "rpy": rpy_of(place.C)}

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
        parent, child = (self.body_of[link] for link in (joint.parent, joint.child))
        place = parent.members[joint.parent] @ joint.origin.place
        keys: dict[str, Any] = {"name": self.joints[joint.name], "type": SCENE_TYPE.get(joint.type, joint.type)}
        keys["between"] = [GROUND, f"{self.bodies[child.top]}.{'root' if child.flexible else ORIGIN}"]
        if not parent.stands_still:
            name, top = joint.name, parent.top
            point = self.flexible[top].point_of[name] if parent.flexible else self.points[top][name]
            keys["between"][0] = f"{self.bodies[top]}.{point}"
        elif np.any(place.d):
            keys["at"] = _numbers(place.d)
        if joint.type in WITH_AXIS:
            keys["axis"] = _numbers(place.C @ np.array(joint.axis))
        # The URDF's own numbers where nothing is merged in between.
        is_plain = parent.members[joint.parent] is HERE and child.members[joint.child] is HERE
        rpy = list(joint.origin.rpy) if is_plain else rpy_of(place.C @ child.members[joint.child].C.T)
        if any(rpy):
            keys["rpy"] = rpy
        self._remark_on_mimic(joint)
        return keys | self._limits(joint) | self._friction(joint)

    def _limits(self, joint: UrdfJoint) -> dict[str, Any]:
        keys: dict[str, Any] = {}
        label, limits = joint.label, dict(joint.limits)
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
        leader = self.robot.joints[mimic.joint]
        if leader.type == "fixed":
            means = f", which is fixed: its position is {mimic.offset:g}; give it a trajectory of that value"
        elif leader not in self.carrying:
            means = ", which is left out: give it its own trajectory"
        else:
            means = (
                f": give it a separate trajectory, {mimic.multiplier:g} times that one plus {mimic.offset:g}; the motor"
                f" of that one then has to supply {mimic.multiplier:g} times this one's torque in addition to its own"
            )
        self.remarks.append(f'{joint.label} follows "{shown(mimic.joint)}"{means}')

    def _friction(self, joint: UrdfJoint) -> dict[str, Any]:
        keys: dict[str, Any] = {}
        for key, ours in (("damping", "viscous_friction"), ("friction", "coulomb_friction")):
            value = joint.dynamics.get(key, 0.0)
            label = f"{joint.label}: {key} {value:g} left out"
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
