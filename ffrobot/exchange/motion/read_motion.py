"""Motions of joints that other programs planned or recorded, as a table of waypoints: `ffrobot import MOTION`."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import Array, as_rows
from ...common.errors import InputError
from ...common.extras import extras
from ...common.tables import TableWriter, shown
from ...common.toml_files import read_text
from .rosbag import NANO

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STATES = "sensor_msgs/msg/JointState"
NESTED = ("goal", "planned_trajectory", "joint_trajectory", "trajectory")
"""Keys under which messages of planners have a JointTrajectory."""


@dataclass(frozen=True, eq=False)
class JointPath:
    """Positions (T, n) of n joints, rad or m, at times (T,), s; `remarks` say what was left out."""

    joints: tuple[str, ...]
    time: Array
    positions: Array
    remarks: tuple[str, ...] = ()

    def csv_text(self) -> str:
        """Columns t and the joints' names, with all digits."""
        text = io.StringIO()
        table = TableWriter(text)
        table.writerow(["t", *self.joints])
        table.writerows([time, *row] for time, row in zip(self.time.tolist(), as_rows(self.positions), strict=True))
        return text.getvalue()


def read_motion(path: Path) -> JointPath:
    """The motion in a JSON file with a JointTrajectory, or in a bag of ROS with one or with JointStates.

    Raises:
        InputError: it has none, or numbers that are no motion; names the file.
        SolveError: `rosbags` is not installed.
    """
    reader: Callable[[Path], JointPath] = _from_json if path.suffix.lower() == ".json" else _from_bag
    try:
        found = reader(path)
        _check(found)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(path)) else f"{path}: {text}") from None
    return found


def _check(motion: JointPath) -> None:
    if len(motion.time) < 2:
        raise InputError(f"expected at least 2 points of a motion, found {len(motion.time)}")
    if not np.isfinite(motion.positions).all():
        raise InputError("expected finite positions, found others")
    late = np.flatnonzero(np.diff(motion.time) <= 0)
    if late.size:
        k = int(late[0]) + 1
        raise InputError(
            f"point {k}: expected times that increase, found {motion.time[k]:g} s after {motion.time[k - 1]:g} s"
        )


def _from_json(path: Path) -> JointPath:
    try:
        message = json.loads(read_text(path, "file of a motion"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"expected JSON, found {error}") from None
    while isinstance(message, Mapping) and (inner := next((key for key in NESTED if key in message), None)):
        message = message[inner]
    if not isinstance(message, Mapping) or not {"joint_names", "points"} <= message.keys():
        raise InputError('expected a JointTrajectory with "joint_names" and "points", found none')
    try:
        return _of_points([str(name) for name in message["joint_names"]], message["points"])
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(f"expected points with positions and time_from_start, found others: {error!r}") from None


def _of_points(joints: Sequence[str], points: Iterable[Mapping[str, Any]]) -> JointPath:
    rows = [(_seconds(point["time_from_start"]), point["positions"]) for point in points]
    found = {len(positions) for _, positions in rows}
    if found - {len(joints)}:
        raise InputError(f"expected {len(joints)} positions in each point, found {sorted(found)}")
    return _motion(joints, [time for time, _ in rows], [positions for _, positions in rows])


def _motion(joints: Sequence[str], times: Sequence[float], positions: Sequence[Any], *remarks: str) -> JointPath:
    if not joints or len(set(joints)) < len(joints):
        raise InputError(f"expected joints of different names, found {len(joints)}: {shown(', '.join(joints))}")
    values = np.array(positions, dtype=float).reshape(len(times), len(joints))
    return JointPath(tuple(joints), np.array(times, dtype=float), values, remarks)


def _seconds(duration: object) -> float:
    """Of a Duration of ROS 2 (sec, nanosec) or ROS 1 (secs, nsecs), or a number."""
    if isinstance(duration, Mapping):
        sec, nanosec = (duration.get(new, duration.get(old, 0)) for new, old in (("sec", "secs"), ("nanosec", "nsecs")))
        return float(sec) + float(nanosec) / NANO
    return float(duration)  # type: ignore[arg-type]


def _from_bag(path: Path) -> JointPath:
    if not path.exists():
        raise InputError("file of a motion not found")
    with extras():
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
            return _first_motion(bag)
    except InputError:
        raise
    except Exception as error:  # whatever a reader of damaged files raises
        raise InputError(f"expected a bag of ROS, found {type(error).__name__}: {shown(str(error))}") from None


def _first_motion(bag: Any) -> JointPath:  # noqa: ANN401 (of a library without types)
    """The first JointTrajectory; without one, the JointStates of the topic that has most."""
    for kind, read in ((TRAJECTORY, _trajectory), (STATES, _states)):
        topics = [connection for connection in bag.connections if connection.msgtype == kind]
        if topics:
            topic = max(topics, key=lambda connection: int(connection.msgcount))
            messages = (bag.deserialize(raw, kind) for _, _, raw in bag.messages(connections=[topic]))
            return read(messages, topic.topic)
    raise InputError(f"expected messages {TRAJECTORY} or {STATES}, found none of them")


def _trajectory(messages: Iterator[Any], topic: str) -> JointPath:
    first, *others = messages
    times = [point.time_from_start.sec + point.time_from_start.nanosec / NANO for point in first.points]
    remarks = [f"{len(others)} later messages on {topic} left out"] if others else []
    return _motion(first.joint_names, times, [point.positions for point in first.points], *remarks)


def _states(messages: Iterator[Any], topic: str) -> JointPath:
    """Positions over the time of their stamps, the first being zero; joints of the first message."""
    rows, joints = list[tuple[int, list[float]]](), list[str]()
    for message in messages:
        joints = joints or list(message.name)
        if set(joints) <= set(message.name) and len(message.position) == len(message.name):
            at = dict(zip(message.name, message.position, strict=True))
            rows.append(
                (message.header.stamp.sec * NANO + message.header.stamp.nanosec, [float(at[name]) for name in joints])
            )
    begin = rows[0][0] if rows else 0
    times = [(stamp - begin) / NANO for stamp, _ in rows]
    return _motion(joints, times, [row for _, row in rows], f"measured positions of {topic}, as they are: not smoothed")
