"""Link files of flexible links of a robot: axes, lengths, and positions of joints.

The x axis of the link goes from the joint that carries it to the one beyond (the farthest, if there are several); z is
along the axis of the carrying joint as far as that is square to x, so that "in-plane" is the plane in which it swings.
"""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError, did_you_mean
from ...common.rotations import unit
from ...common.structs import struct
from ...common.tables import shown
from ...common.toml_files import load_toml
from ...fe_models.link_file import read_link
from ...fe_models.link_source import LinkTable
from ...mesh.checks import METRES
from ...mesh.inspection import inspect_part
from .robot import Names, Place, Robot, UrdfJoint

ON_AXIS = 1e-6  # of the length: how far a joint may be off the axis of a beam
SQUARE = 1e-3  # least sine between x and the axis of the joint for a plane of swing


@struct
class ImportedLink:
    """A link of the URDF that a link file describes; its interface "root" is at the carrying joint."""

    name: str
    file_name: str  # of the new link file next to the scene
    place: Place  # pose of the URDF's link frame in axes of the link file
    keys: Mapping[str, Any]  # content of the link file
    table: LinkTable  # the same as a source of links, before the file exists
    point_of: Mapping[str, str]  # interface of each joint that the link carries, by joint
    remarks: tuple[str, ...]  # on values taken from the URDF or the part


def flexible_link(robot: Robot, name: str, source: Path, folder: Path, stem: str) -> ImportedLink:
    """Return the URDF's link `name` by the link file `source`; its new file is to be `folder`/`stem`.toml.

    Raises `InputError` where the link file contradicts the URDF.
    """
    if name not in robot.links:
        known = did_you_mean(name, robot.links)
        raise InputError(f"--flexible {shown(name)}: expected a link of the URDF", f"none of this name{known}")
    keys = load_toml(source, "link file")
    geometry = keys.get("geometry")
    if not isinstance(geometry, dict):
        raise InputError(f"{source}: expected a link file", "no [geometry]")
    beyond = robot.joints_of(name)
    tip = max(beyond, key=lambda joint: joint.way, default=None)
    axes, remarks = _axes(robot, name, tip), list[str]()
    place = Place(np.zeros(3), axes.T)
    length = _set_length(geometry, tip, name, source, remarks)
    keys["name"] = str(keys.get("name", stem))
    part = None
    if isinstance(file := geometry.get("file"), str):
        part = (source.parent / file).resolve()
        geometry["file"] = str(part)
        if not {"origin", "x_axis", "y_axis"} & set(geometry):
            geometry["x_axis"], geometry["y_axis"] = axes[:, 0].tolist(), axes[:, 1].tolist()
            remarks.append(f"{file} is taken to be drawn in the axes of the URDF's link")
    point_of = _interfaces(keys, beyond, tip, place, length, f"{source}: link {shown(name)}")
    if part is not None:
        remarks += _in_bores(keys, part, _axes_of_joints(robot, name, point_of, place), length)
    file_name = f"{stem}.toml"
    table = LinkTable(keys | {"geometry": dict(geometry)}, folder / file_name)
    read_link(table)
    if part is not None:
        geometry["file"] = os.path.relpath(part, folder.resolve())
    return ImportedLink(name, file_name, place, keys, table, point_of=point_of, remarks=tuple(remarks))


def _axes(robot: Robot, name: str, tip: UrdfJoint | None) -> Array:
    """(3, 3) axes of the link file, columns, in those of the URDF's link; the same if it carries no joint."""
    if tip is None or not any(tip.origin.xyz):
        return np.eye(3)
    x = unit(np.array(tip.origin.xyz))
    carrying = next((joint.axis for joint in robot.joints.values() if joint.child == name), (0.0, 0.0, 1.0))
    for along in (np.array(carrying), tip.origin.place.C @ np.array(tip.axis), np.eye(3)[np.abs(x).argmin()]):
        across = unit(along) - (unit(along) @ x) * x
        if np.linalg.norm(across) > SQUARE:
            break
    z = unit(across)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _set_length(geometry: dict[str, Any], tip: UrdfJoint | None, name: str, source: Path, remarks: list[str]) -> float:
    """Length in the file, which must be the distance of the joints; by default that distance."""
    given = geometry.get("length")
    if tip is None:
        if not isinstance(given, int | float):
            raise InputError(
                f'{source}: geometry.length: expected it of "{shown(name)}", which carries no further joint'
            )
        return float(given)
    wanted, distance = tip.way, f"{tip.way:.9g} m, the distance to {tip.label}"
    if given is None:
        geometry["length"] = wanted
        remarks.append(f"length {distance}")
    elif not isinstance(given, int | float) or abs(given - wanted) > 1e-6 * wanted:  # relative
        raise InputError(f"{source}: geometry.length: expected {distance}, or no such key", f"{given!r}")
    return wanted


def _interfaces(
    keys: dict[str, Any], beyond: list[UrdfJoint], tip: UrdfJoint | None, place: Place, length: float, label: str
) -> dict[str, str]:
    """Write an interface for each joint beyond that is at neither end and not in the file; returns all by joint."""
    tables = list(keys.get("interface", ()))
    taken = [str(table.get("name")) for table in tables if isinstance(table, dict)]
    names, point_of = Names(("root", "tip")), dict[str, str]()
    for joint in beyond:
        x = place.C @ np.array(joint.origin.xyz)
        if joint is tip or np.linalg.norm(x - [length, 0.0, 0.0]) <= ON_AXIS * length:
            point_of[joint.name] = "tip"
        elif np.linalg.norm(x) <= ON_AXIS * length:
            point_of[joint.name] = "root"
        else:
            point_of[joint.name] = point = names[joint.name]
            if point in taken:
                continue
            position: float | list[float] = x.tolist()  # of a solid, whose nearest face is taken
            if keys["geometry"].get("kind", "beam") != "solid":
                position, off = float(x[0]), float(np.linalg.norm(x[1:]))
                if off > ON_AXIS * length or not 0 < x[0] < length:
                    raise InputError(
                        f'{label}: joint "{joint.name}": expected a joint on the line between the ends of the beam',
                        f"it {off:.4g} m off, at {x[0]:.4g} m of {length:.4g} m: take a solid, or split the link in"
                        " the URDF",
                    )
            tables.append({"name": point, "position": position})
    if tables:
        keys["interface"] = tables
    return point_of


@struct
class JointAxis:
    """A joint on a link: `point` (3,), m, and `direction` (3,) of any length, in axes of the link file."""

    name: str
    point: Array
    direction: Array


def _axes_of_joints(robot: Robot, name: str, point_of: Mapping[str, str], place: Place) -> dict[str, JointAxis]:
    axes = dict[str, JointAxis]()
    for joint in robot.joints.values():
        if joint.type not in ("revolute", "continuous"):
            continue
        if joint.child == name:
            axes["root"] = JointAxis(joint.name, place.d, place.C @ np.array(joint.axis))
        elif joint.parent == name:
            at = place @ joint.origin.place
            axes.setdefault(point_of[joint.name], JointAxis(joint.name, at.d, at.C @ np.array(joint.axis)))
    return axes


def _in_bores(keys: dict[str, Any], part: Path, joints: Mapping[str, JointAxis], length: float) -> list[str]:
    """Make bores the interfaces of joints without a table in the link file; returns remarks."""
    tables = [table for table in keys.get("interface", ()) if isinstance(table, dict)]
    own = {
        table.get("name")
        for table in tables
        if "normal" in table or "group" in table or table.get("name") in ("root", "tip")
    }
    wanted = {name: joint for name, joint in joints.items() if name not in own}
    bores = list(_bores_at(keys["geometry"], part, wanted, length)) if wanted else []
    if bores:
        matched = {table["name"]: table for table, _ in bores}
        keys["interface"] = [*matched.values(), *(table for table in tables if table.get("name") not in matched)]
    return [remark for _, remark in bores]


PARALLEL = 1e-4  # 1 − cosine between the axes of a bore and of its joint
CONCENTRIC = 0.05  # of the radius: how far the joint may be from the axis of the bore
CENTERED = 1e-6  # of the length: distance of a bore's center from its joint without a remark


def _bores_at(
    geometry: Mapping[str, Any], part: Path, joints: Mapping[str, JointAxis], length: float
) -> Iterator[tuple[dict[str, Any], str]]:
    """A table `interface` with the nearest bore of `part`, and a remark, for each of `joints` (by interface) in one.

    `geometry`: pose of the part in the link's axes.
    """
    meters = geometry.get("unit", "m")
    faces = inspect_part(part, meters).faces
    x = unit(np.array(geometry.get("x_axis", (1.0, 0.0, 0.0)), dtype=float))
    z = unit(np.cross(x, geometry.get("y_axis", (0.0, 1.0, 0.0))))
    C = np.stack([x, np.cross(z, x), z])
    origin = METRES[meters] * np.array(geometry.get("origin", (0.0, 0.0, 0.0)))
    bores = [(face, C @ (face.center - origin), C @ face.direction) for face in faces if face.kind == "bore"]
    for interface, joint in joints.items():
        axis, around = unit(joint.direction), []
        for face, center, direction in bores:
            way = joint.point - center
            across = float(np.linalg.norm(way - (way @ direction) * direction))
            if 1 - abs(float(direction @ axis)) < PARALLEL and across < CONCENTRIC * (face.radius or 0.0):
                around.append((abs(float(way @ axis)), face, center, direction))
        if not around:
            continue
        off, face, center, direction = min(around, key=lambda bore: bore[0])
        more = f", whose center is {1000 * off:.4g} mm along the axis from the joint" if off > CENTERED * length else ""
        yield (
            {"name": interface, "position": center.tolist(), "normal": direction.tolist()},
            f'joint "{shown(joint.name)}" is in a bore of radius {1000 * (face.radius or 0.0):.4g} mm{more}',
        )
