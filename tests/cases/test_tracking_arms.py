"""Motors and patches on a path of 3D scenes: replays, limits, and input that does not fit."""

import re
from pathlib import Path

import numpy as np
import pytest

import ffrobot
from ffrobot.common.errors import InputError, SolveError

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "tracking.md"
SEPTIC = "35*(t/0.6)**4 - 84*(t/0.6)**5 + 70*(t/0.6)**6 - 20*(t/0.6)**7"


HAND = """[[body]]
name = "hand"
rigid = { mass = 0.1, inertia = 1e-4, center = [0.0, 0.0], points = { root = [0.0, 0.0] } }
[[joint]]
name = "wrist"
type = "weld"
between = ["arm.tip", "hand.root"]
[[joint]]"""


@pytest.fixture
def scene(tmp_path):
    """The soft arm of the page, its text changed by pairs; `alone`: without the replays."""
    blocks = dict(re.findall(r"`(\w+\.toml)`:\n\n```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL))

    def write(*changes, link=(), alone=False):
        for name, text in blocks.items():
            for old, new in changes if name == "scene.toml" else link:
                assert old in text
                text = text.replace(old, new)
            if alone and name == "scene.toml":
                text = text[: text.index("[[analysis]]", text.index('name = "carried"'))]
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
        modal, rate = (results[f"carried/bodies/arm/{name}"] for name in ("modal", "modal_velocity"))
        assert np.abs(rate[[0, -1]]).max() < 1e-9 * np.abs(rate).max()
        assert np.abs(modal[[0, -1]]).max() < 1e-9 * np.abs(modal).max()
        voltage = results["carried/pzt/arm/voltage"]
        assert np.abs(voltage).max() <= 200.0 * (1 + 1e-9)
        assert np.abs(voltage[[0, -1]]).max() < 1e-6


def test_replay_stays_within_the_path_tolerance(scene):
    """Half the voltage for 0.3 mm, and none for 1 mm: then the torques alone carry the arm."""
    changes = ("limit = 200.0", "limit = 100.0"), ("tolerance = 1e-4", "tolerance = 1e-5\npath_tolerance = 3e-4")
    with ffrobot.solve(scene(*changes)) as results:
        about, error = results.attributes("carried/tracking"), results["carried/trajectories/tip/error"]
        assert about["objective"] == "effort"
        assert about["path_tolerance"] == 3e-4
        assert f"{1e-3 * about['tolerance_price']:.3g} V less per mm of it" in results.verdict["carried"].answer
        assert 0.99 * 3e-4 < np.abs(error).max() < 3e-4 * (1 + 1e-6)
        assert np.abs(error[[0, -1]]).max() < 1e-9
        assert off_path(results, "replay") < 1e-2 * 3e-4
        modal, rate = (results[f"replay/bodies/arm/{name}"] for name in ("modal", "modal_velocity"))
        assert np.abs(rate[-1]).max() < 1e-4 * np.abs(rate).max()
        assert np.abs(modal[-1]).max() < 1e-4 * np.abs(modal).max()
    changes = ("limit = 200.0", "limit = 100.0"), ("tolerance = 1e-4", "tolerance = 1e-4\npath_tolerance = 1e-3")
    with ffrobot.solve(scene(*changes, alone=True)) as results:
        about, verdict = results.attributes("carried/tracking"), results.verdict["carried"]
        assert about["least_voltage"] == 0.0
        assert results.peak("carried/pzt/arm/required_voltage")[0] < 1e-4
        assert "least voltage 0 V: torques alone stay within path_tolerance" in verdict.answer
        assert "patches are not needed: torques alone stay on the path within path_tolerance" in verdict.advice
        assert about["without_patches"] < 1e-3 * 1.01


def test_limits_that_are_too_small(scene):
    """The least voltage is found all the same, and said."""
    path = scene(("limit = 200.0", "limit = 100.0"), alone=True)
    with ffrobot.solve(path) as results:
        about = results.attributes("carried/tracking")
        assert about["objective"] == "least-voltage"
        assert about["least_share"] == pytest.approx(about["least_voltage"] / 100.0)
        assert 1.5 < about["least_share"] < 1.7
        required = results["carried/pzt/arm/required_voltage"]
        assert np.abs(required).max() == pytest.approx(about["least_voltage"], rel=1e-3)
        (warning,) = [text for text in results.warnings["carried"] if "would do" in text]
        assert f"{about['least_voltage']:.3g} V instead of 100 V" in warning
    more = float(re.search(r"; (\S*) ms more", warning)[1]) / 1e3
    assert re.search(r"the same path in \S* s", warning)
    wider = float(re.search(r"; (\S*) mm of path_tolerance", warning)[1]) / 1e3
    keys = f"tolerance = 1e-4\npre_actuation = {more}\npost_actuation = {more}\noutput_step = 1e-4"
    for changes in (
        [("output_step = 0.002\ntolerance = 1e-4", keys)],
        [("tolerance = 1e-4", f"tolerance = 1e-4\npath_tolerance = {wider}")],
    ):
        with ffrobot.solve(scene(("limit = 200.0", "limit = 100.0"), *changes, alone=True)) as results:
            about = results.attributes("carried/tracking")
            assert about["objective"] == "effort"
            assert 0.9 < about["least_share"] <= 1.0


def test_patches_that_are_not_needed(scene):
    """In two seconds the torques alone leave less than a thousandth of the path; the replay is this distance."""
    changes = [("/0.6", "/2.0"), ("end = 0.6", "end = 2.0"), ("tolerance = 1e-4", "tolerance = 1e-3")]
    changes.append(("\nlimit = 200.0", ""))  # which the summary says in V, too
    with ffrobot.solve(scene(*changes)) as results:
        about, verdict = results.attributes("carried/tracking"), results.verdict["carried"]
        assert about["without_patches"] == pytest.approx(off_path(results, "without_patches"), rel=0.05)
        assert not about["is_needed"]
        assert any("patches are not needed" in text for text in verdict.advice)
        assert f"least voltage {about['least_voltage']:.3g} V" in verdict.answer
    with ffrobot.solve(scene(alone=True)) as results:
        about, verdict = results.attributes("carried/tracking"), results.verdict["carried"]
        assert about["is_needed"]
        assert not verdict.advice
        assert f"torques alone are off by {1e3 * about['without_patches']:.3g} mm" in verdict.answer
        # each zero asks for less than all together
        assert 0.5 < results["carried/tracking/bound/voltage"].max() / about["least_voltage"] < 0.8
        prices, voltage = results["carried/tracking/voltage_price/arm"], results["carried/pzt/arm/voltage"]
        at_limit = np.abs(voltage).max(axis=0) > 199.0
        assert (prices[at_limit] > 1e-6).all()
        assert (prices[~at_limit] < 1e-9).all()


def test_twice_the_modes(scene):
    """Spill-over, and the least voltage with four modes: 139.7 V by the prototype's mesh and free ends."""
    with ffrobot.solve(scene(("tolerance = 1e-4", 'tolerance = 1e-4\ncheck = "finer"'), alone=True)) as results:
        about = results.attributes("carried")
        assert about["check_least_voltage"] == pytest.approx(139.7, rel=0.03)
        assert 1e-6 < about["check_error"] < 3e-4


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ([(SEPTIC, "10*(t/0.6)**3 - 15*(t/0.6)**4 + 6*(t/0.6)**5")], "the path's jerk jumps where it begins and"),
        pytest.param(
            [("count = 4", "centers = [0.5]")], "the last patch ends 0.46 m before arm.tip", marks=pytest.mark.nightly
        ),
    ],
)
def test_what_takes_more_voltage(scene, changes, text):
    """It is said, and no answer calls it feasible; the patches are twice to ten times too weak."""
    with ffrobot.solve(scene(*changes, alone=True)) as results:
        assert any(text in warning for warning in results.warnings["carried"])
        assert results.verdict["carried"].feasible is False
        assert results.attributes("carried/tracking")["least_share"] > 1.8


QUINTIC, STEPS = "10*(t/0.6)**3 - 15*(t/0.6)**4 + 6*(t/0.6)**5", "{ values = [40.0, 60.0], torques = [1.0] }"
GEAR = "motor = true", "motor = true\nrotor_inertia = 1e-3\nstiffness = 40.0"
TOLERANCE, CUBIC = "tolerance = 1e-4", "3*(t/0.6)**2 - 2*(t/0.6)**3"


def test_far_beyond_the_limits_is_said_before_the_search(scene):
    """Acceleration jumps: the zero at the end alone asks for 8 times the limit, and what would do follows from it."""
    text = r"at least 7\.92 times the limits; the zero at -65\.26 1/s alone requires 1584 V.*: 31\.7 ms more of pre"
    with pytest.raises(SolveError, match=text + r".* in 1\.69 s instead of 0\.6 s; patches"):
        ffrobot.solve(scene((SEPTIC, CUBIC)))


@pytest.mark.parametrize(("timing", "is_said"), [(SEPTIC, False), (CUBIC, True)])
def test_least_voltage_that_does_not_settle(scene, timing, is_said):
    """Where acceleration jumps: a warning says by how much it may be lower, where that is more than 6 %."""
    weights = "tolerance = 1e-4\nweights = { voltage = 200.0 }"
    changes = (SEPTIC, timing), ("limit = 200.0 ", "limit = 400.0 "), (TOLERANCE, weights)
    with ffrobot.solve(scene(*changes, alone=True)) as results:
        about = results.attributes("carried/tracking")
        doubt = about["least_voltage_doubt"] / about["least_voltage"]
        said = [warning for warning in results.warnings["carried"] if "did not settle" in warning]
    assert (doubt > 0.06) == is_said
    assert len(said) == is_said
    assert all(f"it may be {100 * doubt:.2g} % less" in warning for warning in said)


def test_motors_at_their_limits(scene):
    """Torques and voltages stay within both limits, between Gauss points, too; in many intervals all four are at it."""
    limit = 1.07  # N·m
    with ffrobot.solve(scene(("moment_limit = 2.0", f"moment_limit = {limit}"), alone=True)) as results:
        assert results.attributes("carried/tracking")["objective"] == "effort"
        assert results["carried/tracking/torque_price/hub"].max() > 1e-6
        assert 0.999 * limit < results.peak("carried/joints/hub/moment")[0] <= limit
        assert results.peak("carried/pzt/arm/required_voltage")[0] <= 200.0
        assert results.verdict["carried"].feasible


def test_least_voltage_is_an_answer(scene):
    """Forces that the mesh leaves, within the tolerance, are none that actuators lack."""
    change = "tolerance = 1e-4", 'objective = "least-voltage"\ntolerance = 1e-4'
    with ffrobot.solve(scene(change, alone=True)) as results:
        assert results.verdict["carried"].feasible
        assert not any("no actuator provides" in text for text in results.warnings["carried"])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([(SEPTIC, "t/0.6")], "a path at rest"),
        ([("end = 0.6", "end = 0.5")], "a path at rest at t = 0.5 s"),
        ([(SEPTIC, "where(t > 0.3, 1, 0)")], "expected a continuous value, found a jump"),
        ([(SEPTIC, "where(t > 0.3, 0.2 + t, t/0.6)")], "expected a continuous velocity"),
        ([('body = "arm"\ncount', 'body = "hand"\ncount'), ("[[joint]]", HAND)], 'flexible body, found "hand"'),
        ([("motor = true\nmoment_limit = 2.0         # N·m\n", "motor = false\n")], "as many motors"),
        ([GEAR, (SEPTIC, QUINTIC)], "without jumps for compliant gears.*the path's jerk jumps where it begins and"),
        ([(GEAR[0], GEAR[1].replace("40.0", STEPS))], 'one stiffness of each gear .*found steps in joint "hub"'),
        ([(GEAR[0], GEAR[1].replace("true", "false"))], r"stiffness: expected a joint with a motor \(in loops"),
        ([('apply = "joints+pzt"', 'apply = "points"')], 'apply: expected "joints" or "joints\\+pzt"'),
        ([("tolerance = 1e-4", 'objective = "speed"')], "objective"),
        ([("tolerance = 1e-4", "path_tolerance = 0.0")], "path_tolerance: expected a number greater than 0, found 0"),
        ([("tolerance = 1e-4", "path_tolerance = 1.0")], "path is longer, found 1 m for a path of 0.765 m"),
        ([("tolerance = 1e-4", "path_tolerance = 1e-4\ntolerance_time = 0.0")], "tolerance_time: expected .*found 0"),
        ([("tolerance = 1e-4", "tolerance_time = 0.01")], '"tolerance_time" only with path_tolerance, found it alone'),
        ([GEAR, ("tolerance = 1e-4", "path_tolerance = 1e-4")], "rigid gears or no .*found compliant gears with one"),
        ([("tolerance = 1e-4", "pre_actuation = -0.1")], "pre_actuation: expected .*found -0.1"),
        ([("tolerance = 1e-4", "weights = { rate = -1.0 }")], "weights.rate: expected .*found -1.0"),
    ],
)
def test_what_does_not_fit(scene, changes, message):
    with pytest.raises(InputError, match=message):
        ffrobot.solve(scene(*changes))


def test_motors_that_are_too_weak(scene):
    """The least torque is said before the search; notes: 1.05 N·m suffice within 200 V, 1.00 do not. Both remedies."""
    limit, voltage = ("moment_limit = 2.0", "moment_limit = 0.8"), ("limit = 200.0", "limit = 1000.0")
    with pytest.raises(
        SolveError, match=r"motors' limits, not even with 5 times the voltages: raise moment_limit"
    ) as said:
        ffrobot.solve(scene(limit))
    more = float(re.search(r"of hub from 0\.8 to more than (\S*), or slow", str(said.value))[1])
    assert 0.9 < more < 1.0
    slower = [("/0.6", "/0.8"), ("end = 0.6", "end = 0.8"), limit]
    for changes in ([("moment_limit = 2.0", f"moment_limit = {1.05 * more}"), voltage], slower):
        with ffrobot.solve(scene(*changes)) as results:
            assert results.verdict["carried"].feasible


def test_a_mesh_that_is_too_coarse(scene, monkeypatch):
    """The forces that are left over are said, and the replay is off its path for it."""
    left, off = [], []
    for most in (24, 1500):
        monkeypatch.setattr("ffrobot.mbs.tracking.problem.MOST_INTERVALS", most)
        with ffrobot.solve(scene(("tolerance = 1e-4", "tolerance = 1e-4\nintervals = 16"))) as results:
            left.append(float(results.attributes("carried/tracking")["unmet"]))
            off.append(off_path(results, "replay"))
            said = [text for text in results.warnings["carried"] if "raise intervals, or loosen the tolerance" in text]
            assert len(said) == (left[-1] > 1e-4)
            assert all(f"up to {left[-1]:.2g} of the largest elastic one" in text for text in said)
    assert left[0] > 1e-4 > left[1]
    assert off[0] > 10 * off[1]
