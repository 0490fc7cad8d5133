"""Motions that leave less vibration: inversion by closed forms, what candidates keep, what is written, a case."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.integrate import trapezoid
from scipy.signal import lsim
from test_diagnosis import LAWS, LENGTH, OMEGA, RATIO, SERVO, STEP, TIMES, WAY, J, T, arm, axis, motion, table, written

from ffrobot import InputError, SolveError, smooth_motion
from ffrobot.mbs.fields.paths import averaged_step, polynomial_law
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import load_robot
from ffrobot.smooth.candidates import distances
from ffrobot.smooth.robot import Robot
from ffrobot.smooth.servo import Servo, axis_of


def robot(tmp_path, stiffer=0.0):
    servo = Servo((axis_of(SERVO, RATIO),))
    return Robot(load_robot(axis(tmp_path, stiffer)), servo, None, 1e-4, Watcher())


def test_inversion_leaves_nothing_or_as_much_as_the_stiffness_is_off(tmp_path):
    """κ |∫ θ̈ e^(−iωt) dt|/ω of the nonic, whatever the controller; of the S-curve 19 mrad."""
    times, law = np.arange(501) * 0.001, LAWS["nonic"].along(np.array([WAY]))
    model = robot(tmp_path)
    model.ride(times, law.sample(times))
    command, moments = model.inverted(times, law)
    for stiffer, expected, tolerance in ((0.0, 0.0, 1e-4 * 19.14325), (0.1, 0.0686860, 1e-3), (-0.1, 0.268305, 1e-3)):
        found = robot(tmp_path, stiffer).ride(times, command).settling.residual
        assert found == pytest.approx(2e-3 * expected, abs=2e-3 * tolerance), stiffer
    np.testing.assert_allclose(moments[:, 0], (5.0 + 0.1) * law.sample(times, 2)[:, 0], atol=0.02 * abs(moments).max())


def weight(set_points):
    """Torques (2,), N·m, that bear the arm at rest, whose joints are off by them over the stiffness of gears."""
    torque = np.zeros(2)
    for _ in range(20):
        hip, knee = set_points - torque / [6000.0, 2000.0]
        fore = -2.0 * 9.81 * LENGTH / 2 * np.cos(hip + knee)
        torque = np.array([fore - 2.0 * 9.81 * 1.5 * LENGTH * np.cos(hip), fore])
    return torque


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("found")
    path = table(folder / "path.csv", TIMES, **motion(averaged_step(np.array([0.7, 0.2]))))
    return smooth_motion(arm(folder), path, acceleration=6.0)


def test_candidates_settle_and_keep_path_and_limits(found):
    assert found.before.residual > 1e-3
    assert {one.name.split(" ")[0].rstrip(",") for one in found.candidates} == {
        "averaged", "slower", "shaped", "inverted"
    }  # fmt: skip
    for one in found.candidates:
        assert one.residual < 1e-4
        assert one.settled < np.inf
        assert one.excess <= 1.0
        assert one.off_path < 0.01
        np.testing.assert_allclose(one.command[[0, -1]], found.before.recording.values[[0, -1]], atol=1e-9)
    assert found.best.settled == min(one.settled for one in found.candidates)
    inverted = next(one for one in found.candidates if one.name.startswith("inverted"))
    assert inverted.residual < 1e-4 * found.before.residual
    for k in (0, -1):
        np.testing.assert_allclose(inverted.moments[k], weight(inverted.command[k]), rtol=1e-6)


@pytest.mark.parametrize("name", ["new.json", "new.csv", "new.rosbag2"])
def test_what_is_written_is_a_stream_without_faults(tmp_path, found, name):
    found.write(tmp_path / name)
    again = smooth_motion(found.robot.file, tmp_path / name)
    assert again.verdict.startswith("not vibration of the robot")
    assert again.before.faults == ()
    assert again.before.residual == pytest.approx(found.best.residual, abs=1e-6)
    if name == "new.json":  # controllers of ROS 2 ask for a motion that ends at rest
        points = json.loads((tmp_path / name).read_text())["points"]
        for point in (points[0], points[-1]):
            assert point["velocities"] == [0.0, 0.0]


def test_another_motion_is_written_by_its_kind(tmp_path, ffrobot):
    path = table(tmp_path / "path.csv", TIMES, hub=WAY * LAWS["trapezoid"].sample(TIMES)[:, 0])
    printed = ffrobot.ok(
        "smooth", axis(tmp_path), "--path", path, "--write", "slower", "-o", tmp_path / "new.csv"
    ).stdout
    assert "new.csv: slower by" in " ".join(printed.split())
    again = smooth_motion(tmp_path / "scene.toml", path, kind="slower")
    assert again.best.name.startswith("slower")
    assert again.best.settled > min(one.settled for one in again.candidates)
    new = np.loadtxt(tmp_path / "new.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(new[:, :2], np.column_stack([again.best.times, again.best.command]), atol=1e-9)
    with pytest.raises(InputError, match=r'kind: expected one of .*, found "slow" \(did you mean "slower"'):
        smooth_motion(tmp_path / "scene.toml", path, kind="slow")


def test_distances_are_from_the_line_between_set_points():
    """Of points on a straight motion none, whatever its set points; of others by the perpendicular."""
    line = np.outer([0.0, 0.1, 0.4, 0.6, 1.0, 1.0], [3.0, 4.0])
    on = np.outer(np.linspace(0.0, 1.0, 57), [3.0, 4.0])
    np.testing.assert_allclose(distances(on, line), 0.0, atol=1e-15)
    np.testing.assert_allclose(distances(on + np.array([-0.08, 0.06]), line), 0.1, rtol=1e-12)
    np.testing.assert_allclose(distances(np.array([[3.3, 4.4], [-0.3, -0.4]]), line), 0.5, rtol=1e-12)


def test_a_file_in_the_way_is_seen_before_anything_is_simulated(tmp_path, ffrobot):
    axis(tmp_path)
    table(tmp_path / "path.csv", TIMES, hub=WAY * LAWS["trapezoid"].sample(TIMES)[:, 0])
    (tmp_path / "new.csv").write_text("mine")
    (tmp_path / "bag.rosbag2").mkdir()
    (tmp_path / "bag.rosbag2" / "mine").touch()
    for name, expected in (
        ("new.csv", "--force to replace it"), ("bag.rosbag2", "a new or empty folder"), ("new.txt", 'found "new.txt"')
    ):  # fmt: skip
        done = ffrobot("smooth", "scene.toml", "--path", "path.csv", "-o", name, cwd=tmp_path)
        assert done.returncode == 2
        assert expected in done.stderr
        assert "verdict" not in done.stdout


def test_a_flexible_link_vibrates_by_the_closed_form_under_its_motor_or_behind_an_inverted_gear(tmp_path):
    """The first mode of a cantilever, see tests/cases/test_settling.py; behind the gear its root follows the motion."""
    length, way, beta = 0.6, 0.1, 1.8751040687
    link = beam_link(length, rectangle(0.004, 0.02), 8, modes={"count": 2, "family": "in-plane-bending"})
    joint = {"name": "hub", "type": "revolute", "between": ["ground", "b.root"], "motor": True}
    tables = {"name": "arm", "gravity": [0.0, 0.0], "body": [{"name": "b", "link": link}], "joint": [joint]}
    times = np.arange(501) * 0.001
    path = table(tmp_path / "path.csv", times, hub=way * LAWS["trapezoid"].sample(times)[:, 0])
    found = smooth_motion(written(tmp_path, tables), path, servo=SERVO, damping_ratio=RATIO)
    omega, servo = (beta / length) ** 2 * np.sqrt(70e9 / 2700 / 12) * 0.004, 2 * np.pi * SERVO
    step = way * np.prod(np.abs(np.sinc(omega * T * np.array([0.75, 0.25]) / (2 * np.pi))))
    gain = abs(servo**2 / (servo**2 - omega**2 + 2j * RATIO * servo * omega))
    assert found.before.residual == pytest.approx(2 * 4 * length / beta**2 * step * gain, rel=5e-4)
    shaped = next(one for one in found.candidates if one.name.startswith("shaped"))
    assert shaped.residual < 0.01 * found.before.residual
    assert not any(one.name.startswith("inverted") for one in found.candidates)

    joint |= {"stiffness": 100.0, "gear_ratio": 100.0, "rotor_inertia": 1e-4}
    found = smooth_motion(written(tmp_path, tables), path, servo=SERVO, damping_ratio=RATIO)
    inverted = next(one for one in found.candidates if one.name.startswith("inverted"))
    span = STEP * np.ceil(float(re.search(r"over (\d+) ms", inverted.name)[1]) / (1e3 * STEP))
    bell, fine = polynomial_law(5).moved(span), np.linspace(0.0, span, 4001)
    averaged = abs(trapezoid(bell.sample(fine, 1)[:, 0] * np.exp(-1j * omega * fine), fine))
    assert inverted.residual == pytest.approx(2 * 4 * length / beta**2 * step * averaged, rel=0.05)
    assert inverted.residual < 1e-4
    assert inverted.settled < np.inf
    again = smooth_motion(found.robot.file, table(tmp_path / "new.csv", inverted.times, hub=inverted.command[:, 0]))
    assert again.before.residual == pytest.approx(inverted.residual, rel=1e-3)
    assert again.candidates == ()  # nothing to be improved
    with pytest.raises(SolveError, match="expected a motion to be improved, found: not vibration of the robot"):
        again.write(tmp_path / "more.csv")


def test_torques_are_compared_with_limits_of_motors(tmp_path):
    """T/θ_cmd = G (I s² + K J s²/(J s² + K)) of one axis; with half of its peak as the limit."""
    fine, servo, K, inertia = np.linspace(0.0, 1.0, 20_001), 2 * np.pi * 20.0, J * OMEGA**2, 0.1
    command = WAY * LAWS["nonic"].sample(TIMES)[:, 0]
    moving = [inertia * J, 0.0, (inertia + J) * K]
    poles = np.polymul([1.0, 1.6 * servo, servo**2], [J, 0.0, K])
    _, torque, _ = lsim((servo**2 * np.append(moving, [0.0, 0.0]), poles), np.interp(fine, TIMES, command), fine)
    peak = np.abs(torque).max()
    path = table(tmp_path / "path.csv", TIMES, hub=command)
    found = smooth_motion(axis(tmp_path, moment_limit=0.5 * peak), path, settled=1e-3)
    assert found.own.torque == pytest.approx(2.0, rel=1e-3)
    assert [fault.kind for fault in found.before.faults] == ["limit"]
    assert f"hub: torque of up to {found.own.torque * 0.5 * peak:.4g}" in found.before.faults[0].text
    assert found.best.torque <= 1.0
    for one in found.candidates:
        if one.moments is not None:
            assert one.torque == pytest.approx(np.abs(one.moments).max() / (0.5 * peak), rel=0.02)


def test_inversion_is_of_measured_controllers_too(tmp_path):
    """Four poles, two zeros and a delay, fitted to a table: links follow to what is left of them by the closed form."""
    s = 2j * np.pi * np.linspace(1.0, 60.0, 60)
    numerator, denominator = [1.6e-4, 2.5e-3, 1.0], np.polymul([6.3e-5, 1.3e-2, 1.0], [1.2e-4, 3.3e-3, 1.0])
    G = np.exp(-0.004 * s) * np.polyval(numerator, s) / np.polyval(denominator, s)
    columns = np.transpose([s.imag / (2 * np.pi), abs(G), np.degrees(np.angle(G))])
    np.savetxt(tmp_path / "g.csv", columns, delimiter=",", header="frequency,magnitude,phase", comments="")
    polynomials = " / ".join(" ".join(f"{c:.17g}" for c in of) for of in (numerator, denominator, [0.004]))
    given, fitted = axis_of(polynomials, RATIO), axis_of(str(tmp_path / "g.csv"), RATIO)
    np.testing.assert_allclose(fitted.at(s), G, atol=1e-6)
    assert "4 poles, delay 4 ms" in fitted.words
    np.testing.assert_allclose(given.at(s), G, rtol=1e-9)

    times, law = np.arange(501) * 0.001, LAWS["nonic"].along(np.array([WAY]))
    for servo in (fitted, axis_of("-0.004 1 / 1e-6 3e-4 3e-2 1", RATIO)):  # and with a zero to the right
        model = Robot(load_robot(axis(tmp_path)), Servo((servo,)), None, 1e-4, Watcher())
        model.ride(times, law.sample(times))
        command, _ = model.inverted(times, law)
        ride = model.ride(0.001 * np.arange(len(command)), command)
        assert ride.settling.residual < 2e-3 * 1e-4 * 19.14325


def test_controllers_whose_zeros_ring_for_ever_are_not_inverted(tmp_path):
    """1 + (s/100)² is on the imaginary axis: no set points make up for what it stops."""
    path = table(tmp_path / "path.csv", TIMES, hub=WAY * LAWS["trapezoid"].sample(TIMES)[:, 0])
    found = smooth_motion(axis(tmp_path), path, servo="1e-4 0 1 / 1e-8 4e-6 6e-4 4e-2 1", settled=1e-3)
    assert found.best.residual < 1e-3
    assert not any(one.name.startswith("inverted") for one in found.candidates)


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        (lambda f, G: (f, 20 * np.log10(abs(G)) + 60, np.degrees(np.angle(G))), "not dB"),
        (lambda f, G: (f, abs(G), -np.degrees(np.angle(G))), "degrees, negative where motors lag"),
        (lambda f, G: (0 * f + 1, abs(G), np.degrees(np.angle(G))), "at 4 or more frequencies"),
    ],
)
def test_tables_that_are_no_response_of_a_controller(tmp_path, ffrobot, columns, expected):
    """And no command writes over one."""
    f = np.linspace(1.0, 60.0, 40)
    G, path = axis_of(SERVO, RATIO).at(2j * np.pi * f), tmp_path / "g.csv"
    np.savetxt(path, np.transpose(columns(f, G)), delimiter=",", header="frequency,magnitude,phase", comments="")
    with pytest.raises(InputError, match=expected):
        axis_of(str(path), RATIO)
    axis(tmp_path)
    done = ffrobot("smooth", "scene.toml", "--servo", "g.csv", "-o", "g.csv", "--force", cwd=tmp_path)
    assert done.returncode == 2


CASE = Path(__file__).parents[2] / "cases/ur5_streamed"


@pytest.mark.nightly
def test_numbers_of_the_readme(tmp_path):
    shutil.copytree(CASE, tmp_path, dirs_exist_ok=True)
    subprocess.run([sys.executable, "make_motions.py"], cwd=tmp_path, check=True)
    plan, logged = (smooth_motion(tmp_path / "arm.toml", tmp_path / name) for name in ("plan.csv", "logged.csv"))
    text = (CASE / "README.md").read_text(encoding="utf-8")
    table = re.findall(r"\| ([a-z ]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|", text)
    printed = {name: list(map(float, numbers)) for name, *numbers in table}
    settling = plan.before.ride.settling
    rows = {"as it is": [settling.path_end, settling.path_end + settling.time_to, 1e3 * plan.before.residual]}
    for one in plan.candidates:
        rows[re.match(r"\w+", one.name)[0]] = [one.times[-1], one.settled, 1e3 * one.residual]
    assert rows.keys() == printed.keys()
    for name, row in rows.items():
        assert row[:2] == pytest.approx(printed[name][:2], rel=5e-3), name
        assert row[2] == pytest.approx(printed[name][2], rel=0.02, abs=1e-5), name  # mm: the tolerance of integration
    assert 1e3 * logged.before.residual == pytest.approx(6.0, rel=0.02)
    assert [fault.kind for fault in logged.before.faults] == ["jitter", *["limit"] * 3]
    assert 1e3 * logged.before.even.settling.residual == pytest.approx(printed["as it is"][2], rel=0.02)
    assert logged.best.residual < 1e-4
