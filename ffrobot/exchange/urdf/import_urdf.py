"""`ffrobot import ROBOT.urdf -o DIR`: from a URDF to a 3D scene, with link files of flexible links."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...common.errors import FfrobotError, InputError, naming, of_file, refuse
from ...common.files import check_folder, holds, write_atomically
from ...common.structs import struct
from ...common.tables import beyond_limits, shown
from ...common.toml_files import toml_text
from ...fe_models.link import cached_modal_body
from ...mbs.model.body import from_modal_body
from .flexible import ImportedLink, flexible_link
from .robot import MASSLESS, Inertial, MeshFile, Names, Robot, inertial_of, read_urdf
from .scene import SceneOfRobot, is_possible
from .shape_masses import Filling, mesh_masses, mesh_path, with_masses, without_mass

SAME = 1e-9  # relative: less is round-off


def _in_place_of(robot: Robot, link: ImportedLink, *, keep_rest: bool) -> tuple[dict[str, Any] | None, list[str]]:
    """Payload with the mass in excess of the flexible link, if it is to be kept; and remarks.

    Its `point` is without its body. It has mass m − m', first moment mc − m'c', and the difference of the inertias
    about the frame, taken to its center of mass; axes of the link file.
    """
    body = from_modal_body(link.name, cached_modal_body(link.table).body)
    inertial = robot.links[link.name].inertial
    before = MASSLESS if inertial is None else inertial.seen_from(link.place)
    after, label = inertial_of(body, np.zeros(3)), f'link "{shown(link.name)}"'
    told = f"{_words(before)} in the URDF" if before.mass else "the URDF has no mass for it"
    remarks = [f"{label}: {told}; now {_words(after)}"]
    mass = before.mass - after.mass
    if keep_rest and mass < -SAME * after.mass:
        raise InputError(
            f"--keep-rest: {label}: expected a link file with less mass than the URDF",
            f"{after.mass:.6g} kg of {before.mass:.6g} kg",
        )
    if not keep_rest or mass <= SAME * after.mass:
        return None, remarks
    rest = before + Inertial(-after.mass, after.center, -after.inertia)
    points = {name: point.position for name, point in body.points.items() if name != "mid"}
    nearest = min(points, key=lambda name: float(np.linalg.norm(points[name] - rest.center)))
    payload: dict[str, Any] = {"point": nearest, "mass": mass, "center": (rest.center - points[nearest]).tolist()}
    about = f'{label}: the rest, {mass:.6g} kg, is a payload on "{nearest}"'
    principal = np.linalg.eigvalsh(rest.inertia)
    if principal[0] >= 0 and is_possible(rest.inertia):
        payload["inertia"] = ((rest.inertia + rest.inertia.T) / 2).tolist()
    else:
        moments = ", ".join(f"{moment:.3g}" for moment in principal)
        about += f", as a point mass: its moments of inertia would be {moments} kg m², which no body has"
    return payload, [*remarks, about]


def _words(inertial: Inertial) -> str:
    center = ", ".join(f"{1000 * value:.4g}" for value in inertial.center)
    moments = ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(inertial.inertia))
    return f"{inertial.mass:.6g} kg, center ({center}) mm, principal moments {moments} kg m²"


LONGEST = 20.0  # m from joint to joint: arms of excavators and cranes have less
SHORTEST = 1e-3  # m, the whole robot
# Radius of gyration over the robot's reach. Links of the robots of example-robot-data lie between 2e-3 and 0.6;
# kg·cm² in place of kg·m² is a factor of 100, kg·mm² of 1000.
WIDEST, NARROWEST = 3.0, 1e-4
FAR, APART = 2.0, 10.0  # center of mass from its frame: times the distance of joints, and the radius of gyration
TURNS = 4 * np.pi  # rad: limits of joints that turn are within; a full turn in degrees is 360


def _remarks_on_scale(robot: Robot) -> Iterator[str]:
    joints = robot.joints.values()
    reach, longest = sum(joint.way for joint in joints), max(joints, key=lambda joint: joint.way, default=None)
    if longest is not None and longest.way > LONGEST:
        yield (
            f"{longest.label} is {longest.way:g} m from that of its parent: URDF is in meters; is this file in"
            " millimeters?"
        )
    for joint in joints:
        low, high = (joint.limits.get(key, 0.0) for key in ("lower", "upper"))
        if joint.type == "revolute" and max(abs(low), abs(high)) > TURNS:
            yield f"{joint.label}: limits {low:g} … {high:g} rad are many turns: are they in degrees?"
    if 0 < reach < SHORTEST:
        yield f"all joints are within {reach:g} m: URDF is in meters; is this file in kilometers?"
    for link in robot.links.values():
        if (part := link.inertial) is None or part.mass == 0 or reach == 0:
            continue
        label = f'link "{shown(link.name)}"'
        gyration = float(np.sqrt(np.abs(np.linalg.eigvalsh(part.inertia)).max() / part.mass))
        if not NARROWEST * reach <= gyration <= WIDEST * reach:
            yield (
                f"{label}: radius of gyration {gyration:.3g} m, in a robot whose joints span"
                f" {reach:.3g} m: URDF is in kg m²; is this inertia in another unit, or a placeholder?"
            )
        beside = [joint.way for joint in joints if link.name in (joint.parent, joint.child)]
        away = float(np.linalg.norm(part.center))
        if away > FAR * max(beside, default=np.inf) and away > APART * gyration:
            yield (
                f"{label}: its center of mass is {away:.3g} m from its frame, its inertia within {gyration:.3g} m: the"
                " <origin> of <inertial> is in axes of the link; is this one in those of the base?"
            )


SCENE = "scene.toml"
TO_BE_APPENDED = """\
# What is to be computed: a trajectory for each joint with a motor, or for a point, and an analysis, such as
#
# [[trajectory]]
# name = "{joint}"
# joint = "{joint}"
# value = "0.3*sin(t)"
#
# [[analysis]]
# name = "inverse"
# kind = "pcid"
# end = 1.0
# output_step = 0.01
# tolerance = 1e-6
"""


@struct
class Imported:
    """Result of an import of a URDF."""

    robot: Robot  # as read
    scene: Mapping[str, Any]  # keys of the scene file
    remarks: tuple[str, ...]  # on losses, new names and oddities, a line each
    masses: list[tuple[str, ...]]  # table of masses by meshes, with the columns `MASSES`
    files: tuple[Path, ...]  # written


def import_urdf(
    urdf: Path,
    folder: Path,
    flexible: Mapping[str, Path],
    *,
    force: bool = False,
    fix_inertia: bool = False,
    filling: Filling | None = None,
    keep_rest: bool = False,
) -> Imported:
    """Write DIR/scene.toml, and a link file for each link of `flexible`.

    Args:
        urdf: the URDF file.
        folder: DIR.
        flexible: link files by names of links.
        force: whether to replace existing files.
        fix_inertia: whether to correct impossible inertias, see `least_change`.
        filling: material of the shapes of links without mass; None leaves them massless.
        keep_rest: whether the mass of a URDF's link in excess of its flexible link becomes a payload of that link.

    Raises:
        InputError: wrong input, or existing files without `force`.
        SolveError: a file cannot be written.
    """
    with of_file(urdf):
        robot, remarks = read_urdf(urdf), list[str]()
        if filling is not None:
            robot, remarks = with_masses(robot, urdf, filling)
        remarks += without_mass(robot)
        stems = Names(["scene"])
        links = {name: flexible_link(robot, name, source, folder, stems[name]) for name, source in flexible.items()}
        shapes = (shape for link in robot.links.values() for shape in link.visual)
        paths = {shape.filename: mesh_path(shape.filename, urdf) for shape in shapes if isinstance(shape, MeshFile)}
        meshes = {name: os.path.relpath(path, folder.resolve()) for name, path in paths.items() if path is not None}
        with naming(urdf):
            scene = SceneOfRobot(robot, links, meshes, fix_inertia=fix_inertia)
            refuse(beyond_limits(dict(scene.keys)))
        masses, about_meshes = mesh_masses(robot, urdf)
        remarks += scene.remarks
        for link in links.values():
            about = f'link "{link.name}" is flexible: {link.file_name} determines its inertia, not its <inertial>'
            remarks += [about, *(f"{link.file_name}: {remark}" for remark in link.remarks)]
        payloads, about_rest = _compared(robot, links, scene, keep_rest=keep_rest)
        keys = scene.keys | ({"payload": payloads} if payloads else {})
        remarks += [*about_rest, *about_meshes, *_remarks_on_scale(robot)]
        files = {SCENE: _scene_text(urdf, keys, remarks)}
        for link in links.values():
            axes = "x from the joint that carries it to the next, y in its plane of swing"
            head = _comment(f'Link "{link.name}" of {urdf.name}: {axes}.')
            files[link.file_name] = f"{head}\n\n{toml_text(link.keys)}"
        return Imported(robot, keys, tuple(remarks), masses, _write(folder, files, force=force))


def _compared(
    robot: Robot, links: Mapping[str, ImportedLink], scene: SceneOfRobot, *, keep_rest: bool
) -> tuple[list[dict[str, Any]], list[str]]:
    payloads, remarks = [], list[str]()
    for link in links.values():
        try:
            payload, about = _in_place_of(robot, link, keep_rest=keep_rest)
        except FfrobotError as error:
            if keep_rest:
                raise
            remarks.append(f'link "{shown(link.name)}": not compared with its <inertial>: {error}')
            continue
        remarks += about
        if payload is not None:
            payloads.append(payload | {"point": f"{scene.bodies[link.name]}.{payload['point']}"})
    return payloads, remarks


def _scene_text(urdf: Path, keys: Mapping[str, Any], remarks: list[str]) -> str:
    head = f"From {urdf.name} by `ffrobot import`. Each link is rigid, as its <inertial> says, unless it names a file."
    lines = "\n".join(map(_comment, [head, *(f"* {remark}" for remark in remarks)]))
    joint = next((entry["name"] for entry in keys["joint"] if entry["type"] in ("revolute", "prismatic")), "JOINT")
    return f"{lines}\n\n{toml_text(keys)}\n{TO_BE_APPENDED.format(joint=joint)}"


def _comment(text: str) -> str:
    return "# " + "".join(c if c.isprintable() else "_" for c in text)


def _write(folder: Path, files: Mapping[str, str], *, force: bool) -> tuple[Path, ...]:
    check_folder(folder)
    if folder.suffix.lower() == ".toml" and not folder.exists():
        other = f"the name of a file: -o {folder.with_suffix('')}"
        raise InputError(f"{folder}: output: expected a folder for {SCENE}", other)
    paths = {folder / name: text.encode() for name, text in files.items()}
    if there := [path for path, text in paths.items() if path.exists() and not (force or holds(path, text))]:
        raise InputError(
            f"{there[0]}: output: expected a new name",
            "a file, which may have been edited since: take another folder, or --force",
        )
    for path, text in paths.items():
        write_atomically(path, text, "file", make_folder=True)
    return tuple(paths)
