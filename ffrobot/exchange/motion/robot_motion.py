"""Motions of results for other programs: tables, JointTrajectories, bags of ROS."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...common.arrays import Array, as_list, as_rows
from ...common.errors import InputError, check_known, quoted
from ...common.libraries import extras
from ...common.tables import as_csv
from ...results.file import Results

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
NANO = 1_000_000_000
OF_MOTOR = ("motor_coordinate", "motor_rate", "motor_moment")
"""Datasets of a joint whose gear is compliant."""
Side = Literal["motor", "joint"]
"""Of a compliant gear."""


@dataclass(frozen=True, eq=False)
class JointMotion:
    """One coordinate of a joint over T outputs."""

    name: str  # of the joint; "NAME[k]" of coordinate k where it has several
    coordinate: Array  # (T,) rad, or m along a way
    rate: Array  # (T,) rad/s or m/s
    moment: Array | None  # (T,) N·m or N, at the joint, behind a gear; None of a joint without motor
    # of a compliant gear, `motor_coordinate`, `motor_rate` and `motor_moment` (T,) as in results; else none
    motor: Mapping[str, Array] = field(default_factory=dict)

    def on(self, side: Side) -> tuple[Array, Array]:
        """Coordinate and rate behind a compliant gear, or of its motor, which are those of the joint without one."""
        if side == "motor" and self.motor:
            return self.motor["motor_coordinate"], self.motor["motor_rate"]
        return self.coordinate, self.rate


@dataclass(frozen=True, eq=False)
class JointMotions:
    """Joints of an analysis with their coordinates at `time` (T,), s; `remarks` on restrictions.

    `side`: of compliant gears, whose positions a JointTrajectory has.
    """

    analysis: str
    time: Array
    joints: tuple[JointMotion, ...]
    remarks: tuple[str, ...]
    side: Side = "motor"


def robot_motion(path: Path, analysis: str | None, side: Side = "motor") -> JointMotions:
    """Read joint motions from the results file at `path`; default: the first analysis with moving joints.

    Raises:
        InputError: there is no such analysis, or none of its joints moves.
    """
    with Results(path) as results:
        known = [name for name in results.analyses if any(_moving(results, name))]
        if analysis is not None:
            check_known(analysis, names := results.analyses, f"{path}: --analysis: expected one of {quoted(names)}")
        if not known or analysis not in (None, *known):
            raise InputError(f"{path}: expected an analysis with joints that move", f"none in {analysis or 'it'}")
        name = analysis or known[0]
        joints = tuple(part for joint in _moving(results, name) for part in _parts(results, name, joint))
        time, status = results.time(name), results.attributes(name)["status"]
    remarks = () if status == "completed" else (f"{name} ended at t = {time[-1]:g} s: {status}",)
    return JointMotions(name, time, joints, remarks, side)


def _moving(results: Results, analysis: str) -> Iterator[str]:
    names = [str(entry["name"]) for entry in results.scene.get("joint", ())]
    return (name for name in names if results.has(f"{analysis}/joints/{name}/coordinate"))


def _parts(results: Results, analysis: str, joint: str) -> Iterator[JointMotion]:
    group = f"{analysis}/joints/{joint}"
    coordinate, rate = (results.data(f"{group}/{key}").T for key in ("coordinate", "rate"))
    has_motor = results.has(f"{group}/moment")
    moment = results.data(f"{group}/moment").T if has_motor else [None] * len(coordinate)
    motor = {key: results[f"{group}/{key}"] for key in OF_MOTOR if results.has(f"{group}/{key}")}
    for k, values in enumerate(zip(coordinate, rate, moment, strict=True)):
        yield JointMotion(joint if len(coordinate) == 1 else f"{joint}[{k}]", *values, motor)


def csv_text(motion: JointMotions) -> str:
    """A table: `time`, then NAME.coordinate, NAME.rate and, with a motor, NAME.moment of every joint; SI units.

    Of joints with compliant gears also NAME.motor_coordinate, NAME.motor_rate, NAME.motor_moment.
    """
    columns = {"time": motion.time}
    for joint in motion.joints:
        columns |= {f"{joint.name}.coordinate": joint.coordinate, f"{joint.name}.rate": joint.rate}
        if joint.moment is not None:
            columns[f"{joint.name}.moment"] = joint.moment
        columns |= {f"{joint.name}.{key}": values for key, values in joint.motor.items()}
    return as_csv([columns, *as_rows(np.stack(list(columns.values()), axis=1))])


def joint_trajectory(motion: JointMotions) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a ROS JointTrajectory of the motor side of compliant gears, and remarks on what it leaves out.

    Accelerations stay empty, as the message allows: results have none of joints. Where no joint has a motor, all are
    taken, without effort.
    """
    moments = {joint.name: joint.moment for joint in motion.joints if joint.moment is not None}
    left = [joint.name for joint in motion.joints if joint.moment is None] if moments else []
    joints = [joint for joint in motion.joints if joint.name not in left]
    remarks = list(motion.remarks)
    if left:
        remarks.append(f"joints without motor left out: {', '.join(left)}")
    if not moments:
        remarks.append("no joint has a motor: effort is left empty")
    begin = min(float(motion.time[0]), 0.0)
    if begin < 0.0:
        remarks.append(f"time_from_start 0 is t = {begin:g} s, when motors begin: the path does {-begin:g} s later")
    if geared := [joint.name for joint in joints if joint.motor]:
        of = {"motor": "those of motors, before compliant gears", "joint": "behind compliant gears"}[motion.side]
        other = {"motor": "joint", "joint": "motor"}[motion.side]
        remarks.append(f"positions of {quoted(geared)} are {of}: --side {other} takes the other side")
    positions, velocities = (
        np.stack(columns, axis=1) for columns in zip(*(joint.on(motion.side) for joint in joints), strict=True)
    )
    efforts = np.stack(list(moments.values()), axis=1) if moments else np.zeros((len(motion.time), 0))
    points = [
        {
            "positions": position,
            "velocities": velocity,
            "accelerations": [],
            "effort": effort,
            "time_from_start": dict(zip(("sec", "nanosec"), divmod(round((time - begin) * NANO), NANO), strict=True)),
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


def joint_trajectory_text(motion: JointMotions) -> tuple[str, tuple[str, ...]]:
    """The message as JSON, a line for each point; and remarks."""
    message, remarks = joint_trajectory(motion)
    points = ",\n".join(json.dumps(point) for point in message.pop("points"))
    head = json.dumps(message, ensure_ascii=False)
    return f'{head[:-1]}, "points": [\n{points}\n]}}\n', remarks


TOPIC = "/joint_trajectory"
BAG = "joint_trajectory"  # name of the files in it
VERSION = 8  # of the metadata: what ROS 2 Iron and later write, and Humble reads


def joint_trajectory_bag(motion: JointMotions) -> tuple[Mapping[str, bytes], tuple[str, ...]]:
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
            connection = writer.add_connection(TOPIC, TRAJECTORY, typestore=types)
            writer.write(connection, 0, types.serialize_cdr(_ros(message, types.types), TRAJECTORY))
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}, remarks


def _ros(message: Mapping[str, Any], types: Mapping[str, Any]) -> Any:
    """The message as an object of ROS's class, which is made at run time."""
    stamp = types["builtin_interfaces/msg/Time"](**message["header"]["stamp"])
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=message["header"]["frame_id"])
    points = []
    for point in message["points"]:
        since = types["builtin_interfaces/msg/Duration"](**point["time_from_start"])
        arrays = {key: np.array(values, dtype=float) for key, values in point.items() if key != "time_from_start"}
        points.append(types[f"{TRAJECTORY}Point"](**arrays, time_from_start=since))
    return types[TRAJECTORY](header=header, joint_names=message["joint_names"], points=points)
