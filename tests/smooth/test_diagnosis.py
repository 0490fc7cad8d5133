"""What makes a robot vibrate: residual vibration by closed forms, synthetic faults of a stream, wrong input."""

import json
import re

import numpy as np
import pytest
import tomli_w
from scipy.integrate import trapezoid
from tables_3d import DOWN, ORIGIN, Y, revolute, rigid, scene

from ffrobot import InputError, smooth_motion
from ffrobot.mbs.fields.paths import averaged_step, law_in
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import load_robot
from ffrobot.smooth.diagnosis import diagnose
from ffrobot.smooth.recording import limits_of, read_recording
from ffrobot.smooth.robot import Robot
from ffrobot.smooth.servo import Servo, axis_of
from ffrobot.smooth.smoothing import Smoothed

J, OMEGA, WAY, T, SERVO, RATIO = 5.0, 2 * np.pi * 7.3, 0.6, 0.5, 20.0, 0.8


def written(tmp_path, tables):
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps({key: value for key, value in tables.items() if key != "analysis"}))
    return path


def table(path, times, **columns):
    text = np.column_stack([times, *columns.values()])
    np.savetxt(path, text, delimiter=",", header=",".join(["t", *columns]), comments="", fmt="%.12g")
    return path


def axis(tmp_path, stiffer=0.0, **more):
    """A body of J behind a gear whose vibration has OMEGA with the right stiffness."""
    gear = {"stiffness": (1 + stiffer) * J * OMEGA**2, "gear_ratio": 100.0, "rotor_inertia": 1e-5} | more
    body = rigid("b", 1.0, [J] * 3, ORIGIN, tip=[1.0, 0.0, 0.0])
    return written(tmp_path, scene([body], [revolute("hub", "ground", "b.root", **gear)], gravity=ORIGIN))


def diagnosed(robot_file, path, bandwidth=SERVO):
    """What `smooth_motion` finds without looking for better motions."""
    loaded = load_robot(robot_file)
    servo = Servo((axis_of(bandwidth, RATIO),) * len(loaded.motor_joints))
    robot, limits = Robot(loaded, servo, None, 1e-4, Watcher()), limits_of(loaded, np.inf, np.inf)
    return Smoothed(robot, diagnose(robot, read_recording(path, loaded), limits), limits, (), "")


LAWS = {
    "trapezoid": averaged_step(np.array([0.75, 0.25]) * T),
    "s-curve": averaged_step(np.array([0.7, 0.2, 0.1]) * T),
    "nonic": law_in(T, "rest-to-rest", 4),
}


@pytest.mark.parametrize(
    ("law", "stiffer", "expected", "bandwidth", "pause"),
    [("trapezoid", 0.0, 4.85094, SERVO, 0), ("trapezoid", 0.1, 1.17276, SERVO, 0),
     ("trapezoid", -0.1, 10.56507, SERVO, 0), ("s-curve", 0.0, 19.14325, SERVO, 150.0037),
     ("s-curve", 0.1, 13.04147, SERVO, 0), ("nonic", -0.1, 2.683050, SERVO, 0), ("s-curve", 0.0, 19.14325, 10.0, 0),
     ("s-curve", 0.0, 19.14325, 30.0, 0)],
)  # fmt: skip
def test_residual_vibration_of_closed_forms(tmp_path, law, stiffer, expected, bandwidth, pause):
    """|∫ θ̈ e^(−iωt) dt|/ω, mrad, by an ideal controller, times |G(iω)|; by simulation and by the linear model."""
    times = np.append(-pause, np.arange(pause == 0, 501) * 0.001)
    path = table(tmp_path / "path.csv", times, hub=WAY * LAWS[law].sample(times)[:, 0])
    found = diagnosed(axis(tmp_path, stiffer), path, bandwidth)
    s, servo = 1j * OMEGA * np.sqrt(1 + stiffer), 2 * np.pi * bandwidth
    angle = 1e-3 * expected * abs(servo**2 / (s**2 + 2 * RATIO * servo * s + servo**2))
    assert found.before.residual == pytest.approx(2 * np.sin(angle), rel=5e-4)
    assert found.before.alone[0] == pytest.approx(2 * angle, rel=5e-4)
    assert found.before.frequencies[-1, 0] == pytest.approx(abs(s) / (2 * np.pi), rel=1e-6)
    assert found.verdict.startswith("vibration of the robot: b.tip swings")
    assert "hub causes 100 %" in found.verdict
    assert found.before.even is found.before.ride  # a pause is no gap and no slow motion


def test_vibration_by_a_rail_depends_on_the_posture_of_rest(tmp_path):
    """Through the lever m c cos θ of a body behind a gear, which swings by a tenth of its own angle."""
    m, c, ends = 4.0, 0.5, np.array([0.3, 0.8])
    arm = rigid("arm", m, [0.01, 0.2, 0.2], [c, 0.0, 0.0], tip=[1.0, 0.0, 0.0])
    about, gear = 0.2 + m * c**2, {"stiffness": 3000.0, "damping": 0.5, "gear_ratio": 10.0, "rotor_inertia": 0.02}
    rail = {"name": "rail", "type": "prismatic", "between": ["ground", "base.root"], "axis": Y, "motor": True}
    bodies = [rigid("base", 1.0, [0.01] * 3, ORIGIN), arm]
    path, law = written(tmp_path, scene(bodies, [rail, revolute("hub", "base.root", "arm.root", **gear)])), TIMES / 0.25
    rows = np.outer(np.where(law < 1.0, law**2 * (3.0 - 2.0 * law), 1.0), ends)
    found = diagnosed(path, table(tmp_path / "path.csv", TIMES, rail=rows[:, 0], hub=rows[:, 1]))
    before = found.before
    lever = m * c * np.cos(ends[1]) / about
    assert before.residual > 0.1 * ends[1]
    assert before.alone[0] / before.alone[1] == pytest.approx(lever * ends[0] / ends[1], rel=1e-3)
    assert found.robot.units("/s²") == "m/s², rad/s²"
    assert [fault.text.partition(" t = ")[2] for fault in before.faults] == ["0.256 s, and once more"] * 2


def test_a_servo_follows_lines_exactly():
    """Step by step the same as the convolution of the command with the controller's own response."""
    servo, rng = Servo((axis_of(20.0, RATIO), axis_of(5.0, RATIO))), np.random.default_rng(0)
    times = np.append(0.0, np.cumsum(rng.uniform(0.005, 0.05, 30)))
    command = np.cumsum(rng.normal(0.0, 0.1, (31, 2)), axis=0)
    fine = np.linspace(0.0, times[-1], 400_001)
    for k, omega in enumerate(2 * np.pi * np.array([20.0, 5.0])):
        damped = omega * np.sqrt(1 - RATIO**2)
        response = omega**2 / damped * np.exp(-RATIO * omega * fine) * np.sin(damped * fine)
        slope = np.interp(fine, times, command[:, k]) - command[0, k]
        at = np.array([100_000, 250_000, 400_000])
        expected = [trapezoid(slope[: m + 1] * response[m::-1], dx=fine[1]) for m in at]
        found = servo.motors(times, command).sample(fine[at])[:, k] - command[0, k]
        np.testing.assert_allclose(found, expected, atol=1e-6)


LENGTH, STEP = 0.5, 0.008
TIMES = np.arange(126) * STEP


def arm(tmp_path, **of_hip):
    """Two links with compliant gears, about 8 and 25 Hz, and limits."""
    bodies = [rigid(name, 2.0, [0.06] * 3, [LENGTH / 2, 0.0, 0.0], tip=[LENGTH, 0.0, 0.0]) for name in ("a", "b")]
    gear = {"gear_ratio": 100.0, "rotor_inertia": 1e-5, "speed_limit": 3.0, "position_limit": [-3.0, 3.0]}
    joints = [
        revolute("hip", "ground", "a.root", Y, stiffness=6000.0, damping=3.0, **gear, **of_hip),
        revolute("knee", "a.tip", "b.root", Y, stiffness=2000.0, damping=1.0, **gear),
    ]
    return written(tmp_path, scene(bodies, joints, gravity=DOWN))


def motion(law, times=TIMES):
    """Hip and knee on their way, s from 0 to 1."""
    s = law.sample(times)[:, 0]
    return {"hip": 0.6 * s, "knee": 0.4 - 0.9 * s}


def test_jumps_have_their_size_wherever_they_lie(tmp_path):
    """Of a trapezoid of speed, at its ends and between two set points; shares of joints add up."""
    times = np.arange(151) * 0.008
    for at in (0.24, 0.243):
        law = averaged_step(np.array([1.2 - at, at]))
        found = diagnosed(arm(tmp_path), table(tmp_path / "path.csv", times, **motion(law, times)))
        (jump,) = (fault for fault in found.before.faults if fault.text.startswith("hip"))
        assert float(re.search(r"jumps by (\S+) rad/s²", jump.text)[1]) == pytest.approx(
            0.6 / (at * (1.2 - at)), rel=0.01
        )
        assert found.before.shares.sum() == pytest.approx(1.0, rel=1e-12)


SMOOTH = law_in(0.9, "rest-to-rest", 4)


JITTER = np.append(0.0, np.random.default_rng(2).normal(0.0, 0.0012, len(TIMES) - 1))
RIPPLE = 4e-4 * np.sin(2 * np.pi * 8.0 * TIMES) * SMOOTH.sample(TIMES, 1)[:, 0]


def stream(law=SMOOTH, late=0.0, hip=0.0, kept=slice(None), faster=1.0):
    """Stamps and rows, stamps `late` by so many s, with more at the hip, and only those that are kept."""
    rows = motion(law)
    rows["hip"] = rows["hip"] + hip
    return ((TIMES + late) / faster)[kept], {name: row[kept] for name, row in rows.items()}


def at(rows, value):
    return np.where(np.isin(np.arange(len(TIMES)), rows), value, 0.0)


FAULTS = {
    "none": ({}, set()),
    "jitter": ({"late": JITTER}, {"jitter"}),
    "doubled stamps": ({"late": at([40, 60], -STEP)}, {"doubled stamps"}),
    "steps back": ({"late": at([50], -3 * STEP - 0.001)}, {"steps back"}),
    "gap": ({"kept": np.r_[0:55, 60:126]}, {"gap"}),
    "position": ({"hip": np.where(TIMES > 0.3, 0.006, 0.0)}, {"jump of position"}),
    "speed": ({"law": averaged_step(np.array([0.9]))}, {"jump of speed"}),
    "acceleration": ({"law": averaged_step(np.array([0.6, 0.3]))}, {"jump of acceleration"}),
    "coarse": ({"kept": slice(None, None, 5)}, {"coarse sampling"}),
    "limit": ({"faster": 2.0}, {"limit"}),
    "place": ({"hip": 2.9}, {"limit"}),
    "resonance": ({"hip": RIPPLE}, {"resonance"}),
    "noise": ({"hip": np.random.default_rng(3).normal(0.0, 2e-4, len(TIMES))}, {"noise"}),
}


@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_has_its_diagnosis(tmp_path, name):
    changes, expected = FAULTS[name]
    times, rows = stream(**changes)
    found = diagnosed(arm(tmp_path), table(tmp_path / "path.csv", times, **rows))
    assert {fault.kind for fault in found.before.faults} == expected
    if name == "none":
        assert found.verdict.startswith("not vibration of the robot")
        assert found.verdict.endswith("the stream has no fault")


def test_jitter_is_told_apart_from_the_motion(tmp_path):
    """At even times the robot does what it does on the set points before their stamps jittered."""
    rows = motion(averaged_step(np.array([0.6, 0.3])))
    as_planned, found = (
        diagnosed(arm(tmp_path), table(tmp_path / "path.csv", TIMES + late, **rows)) for late in (0.0, JITTER)
    )
    left = found.before.even.settling.residual
    assert left == pytest.approx(as_planned.before.residual, rel=0.05)
    assert found.before.residual > 1.2 * left
    assert found.verdict.endswith(f"Sent at even times, the same set points leave {1e3 * left:.3g} mm")
    assert "even times" not in as_planned.verdict


def test_joints_go_by_name_in_any_order_and_file(tmp_path, ffrobot):
    """A JointTrajectory in YAML with joints the other way round, in degrees, by the command: what the CSV is."""
    rows = motion(averaged_step(np.array([0.6, 0.3])))
    scene_file = arm(tmp_path)
    points = [
        {"positions": [float(np.degrees(rows[name][k])) for name in ("knee", "hip")],
         "time_from_start": {"sec": 0, "nanosec": round(1e9 * TIMES[k])}}
        for k in range(len(TIMES))
    ]  # fmt: skip
    message = {"joint_names": ["knee", "hip"], "points": points}
    (tmp_path / "path.yaml").write_text(json.dumps(message))
    expected = diagnosed(scene_file, table(tmp_path / "path.csv", TIMES, **rows))
    found = smooth_motion(scene_file, tmp_path / "path.yaml", degrees=True)
    assert found.before.residual == pytest.approx(expected.before.residual, rel=1e-6)
    printed = ffrobot.ok("smooth", scene_file, "--path", tmp_path / "path.yaml", "--degrees").stdout
    assert "jump of acceleration: knee: acceleration jumps by" in printed
    assert "vibration of the robot: b.tip swings by" in printed
    assert (tmp_path / "scene.smooth.png").exists()
    page = (tmp_path / "scene.smooth.report.html").read_text(encoding="utf-8")
    assert f"<b>{found.verdict}</b>" in page
    for text in (*(fault.text for fault in found.before.faults), *(one.name for one in found.candidates)):
        assert text in page
    assert '<img src="data:image/svg+xml;base64,' in page
    assert len(page) < 1e6  # without Plotly


TWO = "0,0,0\n0.1,0.1,0.1\n0.2,0.2,0.2\n0.3,0.3,0.3\n"


@pytest.mark.parametrize(
    ("text", "keys", "expected"),
    [
        ("t,hip,ankle\n" + TWO, {}, 'found none of "knee" among "hip", "ankle"'),
        ("t,value\n0,0\n0.1,1\n0.2,2\n0.3,3\n", {}, 'found none of "hip", "knee"'),
        ("t,hip,knee\n0,0,0\n0.1,10,20\n0.2,20,40\n0.3,30,80\n", {}, "found \"hip\" from 0 to 30: --degrees"),
        ("t,hip [deg],knee\n" + TWO, {"degrees": True}, '--degrees: expected a header without units, found "deg"'),
        ("t,hip,knee\n0,1,1\n0.1,1,1\n0.2,1,1\n0.3,1,1\n", {}, "expected joints that move, found none"),
        ("t,hip,knee\n0,0,0\n0,1,1\n0,2,1\n0.3,3,1\n", {}, "4 set points with times that increase, found 2"),
        ("t,hip,knee\n" + TWO, {"servo": {"hip": 20.0}}, 'of each of "hip", "knee", found none of "knee"'),
        ("t,hip,knee\n" + TWO, {"servo": {"hip": 20.0, "kne": 1.0}}, 'found "kne" (did you mean "knee"?)'),
        ("t,hip,knee\n" + TWO, {"servo": "1 / 1"}, "with at least two poles more than zeros, found \"1 / 1\""),
        ("t,hip,knee\n" + TWO, {"servo": "1 / 1e-4 -1e-2 1"}, "stable"),
        ("t,hip,knee\n" + TWO, {"servo": "axis.csv"}, "axis.csv"),
        ("t,hip,knee\n" + TWO, {"damping_ratio": 0.0}, "a damping ratio above 0, found 20 Hz and 0"),
        ("t,hip,knee\n" + TWO, {"point": "b.tool"}, 'expected one of'),
    ],
)  # fmt: skip
def test_wrong_input(tmp_path, text, keys, expected):
    (tmp_path / "path.csv").write_text(text)
    with pytest.raises(InputError) as error:
        smooth_motion(arm(tmp_path), tmp_path / "path.csv", **keys)
    assert expected in str(error.value)


def test_degrees_are_those_of_turning_joints_and_their_rates_alone(tmp_path):
    slide = {"name": "slide", "type": "prismatic", "between": ["a.tip", "b.root"], "axis": Y}
    bodies = [rigid(name, 1.0, [0.1] * 3, ORIGIN, tip=ORIGIN) for name in ("a", "b")]
    file = written(tmp_path, scene(bodies, [revolute("hip", "ground", "a.root", Y), slide]))
    points = [
        {"positions": [90.0 * t, 0.2 * t], "velocities": [90.0, 0.2], "time_from_start": {"sec": t, "nanosec": 0}}
        for t in range(5)
    ]
    (tmp_path / "path.yaml").write_text(json.dumps({"joint_names": ["hip", "slide"], "points": points}))
    found = read_recording(tmp_path / "path.yaml", load_robot(file), is_in_degrees=True)
    np.testing.assert_allclose(found.values[-1], [2 * np.pi, 0.8])
    np.testing.assert_allclose(found.rates, [[np.pi / 2, 0.2]] * 5)
