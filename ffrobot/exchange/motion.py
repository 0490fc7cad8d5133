"""Motions of joints: from results to other programs, and from planners and recordings to waypoints."""

import json
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..common.arrays import Array, Integers
from ..common.errors import InputError, blaming_file, check_known, finite, naming, quoted
from ..common.libraries import extras, scipy
from ..common.structs import struct
from ..common.tables import as_csv, shown
from ..common.toml_files import read_text
from ..mbs.fields.waypoints import Recorded, Waypoints
from ..results.file import Results

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
NANO = 1_000_000_000
OF_MOTOR = ("motor_coordinate", "motor_rate", "motor_moment")
"""Datasets of a joint with a gear."""
Side = Literal["motor", "joint"]
"""Side of a compliant gear."""


@struct
class JointMotion:
    """One coordinate of a joint over T outputs; SI units."""

    name: str  # name of the joint; "NAME[k]" of coordinate k where it has several
    coordinate: Array  # (T,) rad or m
    rate: Array  # (T,) rad/s or m/s
    moment: Array | None  # (T,) torque or force of the motor at the joint, N·m or N; None without motor
    # datasets (T,) in results: `motor_coordinate`, `motor_rate` (rad or m, 1/s) of a compliant gear, `motor_moment`
    # (N·m or N) of one with a rotor
    motor: Mapping[str, Array] = field(default_factory=dict)

    def on(self, side: Side) -> tuple[Array, Array]:
        """Return coordinate and rate (T,), rad and rad/s or m and m/s, on a side of the gear; equal if it is stiff."""
        if side == "motor" and "motor_coordinate" in self.motor:
            return self.motor["motor_coordinate"], self.motor["motor_rate"]
        return self.coordinate, self.rate


@struct
class JointMotions:
    """Motions of all joints in an analysis at `time` (T,), s; `remarks` on restrictions.

    `side`: side of compliant gears whose positions a JointTrajectory contains.
    """

    analysis: str
    time: Array
    joints: tuple[JointMotion, ...]
    remarks: tuple[str, ...]
    side: Side = "motor"


def robot_motion(path: Path, analysis: str | None, side: Side = "motor") -> JointMotions:
    """Read joint motions of an analysis (default: the first with some) from the results file at `path`.

    Raises `InputError` where no joint moves.
    """
    with naming(path), Results(path) as results:
        known = [name for name in results.analyses if any(_moving(results, name))]
        if analysis is not None:
            check_known(analysis, names := results.analyses, f"--analysis: expected one of {quoted(names)}")
        if not known or analysis not in (None, *known):
            raise InputError("expected an analysis with joints that move", f"none in {analysis or 'it'}")
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


def csv_text(motion: JointMotions) -> tuple[str, tuple[str, ...]]:
    """Return a CSV table and remarks. Columns in SI units: `time`, NAME.coordinate, NAME.rate; with motors NAME.moment.

    Joints with gears have NAME.motor_coordinate, NAME.motor_rate and NAME.motor_moment, too, as in results.
    """
    columns = {"time": motion.time}
    for joint in motion.joints:
        columns |= {f"{joint.name}.coordinate": joint.coordinate, f"{joint.name}.rate": joint.rate}
        if joint.moment is not None:
            columns[f"{joint.name}.moment"] = joint.moment
        columns |= {f"{joint.name}.{key}": values for key, values in joint.motor.items()}
    return as_csv([columns, *np.stack(list(columns.values()), axis=1).tolist()]), motion.remarks


def joint_trajectory(motion: JointMotions) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a ROS JointTrajectory message as a dictionary, SI units, and remarks on what it leaves out.

    It contains joints with motors; if there are none, all joints, without effort. Accelerations are empty.
    """
    moments = {joint.name: joint.moment for joint in motion.joints if joint.moment is not None}
    left = [joint.name for joint in motion.joints if joint.moment is None] if moments else []
    joints = [joint for joint in motion.joints if joint.name not in left]
    remarks = list(motion.remarks)
    if left:
        remarks.append(f"joints without motor left out: {', '.join(left)}")
    if not moments:
        remarks.append("no torque of a motor is known: effort is left empty")
    begin = min(float(motion.time[0]), 0.0)
    if begin < 0.0:
        remarks.append(f"time_from_start 0 is t = {begin:g} s, when motors begin: the path does {-begin:g} s later")
    if geared := [joint.name for joint in joints if "motor_coordinate" in joint.motor]:
        of, other = "behind compliant gears", "motor"
        if motion.side == "motor":
            of, other = "those of motors, before compliant gears", "joint"
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
            positions.tolist(), velocities.tolist(), efforts.tolist(), motion.time.tolist(), strict=True
        )
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    return {"header": header, "joint_names": [joint.name for joint in joints], "points": points}, tuple(remarks)


def joint_trajectory_text(motion: JointMotions) -> tuple[str, tuple[str, ...]]:
    """Return the JointTrajectory of `joint_trajectory` as JSON, a line for each point; and remarks."""
    message, remarks = joint_trajectory(motion)
    points = ",\n".join(json.dumps(point) for point in message.pop("points"))
    head = json.dumps(message, ensure_ascii=False)
    return f'{head[:-1]}, "points": [\n{points}\n]}}\n', remarks


BAG = "joint_trajectory"  # name of the topic, and of the files in it
VERSION = 8  # of the metadata: what ROS 2 Iron and later write, and Humble reads


def joint_trajectory_bag(motion: JointMotions) -> tuple[Mapping[str, bytes], tuple[str, ...]]:
    """Return files (by name) of a ROS 2 bag with the JointTrajectory of `joint_trajectory`; and remarks.

    Raises `SolveError` if `rosbags` is not installed.
    """
    with extras():
        from rosbags.rosbag2 import Writer
        from rosbags.typesys import Stores, get_typestore
    types = get_typestore(Stores.ROS2_HUMBLE)
    message, remarks = joint_trajectory(motion)
    with tempfile.TemporaryDirectory(prefix="ffrobot-bag-") as temporary:
        folder = Path(temporary) / BAG
        with Writer(folder, version=VERSION) as writer:
            connection = writer.add_connection(f"/{BAG}", TRAJECTORY, typestore=types)
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


STATES = "sensor_msgs/msg/JointState"
TEXTS = (".json", ".yaml", ".yml")
MOVING = 0.01  # of the largest rate: less is rest
NESTED = ("goal", "planned_trajectory", "joint_trajectory", "trajectory")
"""Keys under which messages of planners have a JointTrajectory."""


def read_motion(path: Path) -> Waypoints:
    """Read waypoints (rad or m, over s) from a file with a JointTrajectory, or a bag of ROS: see `read_record`."""
    with naming(path):
        return read_record(path).waypoints()


def read_record(path: Path) -> Recorded:
    """Read times (T,), s, and positions (T, joints), rad or m, with remarks on what was left out.

    They are in a JSON or YAML file with a JointTrajectory, or in a bag of ROS with one or with JointStates.

    Raises:
        InputError: the file has no motion, or wrong numbers.
        SolveError: `rosbags` is not installed.
    """
    with naming(path):
        return (_from_text if path.suffix.lower() in TEXTS else _from_bag)(path)


def path_text(motion: Waypoints) -> str:
    """Return a CSV table of a motion: columns t (s) and the joints' names (rad or m), with all digits."""
    rows = ([time, *row] for time, row in zip(motion.times.tolist(), motion.values.tolist(), strict=True))
    return as_csv([["t", *motion.columns], *rows])


def _from_text(path: Path) -> Recorded:
    text = read_text(path, "file of a motion")
    try:
        message = json.loads(text) if path.suffix.lower() == ".json" else _from_yaml(text)
    except (ValueError, RecursionError) as error:
        raise InputError("expected JSON", error) from None
    segments = list(_segments(message))
    if not segments:
        raise InputError('expected a JointTrajectory with "joint_names" and "points"', "none")
    joints, rows, rates, begin = _names(segments[0]["joint_names"]), list[Row](), list[Any](), 0.0
    for k, segment in enumerate(segments):
        if _names(segment["joint_names"]) != joints:
            raise InputError(f"segment {k}: expected the joints of the first one, {quoted(joints)}", "others")
        points = segment["points"]
        if not isinstance(points, Sequence) or isinstance(points, str):
            raise InputError("expected points in a list", type(points).__name__)
        rows += [_row(joints, point, k, begin) for k, point in enumerate(points)]
        rates += [point.get("velocities") for point in points]
        begin = rows[-1][0] if rows else 0.0
    joined = [f"{len(segments)} segments follow each other"] if len(segments) > 1 else []
    return _record(joints, rows, rates, *joined)


def _from_yaml(text: str) -> Any:
    """All documents of it, as `ros2 topic echo` writes one for each message."""
    with extras():
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError
    try:
        return list(YAML(typ="safe", pure=True).load_all(text))
    except (YAMLError, ValueError, RecursionError) as error:
        raise InputError("expected YAML", shown(" ".join(str(error).split()))) from None


def _segments(message: Any) -> Iterator[Mapping[str, Any]]:
    """The JointTrajectories in a message, those of a list one after the other."""
    if isinstance(message, list):
        for part in message:
            yield from _segments(part)
    elif isinstance(message, Mapping):
        if {"joint_names", "points"} <= message.keys():
            yield message
        elif inner := next((key for key in NESTED if key in message), None):
            yield from _segments(message[inner])


def _names(names: Any) -> list[str]:
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError("expected joint_names, a list of texts", "others")
    return names


Row = tuple[float, list[float]]
"""Time (s) and positions (rad or m) of a point."""


def _row(joints: Sequence[str], point: Any, k: int, begin: float) -> Row:
    if not isinstance(point, Mapping):
        raise InputError(f"point {k}: expected positions and time_from_start", type(point).__name__)
    positions = point.get("positions")
    if not positions:
        others = quoted(key for key in ("velocities", "accelerations", "effort") if point.get(key))
        raise InputError(f"point {k}: expected positions", f"{others}: the path goes through positions")
    if not isinstance(positions, list) or len(positions) != len(joints):
        other = len(positions) if isinstance(positions, list) else type(positions).__name__
        raise InputError(f"point {k}: expected {len(joints)} positions, one for each joint", other)
    return begin + _seconds(point.get("time_from_start"), k), [finite(value, f"point {k}") for value in positions]


def _seconds(duration: Any, k: int) -> float:
    """Of a Duration of ROS 2 (sec, nanosec), ROS 1 (secs, nsecs) or protobuf (seconds, nanos; "0.5s"), or a number."""
    where = f"point {k}: time_from_start"
    if duration is None:
        raise InputError(f"{where}: expected a time", "none")
    if isinstance(duration, Mapping):
        whole, parts = (
            next((duration[key] for key in keys if key in duration), 0)
            for keys in (("sec", "secs", "seconds"), ("nanosec", "nsecs", "nanos", "nanoseconds"))
        )
        return finite(whole, where) + finite(parts, where) / NANO
    return finite(duration.removesuffix("s") if isinstance(duration, str) else duration, where)


def _record(joints: Sequence[str], rows: Sequence[Row], velocities: Sequence[Any], *remarks: str) -> Recorded:
    """`velocities`: of all points, or of none."""
    if not joints or len(set(joints)) < len(joints):
        raise InputError("expected joints of different names", f"{len(joints)}: {shown(', '.join(joints))}")
    times = np.array([time for time, _ in rows])
    values = np.array([positions for _, positions in rows], dtype=float).reshape(len(rows), len(joints))
    try:
        rates = np.asarray_chkfinite(velocities, dtype=float).reshape(values.shape)
    except (TypeError, ValueError, OverflowError):
        rates = None
    sizes = np.abs(values[:0] if rates is None else rates)
    for k, end in ((0, "first"), (-1, "last")) if len(sizes) else ():
        if moving := [name for name, size in zip(joints, sizes[k], strict=True) if size > MOVING * sizes.max()]:
            remarks += (
                f"{quoted(moving)} at the {end} point: velocities of up to {sizes[k].max():.3g} left out: waypoints"
                " begin and end at rest, so that accelerations there are larger than those of the motion",
            )
    return Recorded(joints, times, values, "point {}".format, remarks, rates)


def _from_bag(path: Path) -> Recorded:
    if not path.exists():
        raise InputError("file of a motion not found")
    with extras():
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

    def problem(error: Exception) -> str:
        is_told = type(error).__module__.startswith("rosbags")
        return f"expected a bag of ROS, found {shown(str(error)) if is_told else 'one that is damaged or not complete'}"

    with blaming_file(problem), AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as bag:
        return _of_bag(bag)


def _of_bag(bag: Any) -> Recorded:
    """The first JointTrajectory of the topic that has most; without one, the JointStates of all topics."""
    connections = sorted(bag.connections, key=lambda one: -int(one.msgcount))
    plans, states = ([one for one in connections if one.msgtype == kind] for kind in (TRAJECTORY, STATES))

    def messages(topic: Any) -> Iterator[tuple[int, Any]]:
        return ((at, bag.deserialize(raw, topic.msgtype)) for _, at, raw in bag.messages(connections=[topic]))

    if not plans:
        if not states:
            raise InputError(f"expected messages {TRAJECTORY} or {STATES}", "none of them")
        return _states({topic.topic: messages(topic) for topic in states})
    first, *others = plans
    (_, plan), *later = messages(first)
    left = [f"{len(later)} later messages on {first.topic} left out"] if later else []
    left += [f"{topic.topic} left out: {topic.msgcount} messages" for topic in (*others, *states)]
    rows = []
    for k, point in enumerate(plan.points):
        keys = {"positions": point.positions.tolist(), "time_from_start": vars(point.time_from_start)}
        rows.append(_row(plan.joint_names, keys, k, 0.0))
    return _record(plan.joint_names, rows, [point.velocities for point in plan.points], *left)


def _states(topics: Mapping[str, Iterator[tuple[int, Any]]]) -> Recorded:
    """Positions of all joints by time stamps from zero on: see `_together`.

    Of several topics with a joint, the one with most messages counts. Times of the record replace unset stamps.
    """
    samples, owner, others = dict[str, list[Sample]](), dict[str, str](), dict[str, list[str]]()
    for topic, messages in topics.items():
        for at, message in messages:
            if len(message.position) != len(message.name):
                continue
            stamp = message.header.stamp.sec * NANO + message.header.stamp.nanosec
            for name, position in zip(message.name, message.position.tolist(), strict=True):
                if owner.setdefault(name, topic) == topic:
                    samples.setdefault(name, []).append((stamp, at, finite(position, f"joint {shown(name)}")))
                elif name not in others.setdefault(topic, []):
                    others[topic].append(name)
    read = quoted(dict.fromkeys(owner.values())).replace('"', "")
    remarks = [f"measured positions of {read}, as they are: not smoothed"]
    for topic, names in others.items():
        elsewhere = ", ".join(dict.fromkeys(owner[name] for name in names))
        remarks.append(f"{topic}: {quoted(map(shown, names))} left out: also on {elsewhere}")
    return _together(samples, remarks)


Sample = tuple[int, int, float]
"""Time stamp of a message (ns; 0: not set), its time in the record (ns), and a position."""


def _together(samples: Mapping[str, list[Sample]], remarks: list[str]) -> Recorded:
    """One table of joints that are sampled at different times (ns).

    Times are those of the joints with most samples, within the samples of all; cubic splines interpolate others.
    """
    series = dict[str, tuple[Integers, Array]]()
    clock = 0 if any(stamp for rows in samples.values() for stamp, _, _ in rows) else 1
    for name, rows in samples.items():
        at, values = np.array([row[clock] for row in rows], dtype=np.int64), np.array([value for *_, value in rows])
        order = np.argsort(at, kind="stable")
        series[name] = at[order], values[order]
    if short := [name for name, (at, _) in series.items() if len(np.unique(at)) < 2]:
        remarks.append(f"{quoted(map(shown, short))} left out: fewer than two samples")
    series = {name: rows for name, rows in series.items() if name not in short}
    if not series:
        return _record(list(samples), [], [])
    alike = Counter(at.tobytes() for at, _ in series.values())
    stamps = max((at for at, _ in series.values()), key=lambda at: (len(at), alike[at.tobytes()]))
    apart = [name for name, (at, _) in series.items() if not np.array_equal(at, stamps)]
    begin, end = max(at[0] for at, _ in series.values()), min(at[-1] for at, _ in series.values())
    times = stamps[(stamps >= begin) & (stamps <= end)]
    if len(times) < 2:
        raise InputError("expected joints that are recorded at the same time", f"none for {quoted(series)}")
    seconds = (times - times[0]) / NANO
    if apart:
        remarks.append(
            f"{quoted(map(shown, apart))}: in other messages: by cubic splines at times of the others, the"
            f" {seconds[-1]:.6g} s that all have"
        )
    columns = list[Array]()
    for name, (at, values) in series.items():
        if name not in apart:
            columns.append(values[np.isin(at, times)])
            continue
        once = np.append(True, np.diff(at) > 0)
        own = (at[once] - times[0]) / NANO
        columns.append(scipy.interpolate.CubicSpline(own, values[once])(seconds))
    points = zip(seconds.tolist(), np.stack(columns, axis=1).tolist(), strict=True)
    return _record(list(series), list(points), [None], *remarks)
