"""Motions of joints that other programs planned or recorded, as a table of waypoints; motions of results for them."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import Array, as_list, as_rows
from ...common.errors import InputError, did_you_mean, quoted
from ...common.extras import extras
from ...common.tables import as_csv, shown
from ...common.toml_files import read_text
from ...results.file import Results

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
STATES = "sensor_msgs/msg/JointState"
MOVING = 0.01  # of the largest rate: less is rest
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
        rows = ([time, *row] for time, row in zip(self.time.tolist(), as_rows(self.positions), strict=True))
        return as_csv([["t", *self.joints], *rows])


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


def _of_points(joints: Sequence[str], points: Sequence[Mapping[str, Any]]) -> JointPath:
    rows = [(_seconds(point["time_from_start"]), point["positions"]) for point in points]
    found = {len(positions) for _, positions in rows}
    if found - {len(joints)}:
        raise InputError(f"expected {len(joints)} positions in each point, found {sorted(found)}")
    remarks = _moving_at_ends(joints, [point.get("velocities") for point in points])
    return _motion(joints, [time for time, _ in rows], [positions for _, positions in rows], *remarks)


def _moving_at_ends(joints: Sequence[str], velocities: Sequence[Any]) -> Iterator[str]:
    """Of motions that begin or end elsewhere than at rest, where all points have velocities."""
    if any(rates is None or len(rates) != len(joints) for rates in velocities) or not len(velocities):
        return
    rates = np.abs(np.array(velocities, dtype=float))
    for k, end in ((0, "first"), (-1, "last")):
        moving = [name for name, rate in zip(joints, rates[k], strict=True) if rate > MOVING * rates.max()]
        if moving:
            yield (
                f"{quoted(moving)} at the {end} point: velocities of up to {rates[k].max():.3g} left out: waypoints"
                " begin and end at rest, so that accelerations there are larger than those of the motion"
            )


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
    remarks += _moving_at_ends(first.joint_names, [point.velocities for point in first.points])
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
    return as_csv([columns, *as_rows(np.stack(list(columns.values()), axis=1))])


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
    begin = min(float(motion.time[0]), 0.0)
    if begin < 0.0:
        remarks.append(f"time_from_start 0 is t = {begin:g} s, when motors begin: the path does {-begin:g} s later")
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
            "time_from_start": _duration(time - begin),
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
