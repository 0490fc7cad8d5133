"""`ffrobot export`, and `ffrobot import` of bodies and motions: formats of each kind of file, and writing."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from ..common.errors import InputError, check_known, either, naming, quoted
from ..common.files import check_new_file, check_new_folder, check_output, check_parent, holds, write_atomically
from ..common.tables import shown
from ..common.toml_files import read_text
from ..fe_models.modal_body import ModalBody
from ..fe_models.modal_body_file import FORMAT, is_modal_body_file, read_modal_body, write_modal_body
from ..present.lines import print_table
from .bodies.matrices import craig_bampton_file, exudyn_file
from .bodies.mbdyn import fem_text, read_fem
from .bodies.sid import read_sid, sid_text
from .fmu.forward_fmu import forward_fmu
from .fmu.linear_fmu import c_table, linear_fmu
from .motion import (
    TEXTS,
    JointMotions,
    Side,
    csv_text,
    joint_trajectory_bag,
    joint_trajectory_text,
    path_text,
    read_motion,
    robot_motion,
)
from .urdf.export_urdf import scene_as_urdf
from .urdf.import_urdf import Imported
from .urdf.shape_masses import MASSES

Content = str | bytes | Mapping[str, bytes]
"""Content of a file, or of the files of a folder by name."""


class Exported(NamedTuple):
    """Result of an export: the written file, `what` it contains in words, and remarks on losses."""

    path: Path
    what: str
    remarks: tuple[str, ...]


Converted = tuple[Content, tuple[str, ...]]
"""A content, and remarks on what it lacks."""
Made = tuple[Content, str, tuple[str, ...], str]
"""Content of a file, a summary, remarks, and its analysis ("" of none)."""


def _motion(convert: Callable[[JointMotions], Converted], what: str, *of: Any) -> Made:
    motion = robot_motion(*of)
    content, remarks = convert(motion)
    counted = what.format(joints=len(motion.joints), points=len(motion.time))
    return content, f"{counted} of {motion.analysis}", remarks, motion.analysis


def _body(convert: Callable[[ModalBody], Converted], path: Path, *_: Any) -> Made:
    body = read_modal_body(path)
    content, remarks = convert(body)
    return content, f"{body.name}, {body.modes_in_words}", remarks, ""


FORMATS: Mapping[str, Mapping[str, tuple[str, Callable[[Path, str | None, Side], Made]]]] = {
    "results": {
        "csv": (".csv", partial(_motion, csv_text, "{joints} joints")),
        "joint-trajectory": (".joint-trajectory.json", partial(_motion, joint_trajectory_text, "{points} points")),
        "rosbag2": (".rosbag2", partial(_motion, joint_trajectory_bag, "a JointTrajectory with {points} points")),
        "fmu": (".fmu", lambda path, analysis, _: linear_fmu(path, analysis)),
        "c": (".h", lambda path, analysis, _: c_table(path, analysis)),
    },
    "a scene": {
        "urdf": (".urdf", lambda path, *_: (*scene_as_urdf(path), "")),
        "fmu": (".fmu", lambda path, analysis, _: forward_fmu(path, analysis)),
    },
    "a modal body": {
        "sid": (".SID_FEM", partial(_body, sid_text)),
        "mbdyn": (".fem", partial(_body, fem_text)),
        "craig-bampton": (".craig-bampton.npz", partial(_body, craig_bampton_file)),
        "exudyn": (".exudyn.npz", partial(_body, exudyn_file)),
    },
}
"""Formats of each kind of file: end of the new file's name, and the function that makes its content."""
SIDED = ("joint-trajectory", "rosbag2")
"""Formats with positions of one side of compliant gears."""


def export_file(
    path: Path,
    file_format: str,
    analysis: str | None,
    output: Path | None,
    *,
    force: bool = False,
    side: Side | None = None,
) -> Exported:
    """Write a scene, a modal body or a results file in another format (see `FORMATS`), by default next to it.

    `analysis`: default: the first with such content. `side`: side of compliant gears whose positions are written.

    Raises:
        InputError: wrong input, nothing to export, or an existing file without `force`.
        SolveError: the file cannot be written.
    """
    if not path.exists():
        raise InputError(f"{path}: expected a scene, a modal body or a results file", "no such file")
    kind = "a scene" if path.suffix.lower() == ".toml" else "a modal body" if is_modal_body_file(path) else "results"
    known = FORMATS[kind]
    check_known(file_format, known, f"{path}: --format: expected one of {quoted(known)} of {kind}")
    if analysis is not None and (kind == "a modal body" or file_format == "urdf"):
        raise InputError(f"{path}: --analysis: expected it with results and FMUs only", f"{kind} as {file_format}")
    if side is not None and file_format not in SIDED:
        raise InputError(f"{path}: --side: expected it with {either(SIDED)} only", file_format)
    suffix, make = known[file_format]
    if output is not None:
        check_parent(output)
    content, what, remarks, name = make(path, analysis, side or "motor")
    target = output or path.with_suffix(f".{name}{suffix}" if name else suffix)
    write_content(target, content, force=force)
    return Exported(target, what, remarks)


def write_content(target: Path, content: Content, *, force: bool) -> None:
    """Write `content` to a file or folder. Raises `InputError` if it has other content; `force` replaces a file."""
    if target.suffix == ".toml":
        raise InputError(f"{target}: output: expected no scene or link file", '".toml"')
    if isinstance(content, str | bytes):
        data = content.encode() if isinstance(content, str) else content
        check_new_file(target, replace=force or holds(target, data))
        write_atomically(target, data, "exported file")
        return
    if not all(holds(target / name, data) for name, data in content.items()):
        check_new_folder(target)
    for name, data in content.items():
        write_atomically(target / name, data, "exported file", make_folder=True)


READERS: Mapping[str, Callable[[str, str], tuple[ModalBody, tuple[str, ...]]]] = {
    ".sid_fem": read_sid,
    ".fem": read_fem,
}
"""Functions that read bodies of other programs, by the end of the file's name."""
MOTIONS = (*TEXTS, ".bag", ".db3", ".mcap")
"""Ends of files with motions of joints; a folder is a bag of ROS 2."""


def import_motion(path: Path, output: Path, *, force: bool = False) -> Exported:
    """Read a motion of joints (JointTrajectory or bag of ROS), and write its waypoints to `output` as CSV.

    Raises:
        InputError: `path` cannot be read or has no motion; `output` exists, without `force`.
        SolveError: `output` cannot be written, or `rosbags` is not installed.
    """
    motion = read_motion(path)
    write_content(output, path_text(motion), force=force)
    what = f"{len(motion.times)} points of {len(motion.columns)} joints over {np.ptp(motion.times):.6g} s"
    use = f'a [[trajectory]] with joint = "{shown(motion.columns[0])}" takes waypoints = "{output.name}"'
    return Exported(output, what, (*motion.remarks, use))


def import_body(path: Path, output: Path) -> Exported:
    """Convert a flexible body of another program (SID_FEM, MBDyn) to a modal body file.

    Raises:
        InputError: `path` cannot be read, or its numbers are those of no body.
        SolveError: `output` cannot be written.
    """
    with naming(path), np.errstate(over="raise", divide="raise", invalid="raise"):
        try:
            body, remarks = READERS[path.suffix.lower()](read_text(path, "file of a flexible body"), path.stem)
        except (FloatingPointError, np.linalg.LinAlgError) as error:
            raise InputError("expected numbers of a body", f"ones that are too large: {error}") from None
    check_output(output, FORMAT)
    write_modal_body(output, body)
    return Exported(output, f"{body.name}, {body.modes_in_words}, interfaces {', '.join(body.interfaces)}", remarks)


UNITS = {"revolute": "rad", "prismatic": "m"}
LIMITS = ("moment_limit", "speed_limit", "viscous_friction", "coulomb_friction")


def print_import(imported: Imported, console: Console) -> None:
    """Print a summary line, tables of joints and meshes, remarks, and the files written."""
    robot, scene = imported.robot, imported.scene
    moving = [joint for joint in scene["joint"] if joint["type"] != "weld"]
    mass = sum(body["rigid"]["mass"] for body in scene["body"] if "rigid" in body)
    console.out(
        f"{robot.name}: {len(robot.links)} links and {len(robot.joints)} joints, of which {len(scene['body'])} bodies"
        f" and {len(moving)} joints move; {mass:.6g} kg in rigid bodies",
    )
    rows = []
    for joint in moving:
        low_high = joint.get("position_limit")
        span = f"{low_high[0]:.4g} … {low_high[1]:.4g} {UNITS[joint['type']]}" if low_high else "–"
        limits = (f"{joint[key]:.4g}" if key in joint else "–" for key in LIMITS)
        rows.append((joint["name"], joint["type"], span, *limits))
    headers = "joint", "type", "range", "moment or force", "speed", "damping", "friction"
    print_table(console, headers, rows)
    if imported.masses:
        print_table(console, MASSES, imported.masses)
        console.out(
            "note       meshes are skins: a filled one has the stiffness of no real casting; links are rigid unless"
            " --flexible names a file",
        )
    _print_written(imported.files, imported.remarks, console)


def print_export(exported: Exported, console: Console) -> None:
    """Print the file written, and remarks on what its format lacks."""
    _print_written([f"{exported.path}: {exported.what}"], exported.remarks, console)


def _print_written(files: Iterable[object], remarks: Iterable[str], console: Console) -> None:
    for remark in remarks:
        console.out(f"note       {remark}")
    for file in files:
        console.out(f"written    {file}")
