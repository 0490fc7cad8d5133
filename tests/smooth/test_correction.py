"""Motions that leave less vibration: inversion by closed forms, what candidates keep, what is written."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from test_diagnosis import LAWS, RATIO, SERVO, TIMES, WAY, T, arm, axis, motion, table, written

from ffrobot import InputError, smooth_motion
from ffrobot.mbs.fields.paths import averaged_step
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import load_robot
from ffrobot.smooth.robot import Robot
from ffrobot.smooth.servo import Servo


def robot(tmp_path, stiffer=0.0):
    servo = Servo(2 * np.pi * np.array([SERVO]), RATIO)
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


@pytest.mark.parametrize("name", ["new.json", "new.csv", "new.rosbag2"])
def test_what_is_written_is_a_stream_without_faults(tmp_path, found, name):
    found.write(tmp_path / name)
    again = smooth_motion(found.robot.file, tmp_path / name)
    assert again.verdict.startswith("not vibration of the robot")
    assert again.before.faults == ()
    assert again.before.residual == pytest.approx(found.best.residual, abs=1e-6)


def test_other_endings_are_rejected(tmp_path, found):
    with pytest.raises(InputError, match=r'expected a name that ends in .*found "new\.txt"'):
        found.write(tmp_path / "new.txt")


def test_a_flexible_link_vibrates_by_the_closed_form_and_inversion_says_that_it_leaves_that(tmp_path):
    """The first mode of a cantilever, see tests/cases/test_settling.py; gears alone are inverted, links are not."""
    length, way, beta = 0.6, 0.1, 1.8751040687
    link = beam_link(length, rectangle(0.004, 0.02), 8, modes={"count": 2, "family": "in-plane-bending"})
    joint = {"name": "hub", "type": "revolute", "between": ["ground", "b.root"], "motor": True}
    tables = {"name": "arm", "gravity": [0.0, 0.0], "body": [{"name": "b", "link": link}], "joint": [joint]}
    times = np.arange(501) * 0.001
    path = table(tmp_path / "path.csv", times, hub=way * LAWS["trapezoid"].sample(times)[:, 0])
    found = smooth_motion(written(tmp_path, tables), path, bandwidth=SERVO, damping_ratio=RATIO)
    omega, servo = (beta / length) ** 2 * np.sqrt(70e9 / 2700 / 12) * 0.004, 2 * np.pi * SERVO
    step = way * np.prod(np.abs(np.sinc(omega * T * np.array([0.75, 0.25]) / (2 * np.pi))))
    gain = abs(servo**2 / (servo**2 - omega**2 + 2j * RATIO * servo * omega))
    assert found.before.residual == pytest.approx(2 * 4 * length / beta**2 * step * gain, rel=5e-4)
    shaped = next(one for one in found.candidates if one.name.startswith("shaped"))
    assert shaped.residual < 0.01 * found.before.residual
    assert not any(one.name.startswith("inverted") for one in found.candidates)

    joint |= {"stiffness": 100.0, "gear_ratio": 100.0, "rotor_inertia": 1e-4}
    found = smooth_motion(written(tmp_path, tables), path, bandwidth=SERVO, damping_ratio=RATIO)
    inverted = next(one for one in found.candidates if one.name.startswith("inverted"))
    again = smooth_motion(found.robot.file, table(tmp_path / "new.csv", inverted.times, hub=inverted.command[:, 0]))
    assert again.before.residual == pytest.approx(inverted.residual, rel=1e-3)
    assert inverted.residual > 1e-3
    assert inverted.settled == np.inf
    assert found.best is not inverted
    assert found.best.residual < 0.1 * found.before.residual
