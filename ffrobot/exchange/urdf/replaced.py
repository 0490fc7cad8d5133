"""What flexible links weigh beside the links of a URDF, and whether its numbers can be metres and kilograms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import FfrobotError, InputError
from ...common.tables import shown
from ...fe_models.link import cached_modal_body
from ...fe_models.link_file import LinkTable
from ...mbs.model.body import Body, from_modal_body
from .bodies import is_possible
from .flexible import FlexibleLink
from .robot import Inertial, Robot

SAME = 1e-9  # relative: less is round-off


class Replaced:
    """A link of the URDF, by its <inertial>, and the flexible link in its place, by stage 1; axes of the link file."""

    def __init__(self, robot: Robot, link: FlexibleLink, folder: Path) -> None:
        """The link file will be in `folder`, which need not be there yet. Raises what stage 1 raises."""
        self.name = link.name
        table = LinkTable(_with_whole_path(link.keys, folder), folder / link.file_name)
        self.body: Body = from_modal_body(link.name, cached_modal_body(table).body)
        inertial = robot.links[link.name].inertial
        self.before = None if inertial is None else inertial.seen_from(link.place)
        center = self.body.first_moment / self.body.mass
        self.after = Inertial(self.body.mass, center, self.body.inertia - _at(self.body.mass, center))

    def remark(self) -> str:
        """Mass, center and inertia before and after, a line."""
        if self.before is None or self.before.mass == 0:
            return f'link "{shown(self.name)}": the URDF has no mass for it; now {_words(self.after)}'
        return f'link "{shown(self.name)}": {_words(self.before)} in the URDF; now {_words(self.after)}'

    def rest(self) -> tuple[dict[str, Any] | None, list[str]]:
        """Keys of the payload that makes up for the difference, but `point` without its body; and remarks.

        It is what the URDF has beyond the flexible link: mass m − m', first moment mc − m'c', and the inertia about
        the frame less that of the link, taken to the center of the rest. None where nothing is left.

        Raises:
            InputError: the flexible link has more mass than that of the URDF.
        """
        before, after = self.before, self.after
        mass = (0.0 if before is None else before.mass) - after.mass
        if before is None or mass < -SAME * after.mass:
            raise InputError(
                f'--keep-rest: link "{shown(self.name)}": expected a link file with less mass than the URDF,'
                f" found {after.mass:.6g} kg of {0.0 if before is None else before.mass:.6g} kg"
            )
        if mass <= SAME * after.mass:
            return None, []
        rest = before + Inertial(-after.mass, after.center, -after.inertia)
        center, inertia = rest.center, rest.inertia
        points = {name: point.position for name, point in self.body.points.items() if name != "mid"}
        nearest = min(points, key=lambda name: float(np.linalg.norm(points[name] - center)))
        keys: dict[str, Any] = {"point": nearest, "mass": mass, "center": (center - points[nearest]).tolist()}
        about = f'link "{shown(self.name)}": the rest, {mass:.6g} kg, is a payload on "{nearest}"'
        if np.linalg.eigvalsh(inertia)[0] >= 0 and is_possible(inertia):
            symmetric = (inertia + inertia.T) / 2
            return keys | {"inertia": symmetric.tolist()}, [about]
        moments = ", ".join(f"{moment:.3g}" for moment in np.linalg.eigvalsh(inertia))
        return keys, [f"{about}, as a point mass: its moments of inertia would be {moments} kg m², which no body has"]


def compared(
    robot: Robot, link: FlexibleLink, folder: Path, *, keep_rest: bool
) -> tuple[dict[str, Any] | None, list[str]]:
    """Keys of the payload with the rest, where it is kept, and remarks.

    Raises:
        InputError: the rest shall be kept, and the link file is wrong or has too much mass.
        SolveError: the rest shall be kept, and stage 1 fails.
    """
    try:
        replaced = Replaced(robot, link, folder)
    except FfrobotError as error:
        if keep_rest:
            raise
        return None, [f'link "{shown(link.name)}": not compared with its <inertial>: {error}']
    payload, remarks = replaced.rest() if keep_rest else (None, [])
    return payload, [replaced.remark(), *remarks]


def _with_whole_path(keys: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    geometry = dict(keys["geometry"])
    if isinstance(file := geometry.get("file"), str):
        geometry["file"] = str((folder / file).resolve())
    return {**keys, "geometry": geometry}


def _at(mass: float, r: Array) -> Array:
    """Inertia (3, 3) of a point mass at r (3,) about the origin."""
    return as_floats(mass * (r @ r * np.eye(3) - np.outer(r, r)))


def _words(inertial: Inertial) -> str:
    center = ", ".join(f"{1000 * value:.4g}" for value in inertial.center)
    moments = ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(inertial.inertia))
    return f"{inertial.mass:.6g} kg, center ({center}) mm, principal moments {moments} kg m²"


LONGEST = 20.0  # m from joint to joint: arms of excavators and cranes have less
SHORTEST = 1e-3  # m, the whole robot
# Radius of gyration over the robot's reach. Links of the robots of example-robot-data lie between 2e-3 and 0.6;
# kg·cm² in place of kg·m² is a factor of 100, kg·mm² of 1000.
WIDEST, NARROWEST = 3.0, 1e-4
TURNS = 4 * np.pi  # rad: limits of joints that turn are within; a full turn in degrees is 360
ROTATION = 2 * np.pi  # rad: angles of frames are within


def remarks_on_scale(robot: Robot) -> Iterator[str]:
    """What looks like another unit, one line each."""
    ways = {joint.name: float(np.linalg.norm(joint.origin.xyz)) for joint in robot.joints.values()}
    reach = sum(ways.values())
    if ways and max(ways.values()) > LONGEST:
        name = max(ways, key=lambda key: ways[key])
        yield (
            f'joint "{shown(name)}" is {ways[name]:g} m from that of its parent: URDF is in metres; is this file in'
            " millimetres?"
        )
    for joint in robot.joints.values():
        label, limits = f'joint "{shown(joint.name)}"', [joint.limits.get(key, 0.0) for key in ("lower", "upper")]
        if joint.type == "revolute" and max(map(abs, limits)) > TURNS:
            yield f"{label}: limits {limits[0]:g} … {limits[1]:g} rad are many turns: are they in degrees?"
        if max(map(abs, joint.origin.rpy)) > ROTATION:
            yield f"{label}: rpy {' '.join(f'{angle:g}' for angle in joint.origin.rpy)} rad: is it in degrees?"
    if 0 < reach < SHORTEST:
        yield f"all joints are within {reach:g} m: URDF is in metres; is this file in kilometres?"
    for link in robot.links.values():
        if (part := link.inertial) is None or part.mass == 0 or reach == 0:
            continue
        gyration = float(np.sqrt(np.abs(np.linalg.eigvalsh(part.inertia)).max() / part.mass))
        if not NARROWEST * reach <= gyration <= WIDEST * reach:
            yield (
                f'link "{shown(link.name)}": radius of gyration {gyration:.3g} m, in a robot whose joints span'
                f" {reach:.3g} m: URDF is in kg m²; is this inertia in another unit, or a placeholder?"
            )
