"""`ffrobot import ROBOT.urdf -o DIR`: from a URDF to a scene in space, with link files of flexible links."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...common.errors import InputError, of_file
from ...common.files import check_folder, write_atomically
from ...common.tables import beyond_limits
from .bodies import mechanism
from .flexible import FlexibleLink, flexible_link
from .meshes import MeshMass, mesh_masses, mesh_path
from .names import Names, toml_text
from .read import read_urdf
from .replaced import compared, remarks_on_scale
from .robot import MeshFile, Robot
from .scene import SceneOfRobot
from .shape_masses import Filling, with_masses, without_mass

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


@dataclass(frozen=True)
class Imported:
    """What an import made.

    Attributes:
        robot: as read.
        scene: keys of the scene file.
        flexible: links from link files.
        remarks: on what is left out, renamed or odd, a line each.
        masses: what meshes say.
        files: all that were written.
    """

    robot: Robot
    scene: Mapping[str, Any]
    flexible: tuple[FlexibleLink, ...]
    remarks: tuple[str, ...]
    masses: tuple[MeshMass, ...]
    files: tuple[Path, ...]


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
        urdf: the robot.
        folder: DIR.
        flexible: link files by link.
        force: replace files that are there.
        fix_inertia: see `bodies.mechanism`.
        filling: fills the shapes of links without mass; None leaves them massless.
        keep_rest: what a link of the URDF weighs beyond its flexible link becomes a payload on that one.

    Raises:
        InputError: wrong input, or files that would be replaced without `force`.
        SolveError: a file cannot be written.
    """
    with of_file(urdf):
        robot, remarks = read_urdf(urdf), list[str]()
        if filling is not None:
            robot, remarks = with_masses(robot, urdf, filling)
        remarks += without_mass(robot)
        stems = Names([Path(SCENE).stem])
        links = {name: flexible_link(robot, name, source, folder, stems[name]) for name, source in flexible.items()}
        scene = _scene(urdf, robot, links, folder, fix_inertia=fix_inertia)
        masses, about_meshes = mesh_masses(robot, urdf)
        remarks += [*scene.remarks, *_remarks_on_links(links)]
        payloads, about_rest = _compared(robot, links, folder, scene, keep_rest=keep_rest)
        keys = {**scene.keys, **({"payload": payloads} if payloads else {})}
        remarks += [*about_rest, *about_meshes, *remarks_on_scale(robot)]
        files = {SCENE: _scene_text(urdf, keys, remarks)}
        files |= {link.file_name: _link_text(urdf, link) for link in links.values()}
        written = _write(folder, files, force=force)
        return Imported(robot, keys, tuple(links.values()), tuple(remarks), tuple(masses), written)


def _scene(
    urdf: Path, robot: Robot, links: Mapping[str, FlexibleLink], folder: Path, *, fix_inertia: bool
) -> SceneOfRobot:
    try:
        places = {name: link.place for name, link in links.items()}
        scene = SceneOfRobot(
            robot, mechanism(robot, places, fix_inertia=fix_inertia), links, _meshes(robot, urdf, folder)
        )
    except InputError as error:
        raise InputError("\n".join(f"{urdf}: {line}" for line in str(error).splitlines())) from None
    if beyond := list(beyond_limits(dict(scene.keys))):
        raise InputError("\n".join(f"{urdf}: {line}" for line in beyond))
    return scene


def _meshes(robot: Robot, urdf: Path, folder: Path) -> dict[str, str]:
    """Files of meshes to be seen that are there, from `folder` on, by the names that the URDF has for them."""
    shapes = (shape for link in robot.links.values() for shape in link.visual)
    names = dict.fromkeys(shape.filename for shape in shapes if isinstance(shape, MeshFile))
    found = ((name, mesh_path(name, urdf)) for name in names)
    return {name: os.path.relpath(path, folder.resolve()) for name, path in found if path is not None}


def _compared(
    robot: Robot, links: Mapping[str, FlexibleLink], folder: Path, scene: SceneOfRobot, *, keep_rest: bool
) -> tuple[list[dict[str, Any]], list[str]]:
    """Payloads that make up for what flexible links lack of the URDF's masses, and remarks on what they replace."""
    payloads, remarks = [], list[str]()
    for link in links.values():
        payload, about = compared(robot, link, folder, keep_rest=keep_rest)
        remarks += about
        if payload is not None:
            payloads.append(payload | {"point": f"{scene.bodies[link.name]}.{payload['point']}"})
    return payloads, remarks


def _remarks_on_links(links: Mapping[str, FlexibleLink]) -> Iterator[str]:
    for link in links.values():
        yield f'link "{link.name}" is flexible: {link.file_name} determines its inertia, not its <inertial>'
        yield from (f"{link.file_name}: {remark}" for remark in link.remarks)


def _scene_text(urdf: Path, keys: Mapping[str, Any], remarks: list[str]) -> str:
    head = [
        f"From {urdf.name} by `ffrobot import`. Each link is rigid, as its <inertial> says, unless it names a file.",
        *(f"* {remark}" for remark in remarks),
    ]
    joint = next((entry["name"] for entry in keys["joint"] if entry["type"] in ("revolute", "prismatic")), "JOINT")
    tail = TO_BE_APPENDED.format(joint=joint)
    return "\n".join(map(_comment, head)) + "\n\n" + toml_text(keys) + "\n" + tail


def _comment(text: str) -> str:
    """A comment of one line, whatever names in `text` hold."""
    return "# " + "".join(c if c.isprintable() else "_" for c in text)


def _link_text(urdf: Path, link: FlexibleLink) -> str:
    head = f'Link "{link.name}" of {urdf.name}: x from the joint that carries it to the next, y in its plane of swing.'
    return f"{_comment(head)}\n\n{toml_text(link.keys)}"


def _write(folder: Path, files: Mapping[str, str], *, force: bool) -> tuple[Path, ...]:
    check_folder(folder)
    paths = {folder / name: text for name, text in files.items()}
    if there := [path for path in paths if path.exists() and not force]:
        raise InputError(
            f"{there[0]}: output: expected a new name, found a file, which may have been edited since: take another"
            " folder, or --force"
        )
    for path, text in paths.items():
        write_atomically(path, text.encode(), "file", make_folder=True)
    return tuple(paths)
