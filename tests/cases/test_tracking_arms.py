"""Motors and patches on a path of 3D scenes: replays, limits, and input that does not fit."""

import re
from pathlib import Path

import numpy as np
import pytest

import ffrobot
from ffrobot.common.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "tracking.md"


@pytest.fixture
def scene(tmp_path):
    """The soft arm of the page, its text changed by pairs."""
    blocks = dict(re.findall(r"`(\w+\.toml)`:\n\n```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL))

    def write(*changes, link=()):
        for name, text in blocks.items():
            for old, new in changes if name == "scene.toml" else link:
                assert old in text
                text = text.replace(old, new)
            (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / "scene.toml"

    return write


def off_path(results, name):
    found, wanted = (results[f"{of}/points/arm.tip/position"] for of in (name, "carried"))
    return float(np.abs(found - wanted).max())


def test_replay_follows_the_path(scene):
    """Torques and voltages alone, in the nonlinear equations: 1e-8 of the way, at rest before and after."""
    path = scene(
        ("tolerance = 1e-4", "tolerance = 1e-6"),
        ('actuation = "carried"\n', 'actuation = "carried"\ntolerance = 1e-8\n'),
    )
    with ffrobot.solve(path) as results:
        way = float(np.ptp(results["carried/points/arm.tip/position"]))
        assert off_path(results, "replay") < 1e-8 * way
        assert np.abs(results["carried/trajectories/tip/error"]).max() < 1e-12
        assert "off its path" in results.verdict["replay"].answer
        assert off_path(results, "without_patches") > 1e-4
        y = np.sin(np.pi / 4 * np.array([0.0, 1.0]) - np.pi / 8)
        assert np.abs(results["carried/points/arm.tip/position"][[0, -1], 1] - y).max() < 1e-12
        about = results.attributes("carried/tracking")
        modal, rate = (results[f"carried/bodies/arm/{name}"] for name in ("modal", "modal_velocity"))
        assert np.abs(rate[[0, -1]]).max() < 1e-9 * np.abs(rate).max()
        assert np.abs(modal[[0, -1]]).max() < 1e-9 * np.abs(modal).max()
        voltage = results["carried/pzt/arm/voltage"]
        assert np.abs(voltage).max() <= 200.0 * (1 + 1e-9)
        assert np.abs(voltage[[0, -1]]).max() < 1e-6
        # from rest to rest all work is dissipated: 2 ζ ω ṗ² of each mode
        omega = 2 * np.pi * np.array(results.modal_body("arm").frequency[:2])
        power = (2 * 0.005 * omega * rate**2).sum(axis=1)
        time = results.time("carried/pzt/arm/voltage")
        dissipated = float(np.diff(time) @ (power[1:] + power[:-1]) / 2)
        assert about["motor_work"] + about["patch_work"] == pytest.approx(dissipated, rel=2e-3)  # by 2 ms


def test_limits_that_are_too_small(scene):
    """The least voltage is found all the same, and said."""
    path = scene(("limit = 200.0", "limit = 100.0"))
    with ffrobot.solve(path) as results:
        about = results.attributes("carried/tracking")
        assert about["objective"] == "least-voltage"
        assert about["least_share"] == pytest.approx(about["least_voltage"] / 100.0)
        assert 1.5 < about["least_share"] < 1.7
        required = results["carried/pzt/arm/required_voltage"]
        assert np.abs(required).max() == pytest.approx(about["least_voltage"], rel=1e-3)
        (warning,) = [text for text in results.warnings["carried"] if "times these would do" in text]
    more = float(re.search(r"or (.*) ms more", warning)[1]) / 1e3
    keys = f"tolerance = 1e-4\npre_actuation = {more}\npost_actuation = {more}\noutput_step = 1e-4"
    path = scene(("limit = 200.0", "limit = 100.0"), ("output_step = 0.002\ntolerance = 1e-4", keys))
    with ffrobot.solve(path) as results:
        about = results.attributes("carried/tracking")
        assert about["objective"] == "effort"
        assert 0.9 < about["least_share"] <= 1.0


def test_time_before_and_after_lowers_voltages(scene):
    """By e^{−s t} with the slowest zero, about 65 1/s, as far as voltages that begin at zero are free to."""
    shares = []
    for time in (0.0, 0.02):
        keys = f'objective = "least-voltage"\npre_actuation = {time}\npost_actuation = {time}\ntolerance = 1e-4'
        path = scene(("tolerance = 1e-4", keys))
        with ffrobot.solve(path) as results:
            shares.append(float(results.attributes("carried/tracking")["least_share"]))
            assert off_path_of_first(results) < 1e-9
    assert shares[1] / shares[0] == pytest.approx(np.exp(-65 * 0.02), rel=0.25)


def off_path_of_first(results):
    """m, of the tip from where the path begins, while actuators act before it."""
    time = results.time("carried/points/arm.tip/position")
    y = results["carried/points/arm.tip/position"][time <= 0, 1]
    return float(np.abs(y - np.sin(-np.pi / 8)).max())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([("35*(t/0.6)**4 - 84*(t/0.6)**5 + 70*(t/0.6)**6 - 20*(t/0.6)**7", "t/0.6")], "a path at rest"),
        ([("motor = true\nmoment_limit = 2.0         # N·m\n", "motor = false\n")], "as many motors"),
        ([("tolerance = 1e-4", 'objective = "speed"')], "objective"),
    ],
)
def test_what_does_not_fit(scene, changes, message):
    with pytest.raises(InputError, match=message):
        ffrobot.solve(scene(*changes))


def test_no_patches(scene):
    text = PAGE.read_text(encoding="utf-8")
    layout = text[text.index("[[pzt]]\nbody") : text.index('[[analysis]]\nname = "carried"')]
    with pytest.raises(InputError, match="pzt"):
        ffrobot.solve(scene((layout, ""), ("joints+pzt", "joints")))


def test_planar_spelling(scene):
    """A planar scene is the same arm, projected: its voltages are those of 3D."""
    in_3d = (
        ("gravity = [0.0, 0.0]", 'space = "spatial"\ngravity = [0.0, 0.0, 0.0]'),
        ('type = "revolute"', 'type = "revolute"\naxis = [0, 0, 1]'),
        ("angles = { arm =", "joints = { hub ="),
    )
    voltages = []
    for changes in ((), in_3d):
        with ffrobot.solve(scene(*changes)) as results:
            voltages.append(results["carried/pzt/arm/voltage"])
    assert np.abs(voltages[0] - voltages[1]).max() < 1e-6 * np.abs(voltages[0]).max()
