"""Motions as trajectory_msgs/JointTrajectory of ROS 2: JSON, or a rosbag2 by `rosbags` (extra "ros")."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import Array, as_list, as_rows
from ...common.errors import InputError, did_you_mean, quoted
from ...common.extras import extras
from ...common.tables import TableWriter
from ...results.file import Results


@dataclass(frozen=True, eq=False)
class JointMotion:
    """One coordinate of a joint over T outputs.

    Attributes:
        name: of the joint; "NAME[k]" of coordinate k where it has several.
        coordinate: (T,) rad, or m along a way.
        rate: (T,) rad/s or m/s.
        moment: (T,) N·m or N, at the joint, behind a gear; None of a joint without motor.
    """

    name: str
    coordinate: Array
    rate: Array
    moment: Array | None


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """The joints of an analysis with their coordinates, at `time` (T,) s; `remarks` say what to know of it."""

    analysis: str
    time: Array
    joints: tuple[JointMotion, ...]
    remarks: tuple[str, ...]


def robot_motion(path: Path, analysis: str | None) -> RobotMotion:
    """From the results file at `path`: of `analysis`, else of the first that has joints which move.

    Raises:
        InputError: there is no such analysis, or none of its joints moves.
    """
    with Results(path) as results:
        known = [name for name in results.analyses if any(_moving(results, name))]
        if analysis is not None and analysis not in results.analyses:
            raise InputError(
                f"{path}: --analysis: expected one of {quoted(results.analyses)}, found"
                f' "{analysis}"{did_you_mean(analysis, results.analyses)}'
            )
        if not known or analysis not in (None, *known):
            raise InputError(f"{path}: expected an analysis with joints that move, found none in {analysis or 'it'}")
        name = analysis or known[0]
        joints = tuple(part for joint in _moving(results, name) for part in _parts(results, name, joint))
        time = results.time(name)
        status = results.attributes(name)["status"]
    if status != "completed":
        return RobotMotion(name, time, joints, (f"{name} ended at t = {time[-1]:g} s: {status}",))
    return RobotMotion(name, time, joints, ())


def _moving(results: Results, analysis: str) -> Iterator[str]:
    """Joints that have a coordinate at each output, in the order of the scene."""
    names = [str(entry["name"]) for entry in results.scene.get("joint", ())]
    return (name for name in names if results.has(f"{analysis}/joints/{name}/coordinate"))


def _parts(results: Results, analysis: str, joint: str) -> Iterator[JointMotion]:
    group = f"{analysis}/joints/{joint}"
    outputs = len(results.time(analysis))
    coordinate, rate = (results[f"{group}/{key}"].reshape(outputs, -1).T for key in ("coordinate", "rate"))
    has_motor = results.has(f"{group}/moment")
    moment = results[f"{group}/moment"].reshape(outputs, -1).T if has_motor else [None] * len(coordinate)
    for k, values in enumerate(zip(coordinate, rate, moment, strict=True)):
        yield JointMotion(joint if len(coordinate) == 1 else f"{joint}[{k}]", *values)


def csv_text(motion: RobotMotion) -> str:
    """A table: `time`, then NAME.coordinate, NAME.rate and, with a motor, NAME.moment of every joint; SI units."""
    columns = {"time": motion.time}
    for joint in motion.joints:
        columns |= {f"{joint.name}.coordinate": joint.coordinate, f"{joint.name}.rate": joint.rate}
        if joint.moment is not None:
            columns[f"{joint.name}.moment"] = joint.moment
    text = io.StringIO()
    TableWriter(text).writerow(columns)
    lines = [",".join(map(repr, row)) for row in as_rows(np.stack(list(columns.values()), axis=1))]
    return text.getvalue() + "\n".join(lines) + "\n"


NANO = 1_000_000_000


def joint_trajectory(motion: RobotMotion) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The message, of joints with a motor; and remarks on what it leaves out.

    Accelerations stay empty, as the message allows: results have none of joints. Where no joint has a motor, all are
    taken, without effort.
    """
    driven = [joint for joint in motion.joints if joint.moment is not None]
    moments = [joint.moment for joint in motion.joints if joint.moment is not None]
    joints, left = driven or list(motion.joints), [joint.name for joint in motion.joints if joint.moment is None]
    remarks = list(motion.remarks)
    if driven and left:
        remarks.append(f"joints without motor left out: {', '.join(left)}")
    if not driven:
        remarks.append("no joint has a motor: effort is left empty")
    positions, velocities = (
        np.stack([getattr(joint, key) for joint in joints], axis=1) for key in ("coordinate", "rate")
    )
    efforts = np.stack(moments, axis=1) if moments else np.zeros((len(motion.time), 0))
    points = [
        {
            "positions": position,
            "velocities": velocity,
            "accelerations": [],
            "effort": effort,
            "time_from_start": _duration(time),
        }
        for position, velocity, effort, time in zip(
            as_rows(positions), as_rows(velocities), as_rows(efforts), as_list(motion.time), strict=True
        )
    ]
    message = {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": [joint.name for joint in joints],
        "points": points,
    }
    return message, tuple(remarks)


def joint_trajectory_text(motion: RobotMotion) -> tuple[str, tuple[str, ...]]:
    """The message as JSON, a line for each point; and remarks."""
    message, remarks = joint_trajectory(motion)
    points = ",\n".join(json.dumps(point) for point in message.pop("points"))
    head = json.dumps(message, ensure_ascii=False)
    return f'{head[:-1]}, "points": [\n{points}\n]}}\n', remarks


def _duration(time: float) -> dict[str, int]:
    """builtin_interfaces/Duration, to the nearest nanosecond."""
    sec, nanosec = divmod(round(time * NANO), NANO)
    return {"sec": sec, "nanosec": nanosec}


TOPIC = "/joint_trajectory"
TYPE = "trajectory_msgs/msg/JointTrajectory"
BAG = "joint_trajectory"  # name of the files in it
VERSION = 8  # of the metadata: what ROS 2 Iron and later write, and Humble reads


def joint_trajectory_bag(motion: RobotMotion) -> tuple[Mapping[str, bytes], tuple[str, ...]]:
    """Files of the bag by name, SQLite storage, with the message at time zero; and remarks.

    Raises:
        SolveError: `rosbags` is not installed.
    """
    with extras():
        from rosbags.rosbag2 import Writer
        from rosbags.typesys import Stores, get_typestore
    types = get_typestore(Stores.ROS2_HUMBLE)
    message, remarks = joint_trajectory(motion)
    with tempfile.TemporaryDirectory(prefix="ffrobot-bag-") as temporary:
        folder = Path(temporary) / BAG
        with Writer(folder, version=VERSION) as writer:
            connection = writer.add_connection(TOPIC, TYPE, typestore=types)
            writer.write(connection, 0, types.serialize_cdr(_ros(message, types.types), TYPE))
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}, remarks


def _ros(message: Mapping[str, Any], types: Mapping[str, Any]) -> Any:  # noqa: ANN401 (classes are made at run time)
    """The message as an object of ROS's class."""
    stamp = types["builtin_interfaces/msg/Time"](**message["header"]["stamp"])
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=message["header"]["frame_id"])
    points = [_point(point, types) for point in message["points"]]
    return types[TYPE](header=header, joint_names=message["joint_names"], points=points)


def _point(point: Mapping[str, Any], types: Mapping[str, Any]) -> Any:  # noqa: ANN401
    values = {key: np.array(point[key], dtype=float) for key in ("positions", "velocities", "accelerations", "effort")}
    since = types["builtin_interfaces/msg/Duration"](**point["time_from_start"])
    return types["trajectory_msgs/msg/JointTrajectoryPoint"](**values, time_from_start=since)
