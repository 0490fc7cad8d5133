"""`ffrobot export` of motions: CSV, and JSON in the layout of trajectory_msgs/JointTrajectory."""

import csv
import json
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
import tomli_w
from rigid_robots import ROBOTS, with_motion
from tables_3d import pin, planar

from ffrobot import Results
from ffrobot.exchange.export import export_file
from ffrobot.exchange.motion import JointMotion, csv_text, joint_trajectory, robot_motion

# Fields in the order of the message definitions of ROS 2 (common_interfaces: trajectory_msgs/msg).
TRAJECTORY = ["header", "joint_names", "points"]
POINT = ["positions", "velocities", "accelerations", "effort", "time_from_start"]


@pytest.fixture(scope="module")
def ur5(tmp_path_factory, ffrobot):
    """Results of a spatial scene: six joints, each with a motor."""
    folder = tmp_path_factory.mktemp("ur5")
    ffrobot.ok("import", ROBOTS / "ur5.urdf", "-o", folder)
    scene = folder / "scene.toml"
    names = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint"]
    motion = [dict.fromkeys([*names, "wrist_3_joint"], value) for value in (0.1, 0.2, 0.3)]
    text = with_motion(scene.read_text(), *motion)
    scene.write_text(text.replace("end = 1e-3", "end = 2.1").replace("step = 1e-3", "step = 0.7"))
    ffrobot.ok("solve", scene)
    return scene.with_suffix(".results.h5")


@pytest.fixture(scope="module")
def crank(solved):
    """Results of a planar closed loop whose slider is driven along its path: no joint has a motor."""
    return solved("slider_crank").folder / "scene.results.h5"


def table(path):
    head, *rows = csv.reader(path.read_text().splitlines())
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))


@pytest.mark.parametrize("kind", ["ur5", "crank"])
def test_csv_has_every_digit(kind, request, ffrobot, tmp_path):
    results = request.getfixturevalue(kind)
    ffrobot.ok("export", results, "--format", "csv", "-o", tmp_path / "out.csv")
    found = table(tmp_path / "out.csv")
    with h5py.File(results) as file:
        np.testing.assert_array_equal(found.pop("time"), file["inverse/time"])
        for name, joint in file["inverse/joints"].items():
            for key in ("coordinate", "rate", "moment"):
                if key in joint:
                    np.testing.assert_array_equal(found.pop(f"{name}.{key}"), joint[key])
    assert found == {}


@pytest.mark.parametrize("kind", ["ur5", "crank"])
def test_joint_trajectory_is_the_message(kind, request, ffrobot, tmp_path):
    results = request.getfixturevalue(kind)
    done = ffrobot.ok("export", results, "--format", "joint-trajectory", "-o", tmp_path / "out.json")
    message = json.loads((tmp_path / "out.json").read_text())
    assert list(message) == TRAJECTORY
    points, names = message["points"], message["joint_names"]
    assert all(list(point) == POINT for point in points)
    with h5py.File(results) as file:
        group = file["inverse"]
        driven = {name for name, joint in group["joints"].items() if "moment" in joint}
        assert set(names) == (driven or {name for name, joint in group["joints"].items() if "coordinate" in joint})
        for key, ours in (("positions", "coordinate"), ("velocities", "rate"), ("effort", "moment")):
            rows = [group[f"joints/{name}/{ours}"][()] for name in names if ours in group[f"joints/{name}"]]
            expected = np.stack(rows, axis=1) if rows else np.zeros((len(points), 0))
            np.testing.assert_array_equal(np.array([point[key] for point in points]), expected)
        stamps = [point["time_from_start"] for point in points]
        seconds = [stamp["sec"] + 1e-9 * stamp["nanosec"] for stamp in stamps]
        np.testing.assert_allclose(seconds, group["time"], atol=0.6e-9)
        assert all(0 <= stamp["nanosec"] < 1_000_000_000 for stamp in stamps)
    assert ("no torque of a motor is known: effort is left empty" in done.stdout) == (not driven)


def test_the_side_of_a_compliant_gear_is_chosen(ffrobot, tmp_path):
    """The path itself on the side of the motor, unless the other one is asked for; a table has both.

    Of an arm that sags behind a compliant gear, whose motor follows a path, with a rigid gear beyond.
    """
    scene, geared = tmp_path / "scene.toml", tmp_path / "scene.results.h5"
    a = {"mass": 2.0, "inertia": 0.1, "center": [0.4, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.8, 0.0]}}
    b = {"mass": 0.1, "inertia": 1e-3, "center": [0.1, 0.0], "points": {"root": [0.0, 0.0]}}
    bodies = [{"name": name, "rigid": rigid} for name, rigid in (("a", a), ("b", b))]
    joints = [
        pin("hub", "ground", "a.root", gear_ratio=50.0, rotor_inertia=1e-5, stiffness=2e3, damping=2.0),
        pin("elbow", "a.tip", "b.root", gear_ratio=30.0, rotor_inertia=1e-5),
    ]
    paths = [
        {"name": "t", "motor": "hub", "via": [0.0, 0.5], "duration": 0.4},
        {"name": "e", "joint": "elbow", "value": "t**3"},
    ]
    run = {"name": "run", "kind": "pcid", "end": 0.5, "output_step": 0.05}
    scene.write_text(tomli_w.dumps(planar(bodies, joints, run, trajectory=paths, initial={"state": "static"})))
    ffrobot.ok("solve", scene)
    with h5py.File(geared) as file:
        target, joint = file["run/trajectories/t/target"][()], {k: v[()] for k, v in file["run/joints/hub"].items()}
        elbow = file["run/joints/elbow/coordinate"][()]
    assert target.shape == joint["coordinate"].shape
    np.testing.assert_allclose(joint["motor_coordinate"], target, atol=1e-9)
    assert np.abs(joint["coordinate"] - target).min() > 1e-3
    for options, prefix in (((), "motor_"), (("--side", "motor"), "motor_"), (("--side", "joint"), "")):
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.json"
        done = ffrobot.ok("export", geared, "--format", "joint-trajectory", *options, "-o", path)
        points = json.loads(path.read_text())["points"]
        for key, of in (("positions", f"{prefix}coordinate"), ("velocities", f"{prefix}rate"), ("effort", "moment")):
            np.testing.assert_array_equal([point[key][0] for point in points], joint[of])
        np.testing.assert_array_equal([point["positions"][1] for point in points], elbow)
        assert 'positions of "hub" are' in done.stdout
        assert f"--side {'joint' if prefix else 'motor'} takes the other side" in " ".join(done.stdout.split())
    ffrobot.ok("export", geared, "--format", "csv", "-o", tmp_path / "out.csv")
    found = table(tmp_path / "out.csv")
    for key in ("motor_coordinate", "motor_rate", "motor_moment"):
        np.testing.assert_array_equal(found[f"hub.{key}"], joint[key])


def test_what_motors_do_before_the_path_comes_first(ur5):
    """The message begins at 0, where motions before the path are at t < 0."""
    motion = robot_motion(ur5, None)
    early, remarks = joint_trajectory(replace(motion, time=motion.time - 0.25))
    assert (early, ()) == joint_trajectory(motion)
    assert remarks == ("time_from_start 0 is t = -0.25 s, when motors begin: the path does 0.25 s later",)


def test_a_rosbag2_has_the_message(ur5, ffrobot, refused, tmp_path):
    """Read again by rosbags: the message that the JSON has, to the last digit."""
    from rosbags.highlevel import AnyReader

    for file_format, name in (("rosbag2", "bag"), ("joint-trajectory", "out.json")):
        ffrobot.ok("export", ur5, "--format", file_format, "-o", tmp_path / name)
    expected = json.loads((tmp_path / "out.json").read_text())
    with AnyReader([tmp_path / "bag"]) as bag:
        ((connection, _, raw),) = bag.messages()
        assert (connection.topic, connection.msgtype) == ("/joint_trajectory", "trajectory_msgs/msg/JointTrajectory")
        message = bag.deserialize(raw, connection.msgtype)
    assert message.joint_names == expected["joint_names"]
    assert len(message.points) == len(expected["points"])
    for found, point in zip(message.points, expected["points"], strict=True):
        for key in ("positions", "velocities", "accelerations", "effort"):
            np.testing.assert_array_equal(getattr(found, key), point[key])
        duration = found.time_from_start
        assert {"sec": duration.sec, "nanosec": duration.nanosec} == point["time_from_start"]
    (tmp_path / "bag" / "metadata.yaml").write_text("mine")
    told = refused(tmp_path, "export", ur5, "--format", "rosbag2", "-o", "bag")
    assert "expected a new or empty folder, found one with files in it" in told


REFUSED = {
    'expected one of "inverse", found "invers" (did you mean "inverse"?)': ("csv", "--analysis", "invers"),
    '--format: expected one of "csv", "joint-trajectory", "rosbag2", "fmu", "c" of results': ("xls",),
    '--side: expected it with "joint-trajectory" or "rosbag2" only, found csv': ("csv", "--side", "motor"),
}


def test_what_is_refused(ur5, refused, tmp_path):
    for message, options in REFUSED.items():
        assert message in refused(tmp_path, "export", ur5, "--format", *options)
    told = "nosuch.h5: expected a scene, a modal body or a results file, found no such file"
    assert refused(tmp_path, "export", "nosuch.h5", "--format", "sid") == f"ffrobot: {told}\n"


def test_each_analysis_has_a_file_and_none_is_replaced(crank, ffrobot, tmp_path):
    """By its name; what is there is replaced with --force alone. A joint's name is no formula for spreadsheets."""
    results = tmp_path / "arm.results.h5"
    shutil.copy(crank, results)
    with Results(results) as file:
        names = [name for name in file.analyses if file.has(f"{name}/joints")]
    assert len(names) > 1
    made = [export_file(results, "csv", name, None).path for name in names]
    assert [path.name for path in made] == [f"arm.results.{name}.csv" for name in names]
    made[0].write_text("mine\n")
    done = ffrobot("export", results, "--format", "csv", "--analysis", names[0])
    assert (done.returncode, made[0].read_text()) == (2, "mine\n")
    assert f"{made[0].name}: output: expected a new name, or --force to replace it" in done.stderr
    done = ffrobot.ok("export", results, "--format", "csv", "--analysis", names[0], "--force")
    assert len(made[0].read_text().splitlines()) > 2
    motion = replace(robot_motion(results, names[0]), joints=(JointMotion("=cmd|' /C calc'!A0", *3 * (np.zeros(2),)),))
    assert csv_text(replace(motion, time=np.zeros(2)))[0].startswith("time,'=cmd|' /C calc'!A0.coordinate,")
