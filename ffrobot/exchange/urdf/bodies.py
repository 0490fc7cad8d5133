"""From links and joints of a URDF to bodies: links that fixed joints hold together are one, the root stands still."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...common.arrays import Array, as_rows
from ...common.errors import InputError, quoted
from ...common.tables import shown
from ...mbs.scene.bodies import ROUND_OFF, check_inertia
from .robot import HERE, MASSLESS, Inertial, Place, Robot, UrdfJoint


@dataclass(eq=False)
class MergedLinks:
    """Links that move as one: `top` carries the others; the body has its axes, unless it is flexible."""

    top: str  # name of the link
    stands_still: bool = False  # whether it is the ground
    flexible: bool = False  # whether a link file says what it is; then it has no other member
    members: dict[str, Place] = field(default_factory=dict)  # links, and where they stand in the body's axes
    inertial: Inertial = MASSLESS  # of all of them

    def add(self, robot: Robot, link: str, place: Place) -> None:
        """Merge one link into the body."""
        self.members[link] = place
        if (inertial := robot.links[link].inertial) is not None:
            self.inertial = self.inertial + inertial.seen_from(place)

    @property
    def weighs(self) -> bool:
        """Whether it has mass."""
        return self.flexible or self.inertial.mass > 0

    @property
    def label(self) -> str:
        """Name of the link, with those fixed to it, for messages."""
        fixed = [name for name in self.members if name != self.top]
        return f'link "{shown(self.top)}"' + (f" with {quoted(fixed)} fixed to it" if fixed else "")


@dataclass(frozen=True)
class Mechanism:
    """Bodies in the order in which joints carry them, and these joints, each from one body to the next.

    `body_of` has the body of each link; `remarks` say what was left out.
    """

    bodies: tuple[MergedLinks, ...]
    joints: tuple[UrdfJoint, ...]
    body_of: Mapping[str, MergedLinks]
    remarks: tuple[str, ...]


def mechanism(robot: Robot, flexible: Mapping[str, Place], *, fix_inertia: bool = False) -> Mechanism:
    """The bodies of a robot.

    Args:
        robot: as read.
        flexible: links that shall be flexible, and where their URDF frame stands in the axes of the link file.
        fix_inertia: whether principal moments that no body has are changed, as little as can be; see `least_change`.

    Raises:
        InputError: a body that moves has no mass but carries others, or an inertia that no body has.
    """
    ground = MergedLinks(robot.root, stands_still=True)
    bodies, joints, body_of = [ground], list[UrdfJoint](), dict[str, MergedLinks]()
    if robot.root in flexible:
        joints.append(UrdfJoint(f"{robot.root}_fixed", "fixed", "", robot.root))  # the parent is no link
        bodies.append(_start(robot, robot.root, flexible, body_of))
    else:
        ground.add(robot, robot.root, HERE)
        body_of[robot.root] = ground
    for joint in _outward(robot):
        parent = body_of[joint.parent]
        if joint.type == "fixed" and not parent.flexible and joint.child not in flexible:
            parent.add(robot, joint.child, parent.members[joint.parent] @ joint.origin.place)
            body_of[joint.child] = parent
        else:
            joints.append(joint)
            bodies.append(_start(robot, joint.child, flexible, body_of))
    kept, carried, remarks = _with_mass(bodies, joints, body_of)
    if not kept:
        if any(link.inertial is not None and link.inertial.mass > 0 for link in robot.links.values()):
            raise InputError(f'expected a link with mass that moves on "{shown(robot.root)}"', "none")
        raise InputError(
            "expected links with mass",
            "no <inertial> with one in the whole file: it was made for viewers. Add <inertial> to its links, from CAD"
            " or a data sheet, take a description of the robot for dynamics, or estimate masses by --density",
        )
    remarks += _fixed(kept) if fix_inertia else []
    _check_inertias(kept)
    return Mechanism(tuple(kept), tuple(carried), body_of, tuple(remarks))


def _start(robot: Robot, link: str, flexible: Mapping[str, Place], body_of: dict[str, MergedLinks]) -> MergedLinks:
    body = MergedLinks(link, flexible=link in flexible)
    body.add(robot, link, flexible.get(link, HERE))
    body_of[link] = body
    return body


def _outward(robot: Robot) -> list[UrdfJoint]:
    """All joints, those nearer the root first, else in the order of the file."""
    joints = robot.joints_of(robot.root)
    for joint in joints:  # which grows
        joints += robot.joints_of(joint.child)
    return joints


def _with_mass(
    bodies: list[MergedLinks], joints: list[UrdfJoint], body_of: Mapping[str, MergedLinks]
) -> tuple[list[MergedLinks], list[UrdfJoint], list[str]]:
    """Without bodies beyond which nothing has mass: frames of tools and sensors on joints of their own."""
    below = {body for body in bodies if body.weighs}
    for joint in reversed(joints):
        if joint.parent in body_of and body_of[joint.child] in below:
            below.add(body_of[joint.parent])
    kept = [body for body in bodies if not body.stands_still and body in below]
    bare = [body for body in kept if not body.weighs]
    if bare:
        raise InputError(
            "\n".join(
                f"{body.label}: expected a mass of a body that moves and carries others, found none: give it an"
                " <inertial>, make the joint that carries it fixed, or estimate masses by --density"
                for body in bare
            )
        )
    remarks = [
        f'joint "{shown(joint.name)}" and link "{shown(joint.child)}" left out: nothing there has mass'
        for joint in joints
        if body_of[joint.child] not in below
    ]
    return kept, [joint for joint in joints if body_of[joint.child] in below], remarks


def least_change(inertia: Array) -> Array:
    """The inertia (3, 3) nearest to `inertia`, in the sense of Frobenius, of which no principal moment is too large.

    Principal axes stay. With d = J₃ − J₁ − J₂ > 0 it is the projection on the plane J₃ = J₁ + J₂: J₁ + d/3, J₂ + d/3,
    J₃ − d/3. Moments that are not positive stay so, unless d/3 makes them.
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
    """Whether no principal moment is larger than the sum of the others, but for round-off."""
    moments = np.linalg.eigvalsh(inertia)
    return bool(moments[2] <= moments[0] + moments[1] + ROUND_OFF * np.abs(inertia).max())


def _check_inertias(bodies: list[MergedLinks]) -> None:
    errors = []
    for body in bodies:
        if body.flexible:
            continue
        try:
            xx, yy, zz = (tuple(row) for row in as_rows(body.inertial.inertia))
            check_inertia((xx, yy, zz))
        except ValueError as error:
            least, _, largest = np.linalg.eigvalsh(least_change(body.inertial.inertia))
            is_mended = not is_possible(body.inertial.inertia) and least >= -ROUND_OFF * largest
            way = ": --fix-inertia makes the least change" if is_mended else ""
            errors.append(f"{body.label}: <inertia>: {error}{way}")
    if errors:
        raise InputError("\n".join(errors))
