"""Motions of other programs as waypoints: tables with clocks and other names, JointTrajectory, bags of ROS."""

import json
import time

import numpy as np
import pytest

from ffrobot import InputError
from ffrobot.common.validation import validate
from ffrobot.exchange.motion import read_motion
from ffrobot.mbs.fields.waypoints import Waypoints, load_waypoints
from ffrobot.mbs.scene.trajectories import Trajectory

ROWS = [(0.0, 0.1, -0.4), (0.5, 0.3, -0.2), (1.25, 0.2, 0.6)]
EPOCH = 1_700_000_000


def write(path, header, rows, separator=","):
    path.write_text("\n".join([header, *(separator.join(map(str, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "factor", "offset", "remark"),
    [
        ("t", 1, 0, None),
        ("Time", 1, 0, None),
        ("time [ms]", 1000, 0, None),
        ("timestamp_us", 10**6, 0, None),
        ("time", 1, EPOCH, "in 1 s since 1970"),
        ("stamp (ns)", 10**9, EPOCH * 10**9, "in 1e-09 s since 1970"),
        ("timestamp", 10**9, EPOCH * 10**9, "in 1e-09 s since 1970"),
    ],
)
def test_columns_of_times(header, factor, offset, remark, tmp_path):
    """All say 0, 0.5, 1.25 s."""
    rows = [(offset + round(t * factor) if offset else t * factor, a, b) for t, a, b in ROWS]
    if factor == 1:
        rows = [(offset + t, a, b) for t, a, b in ROWS]
    table = load_waypoints(write(tmp_path / "path.csv", f"{header},hip,knee", rows))
    np.testing.assert_allclose(table.times, [0, 0.5, 1.25], rtol=0, atol=3e-7 if offset else 0)
    assert len(table.remarks) == (remark is not None)
    assert remark is None or remark in table.remarks[0]


@pytest.mark.parametrize("header", ["seconds from start", "x", "tt", "date", "time (min)"])
def test_what_is_no_column_of_times(header, tmp_path):
    with pytest.raises(InputError, match="expected a header"):
        load_waypoints(write(tmp_path / "path.csv", f"{header},value", [(0, 1), (1, 2)]))


@pytest.mark.parametrize(
    ("names", "column"), [("hip,knee", 1), ("hip.coordinate,knee.coordinate", 1), ("value,knee", 0)]
)
def test_the_column_of_a_joint(names, column, tmp_path):
    write(tmp_path / "path.csv", f"t,{names}", ROWS)
    keys = {"name": "bend", "joint": "knee", "waypoints": "path.csv"}
    trajectory = validate(Trajectory, keys, tmp_path / "scene.toml")
    sampled = trajectory.components["value"].sample(np.array([0.0, 0.5, 1.25]))[0]
    np.testing.assert_allclose(sampled, [row[1 + column] for row in ROWS], rtol=0, atol=1e-14)
    if "value" not in names:
        with pytest.raises(InputError, match=rf'header t,value or t,JOINT, found "t,{names}"'):
            validate(Trajectory, keys | {"joint": "toe"}, tmp_path / "scene.toml")


COLUMNS = {
    "plotjuggler": ("__time,/joint_states/hip/position,/joint_states/knee/position", 1.0, ","),
    "a topic": ("t,hip/position,knee/position", 1.0, ","),
    "degrees": ("t [s],hip [deg],knee (deg)", 180 / np.pi, ","),
    "pandas": ("#", 1.0, ","),
    "NumPy": ("# t,hip,knee", 1.0, ","),
    "a comment before": ("# recorded\n# by hand\nt,hip,knee", 1.0, ","),
    "Excel in Europe": ("sep=;\nt;hip;knee", 1.0, ";"),
    "tabs": ("t\thip\tknee", 1.0, "\t"),
}


@pytest.mark.parametrize("kind", COLUMNS)
def test_tables_as_programs_write_them(kind, tmp_path):
    header, factor, separator = COLUMNS[kind]
    rows = [[repr(t), repr(a * factor), repr(b * factor)] for t, a, b in ROWS]
    if header == "#":
        header, rows = ",t,hip,knee", [[str(k), *row] for k, row in enumerate(rows)]
    text = "\n".join([header, *(separator.join(row) for row in rows)])
    (tmp_path / "path.csv").write_text(text.replace(".", ",") if separator == ";" else text)
    table = load_waypoints(tmp_path / "path.csv")
    np.testing.assert_allclose(table.times, [0, 0.5, 1.25], rtol=1e-15)
    np.testing.assert_allclose(table.of_joint("knee").values[:, 0], [row[2] for row in ROWS], rtol=1e-14)
    assert table.of_joint("knee").columns == ("value",)
    assert any("is converted to rad" in remark for remark in table.remarks) == (kind == "degrees")


@pytest.mark.parametrize(
    "text", ["root:$6$secret:19000:0:99999:7:::\ndaemon:*:1:\n", "A=secret\0B=1, 2\0", "-- secret --"]
)
def test_messages_quote_no_other_files(text, tmp_path):
    """What a scene names need not be a table: /etc/shadow, an environment, a key."""
    (tmp_path / "path.csv").write_text(text)
    with pytest.raises(InputError, match="cannot read the waypoint table: expected names of columns") as error:
        load_waypoints(tmp_path / "path.csv")
    assert "secret" not in str(error.value)


def test_columns_that_are_not_told_apart(tmp_path):
    keys = {"name": "bend", "joint": "knee", "waypoints": "path.csv"}
    write(tmp_path / "path.csv", "t,/left/knee/position,/right/knee/position", ROWS)
    with pytest.raises(InputError, match='expected one column of joint "knee", found "/left/knee/position"'):
        validate(Trajectory, keys, tmp_path / "scene.toml")
    write(tmp_path / "path.csv", "t,HIP,KNEE", ROWS)
    with pytest.raises(InputError, match=r'no column of "knee" \(did you mean "KNEE"\?\)'):
        validate(Trajectory, keys, tmp_path / "scene.toml")


def test_rows_that_jump_are_told(tmp_path):
    """A second publisher of zeros, one step aside, an angle counted anew; none of a quick, noisy or coarse record."""
    time = 0.05 * np.arange(61)
    smooth = time * np.exp(-time)
    zeros = [row for k, (t, a) in enumerate(zip(time, smooth, strict=True))
             for row in ((t, a), (t + 1e-3, 0.0))[: 1 + (k % 4 == 3)]]  # fmt: skip
    wrapped = np.angle(np.exp(1j * (2 + 3 * time)))
    aside = np.where(np.arange(61) == 30, smooth + 0.9, smooth)
    noise = np.random.default_rng(1).normal(scale=1e-4, size=601)
    quick = np.sin(2 * np.pi * 5 * np.arange(601) / 500) + noise
    rest = np.clip(np.arange(601) / 500 - 0.8, 0, None) ** 2 * 20 + 0.01 * noise
    cases = {
        "value jumps by 0.367 at t = 0.951 s, and at": zeros,
        "value jumps by a turn at t = 0.4 s, and at 1 more": zip(time, wrapped, strict=True),
        "value jumps by 0.9 at t = 1.5 s, and at 2 more rows:": zip(time, aside, strict=True),
        "": zip(np.arange(601) / 500, quick, strict=True),
        " ": zip(np.arange(601) / 500, rest, strict=True),
        "  ": [(0.0, 0.0), (1.0, 6.3), (2.0, 0.0), (3.0, 6.3)],
    }
    for told, rows in cases.items():
        table = load_waypoints(write(tmp_path / "path.csv", "t,value", [tuple(map(float, row)) for row in rows]))
        found = [remark.removeprefix("path.csv: ") for remark in table.remarks if "jumps" in remark]
        assert len(found) == bool(told.strip())
        assert all(remark.startswith(told) for remark in found), found
        assert not found or "jumps" in table.remarks[0]  # a summary prints the first remark of a file alone


def test_rows_twice_and_gaps(tmp_path):
    rows = [(0.01 * k, 0.02 * k) for k in range(40)]
    rows = [*rows[:9], rows[8], *rows[9:], (5.0, 1.0)]
    table = load_waypoints(write(tmp_path / "path.csv", "t,value", rows))
    assert len(table.times) == 41
    assert table.remarks == (
        "path.csv: line 11: 1 rows that repeat the one before count once",
        "path.csv: no rows between t = 0.39 and 5 s, where others are 0.01 s apart: the path there is the spline's"
        " alone",
        "path.csv: value moves at t = 0 s by 2 per s: the path is at rest there, and changes to that speed within"
        " 0.01 s",
    )
    with pytest.raises(InputError, match=r"line 3: expected times that increase, found t = 0 after 0"):
        load_waypoints(write(tmp_path / "path.csv", "t,value", [(0, 1), (0, 2)]))


@pytest.mark.parametrize("lost", [1, 2, 5])
def test_samples_lost_of_a_record(lost, tmp_path):
    """Two steps of 0.01 s in a row are not yet a gap; nor is a hold, in which nothing moves."""
    rows = [(0.01 * k, 0.02 * k) for k in (*range(5), *range(4 + 1 + lost, 20))]
    table = load_waypoints(write(tmp_path / "path.csv", "t,value", rows))
    says = f"no rows between t = 0.04 and {0.05 + 0.01 * lost:g} s, where others are 0.01 s apart"
    assert [remark.partition(": ")[2].startswith(says) for remark in table.remarks] == [True] * (lost > 1)
    still = [(t, 0.08) if 0.035 < t < 0.051 + 0.01 * lost else (t, q) for t, q in rows]
    assert load_waypoints(write(tmp_path / "path.csv", "t,value", still)).remarks == ()


@pytest.mark.parametrize(
    ("path", "rates"),
    [
        (lambda t: np.sin(2 * np.pi * t), [2 * np.pi] * 2),
        (lambda t: 3 * t, [3.0, 3.0]),
        (lambda t: t**2, [2.0]),
        (lambda t: 1 - np.cos(2 * np.pi * t), []),  # at rest, under acceleration
        (lambda t: 10 * t**3 - 15 * t**4 + 6 * t**5, []),
    ],
)
def test_records_that_move_at_their_ends(path, rates, tmp_path):
    rows = [(t, path(t)) for t in np.linspace(0.0, 1.0, 101)]
    table = load_waypoints(write(tmp_path / "path.csv", "t,value", rows))
    says = [f"by {rate:.3g} per s: the path is at rest there" for rate in rates]
    assert len(table.remarks) == len(says)
    assert all(text in remark for text, remark in zip(says, table.remarks, strict=True))


def test_records_that_turn_between_two_rows(tmp_path):
    """Rows are alike beside the top of 64 u³ (1 − u)³, u = t/2 s, where its rate is zero and its acceleration −6."""
    time = np.linspace(0.0, 2.0, 80)
    rows = [(t, round(8.0 * (t * (1.0 - t / 2.0)) ** 3, 6)) for t in time]
    told = load_waypoints(write(tmp_path / "path.csv", "t,value", rows))
    assert "rows from t = 0.987342 to 1.01266 s are alike: the path rests there" in told.abrupt_hold
    assert told.spline.sample(np.array([1.0]), 2)[0, 0] == 0.0
    fine = load_waypoints(write(tmp_path / "path.csv", "t,value", [*rows[:39], *rows[40:]]))
    assert fine.abrupt_hold == ""
    assert fine.spline.sample(np.array([1.0]), 2)[0, 0] == pytest.approx(-6.0, rel=5e-3)


@pytest.mark.parametrize("digits", [4, 9])
def test_holds_that_records_come_to_are_not_told(digits, tmp_path):
    time = np.arange(0.0, 2.5, 0.01)
    u = np.minimum(time, 1.0) - np.clip(time - 1.5, 0.0, 1.0)
    rows = zip(time, (u**3 * (10.0 - 15.0 * u + 6.0 * u**2)).round(digits), strict=True)
    assert load_waypoints(write(tmp_path / "path.csv", "t,value", list(rows))).abrupt_hold == ""


@pytest.mark.parametrize("epoch", [0, EPOCH])
def test_whole_seconds_and_nanoseconds(epoch, tmp_path):
    """As ROS writes them, from 0.5 s on."""
    rows = [(epoch + int(t + 0.5), round((t + 0.5) % 1 * 10**9), a, b) for t, a, b in ROWS]
    table = load_waypoints(write(tmp_path / "path.csv", "sec,nanosec,hip,knee", rows))
    first = 0.0 if epoch else 0.5
    np.testing.assert_allclose(table.times, np.add([0, 0.5, 1.25], first), rtol=0, atol=1e-12)
    assert table.columns == ("hip", "knee")
    np.testing.assert_array_equal(table.values, [row[1:] for row in ROWS])


def plan(time, rows=ROWS):
    points = [{"positions": [a, b], "time_from_start": time(t)} for t, a, b in rows]
    return {"joint_names": ["hip", "knee"], "points": points}


LATER = plan(lambda t: t - 0.5, [*ROWS[1:], ROWS[2]])
MESSAGES = {
    "ROS 2": plan(lambda t: {"sec": int(t), "nanosec": round(t % 1 * 1e9)}),
    "ROS 1": plan(lambda t: {"secs": int(t), "nsecs": round(t % 1 * 1e9)}),
    "protobuf": plan(lambda t: f"{t}s"),
    "segments, of which the last point is there twice": {
        "trajectory": [{"joint_trajectory": plan(float, ROWS[:2])}, {"joint_trajectory": LATER}]
    },
    "numbers": {"goal": {"trajectory": {"joint_trajectory": plan(float)}}},
}


@pytest.mark.parametrize("kind", MESSAGES)
def test_joint_trajectories(kind, tmp_path):
    (tmp_path / "plan.json").write_text(json.dumps(MESSAGES[kind]))
    motion = read_motion(tmp_path / "plan.json")
    assert motion.columns == ("hip", "knee")
    np.testing.assert_array_equal(np.column_stack([motion.times, motion.values]), ROWS)


WRONG = {
    "[1, 2]": "expected a JointTrajectory",
    "{": "expected JSON",
    '{"joint_names": ["a"], "points": 3}': "expected points",
    '{"joint_names": ["a"], "points": []}': "at least 2 waypoints",
    '{"joint_names": ["a"], "points": [{"positions": [1, 2], "time_from_start": 0}]}': "expected 1 positions",
    '{"joint_names": ["a"], "points": [{"positions": ["x"], "time_from_start": 0}]}': "expected a finite number",
    '{"joint_names": ["a"], "points": [{"positions": [1]}]}': "point 0: time_from_start: expected a time, found none",
    '{"joint_names": ["a"], "points": [{"positions": [1], "time_from_start": "1 h"}]}': "expected a finite number",
    '{"joint_names": ["a"], "points": [{"velocities": [1], "time_from_start": 0}]}': 'positions, found "velocities"',
    '{"joint_names": "a", "points": []}': "expected joint_names, a list",
    '{"joint_names": ["a"], "points": [3]}': "point 0: expected positions and time_from_start, found int",
    f'{{"joint_names": ["a"], "points": [{{"positions": [1{400 * "0"}], "time_from_start": 0}}]}}': "finite number",
    '{"joint_names": ["a"], "points": [{"positions": [NaN], "time_from_start": 0},'
    ' {"positions": [1], "time_from_start": 1}]}': "finite number",
    '{"joint_names": ["a"], "points": [{"positions": [0], "time_from_start": 1},'
    ' {"positions": [1], "time_from_start": 1}]}': "point 1: expected times that increase, found t = 1 after 1",
    '{"joint_names": ["a", "a"], "points": [{"positions": [0, 1], "time_from_start": 1}]}': "joints of different names",
}


@pytest.mark.parametrize("text", WRONG)
def test_wrong_motions(text, tmp_path):
    (tmp_path / "plan.json").write_text(text)
    with pytest.raises(InputError) as error:
        read_motion(tmp_path / "plan.json")
    assert str(error.value).startswith(f"{tmp_path / 'plan.json'}: ")
    assert WRONG[text] in str(error.value)


def bag_of(folder, rows, version=9):
    """A bag, by rosbags, with JointStates of `rows`: topic, stamp (s), positions by joint."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    types, kind, topics = get_typestore(Stores.ROS2_HUMBLE), "sensor_msgs/msg/JointState", {}
    of, none = types.types, np.zeros(0)
    with Writer(folder, version=version) as writer:
        for k, (topic, t, positions) in enumerate(rows):
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=types)
            stamp = of["builtin_interfaces/msg/Time"](sec=int(t), nanosec=round(t % 1 * 1e9))
            header = of["std_msgs/msg/Header"](stamp=stamp, frame_id="")
            message = of[kind](header, list(positions), np.array(list(positions.values())), none, none)
            writer.write(topics[topic], EPOCH * 10**9 + k * 10**7, types.serialize_cdr(message, kind))
    return folder


@pytest.mark.parametrize("version", [8, 9])
def test_joint_states_of_a_bag(version, tmp_path, ffrobot):
    """Messages name joints in any order."""
    pairs = [[("hip", hip), ("knee", knee)][:: (-1) ** k] for k, (_, hip, knee) in enumerate(ROWS)]
    rows = [("/joint_states", EPOCH + t, dict(of)) for (t, *_), of in zip(ROWS, pairs, strict=True)]
    bag_of(tmp_path / "bag", rows, version)
    done = ffrobot.ok("import", tmp_path / "bag", "-o", tmp_path / "path.csv")
    assert "measured positions of /joint_states" in done.stdout
    table = load_waypoints(tmp_path / "path.csv")
    assert table.columns == ("hip", "knee")
    np.testing.assert_array_equal(np.column_stack([table.times, table.values]), ROWS)
    ffrobot.ok("import", tmp_path / "bag", "-o", tmp_path / "path.csv")
    with (tmp_path / "path.csv").open("a") as file:
        file.write("2.0,0,0\n")
    again = ffrobot("import", tmp_path / "bag", "-o", tmp_path / "path.csv")
    assert again.returncode == 2
    (tmp_path / "bag" / "metadata.yaml").write_text("not: a bag\n")
    broken = ffrobot("import", tmp_path / "bag", "-o", tmp_path / "other.csv")
    assert (broken.returncode, "expected a bag of ROS" in broken.stderr) == (2, True)


@pytest.mark.parametrize("before", [0.01, -0.01])
@pytest.mark.parametrize("topics", [("/joint_states", "/joint_states"), ("/arm/joint_states", "/hand/joint_states")])
def test_publishers_that_take_turns(topics, before, tmp_path):
    """Arm and gripper with messages of their own: all joints, of the gripper to the accuracy of cubic splines."""
    times = 10 + 0.05 * np.arange(41)
    rows = [(topics[0], t, {"j1": np.sin(t), "j2": 0.2 * t}) for t in times]
    rows += [(topics[1], t, {"finger": np.cos(t)}) for t in times + before]
    motion = read_motion(bag_of(tmp_path / "bag", sorted(rows, key=lambda row: row[1])))
    assert set(motion.columns) == {"j1", "j2", "finger"}
    found = dict(zip(motion.columns, motion.values.T, strict=True))
    t = motion.times + 10 + (0.05 if before > 0 else 0.0)
    assert len(t) == 40
    np.testing.assert_allclose(found["j1"], np.sin(t), rtol=0, atol=1e-12)
    np.testing.assert_allclose(found["finger"], np.cos(t), rtol=0, atol=2e-6)
    assert any("finger" in remark and "cubic splines" in remark for remark in motion.remarks)


def test_a_joint_on_two_topics(tmp_path):
    times = 0.05 * np.arange(20)
    rows = [(f"/{side}/joint_states", t, {"j": sign * t}) for t in times for side, sign in (("left", 1), ("right", -1))]
    motion = read_motion(bag_of(tmp_path / "bag", [*rows, ("/right/joint_states", 1.0, {"j": -1.0})]))
    np.testing.assert_allclose(motion.values[:, 0], -motion.times, atol=1e-12)
    assert '/left/joint_states: "j" left out: also on /right/joint_states' in motion.remarks


def test_motions_that_move_at_their_ends_are_told(tmp_path):
    """A sine begins at its largest rate and ends at rest after a quarter of its period."""
    times = np.linspace(0.0, 1.0, 11)
    message = plan(float, [(t, np.sin(np.pi / 2 * t), 0.0) for t in times])
    for t, point in zip(times, message["points"], strict=True):
        point["velocities"] = [np.pi / 2 * np.cos(np.pi / 2 * t), 0.0]
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(message), encoding="utf-8")
    (remark,) = read_motion(path).remarks
    assert remark.startswith('"hip" at the first point: velocities of up to 1.57 left out: waypoints begin and')


def test_many_waypoints_take_time_in_proportion(tmp_path):
    """Of the processor, for the path through 4 and 16 thousand rows; its error at the rows is round-off."""
    seconds = []
    for count in (4000, 16000):
        times = np.linspace(0.0, 10.0, count)
        table = Waypoints(("value",), times, np.sin(times)[:, None] ** 3)
        began = time.process_time()
        path = table.spline
        seconds.append(time.process_time() - began)
        np.testing.assert_allclose(path.sample(times), table.values, rtol=0, atol=1e-11)
    assert seconds[1] < 8 * seconds[0]
