"""Vibration and overshoot of closed loops: closed forms, and an arm that rings below 10 Hz."""

import warnings
from time import process_time

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.signal import savgol_filter

import ffrobot
from ffrobot.actuation.control.metrics import overshoot, ringing, settling, slow_part, vibration, watched

TIME = np.linspace(0.0, 2.0, 2001)
TRAVEL = np.column_stack([np.clip(TIME / 0.3, 0.0, 1.0), 0.0 * TIME])


def measured(error, lowest):
    """Along a direction across both axes."""
    frequency, window = ringing(TIME, TRAVEL, lowest)
    assert frequency == lowest
    return vibration(TIME, np.outer(error, [0.6, 0.8]), window, lowest)


@pytest.mark.parametrize("lowest", [2.8, 6.5, 20.0])
@pytest.mark.parametrize("off", [0.9, 1.0, 1.2])
@pytest.mark.parametrize("zeta", [0.0, 0.01])
def test_a_decaying_oscillator_beside_a_drift(lowest, off, zeta):
    """The loop rings at `off` times the frequency of the linear model: two amplitudes of the last period."""
    omega = 2 * np.pi * lowest * off
    ringing = 0.02 * np.exp(-zeta * omega * TIME) * np.cos(omega * TIME + 1.0)
    drift = 0.01 * np.exp(-TIME / 0.5) + 0.003 * TIME
    true = np.ptp(ringing[TIME[-1] - TIME <= 1.0 / lowest])
    assert measured(ringing + drift, lowest) == pytest.approx(true, rel=0.05)


@pytest.mark.parametrize("lasts", [0.05, 0.1, 0.2, 0.5])
def test_an_error_that_dies_out_is_no_vibration(lasts):
    assert measured(0.02 * np.exp(-TIME / lasts), 2.8) < 0.002 * 0.02


def test_overshoot_is_beyond_the_last_place_along_the_way():
    error = np.column_stack([0.1 * np.exp(-5 * TIME) * np.sin(9 * TIME), 0.3 * np.sin(7 * TIME)])
    beyond = (TRAVEL + error)[:, 0].max() - 1.0
    assert overshoot(TIME, TRAVEL, error) == pytest.approx(beyond, rel=1e-12)
    assert overshoot(TIME[:5], np.ones((5, 2)), np.ones((5, 2))) == 0.0


def two_tones(time, *, share):
    """Two vibrations near 6.5 Hz, of which either may be taken for the vibration, on an ellipse, and a drift."""
    tones = np.column_stack([(1.0 - share) * np.cos(33.0 * time), share * np.sin(52.0 * time + 0.3)])
    return 1e-3 * (tones + tones[:, ::-1] * [1.0, -1.0]) + np.outer(np.exp(-time), [2e-3, 1e-3])


@pytest.mark.parametrize("share", [0.0, 0.45, 0.5, 0.55, 1.0])
def test_vibration_does_not_depend_on_the_steps_of_the_run(share):
    """Steps of other numbers and lengths, and values that are off by 1e-12: round-off decides on no more than that."""
    rng, found = np.random.default_rng(4), []
    for count in (900, 1000, 1700):
        steps = np.unique(np.concatenate([[0.0, 2.0], rng.uniform(0.0, 2.0, count), watched(2.0, 3 / 6.5, 6.5)]))
        error = two_tones(steps, share=share)
        found.append(
            vibration(steps, error + 1e-12 * np.abs(error).max() * rng.uniform(-1, 1, error.shape), 3 / 6.5, 6.5)
        )
    assert found == pytest.approx([found[0]] * 3, rel=1e-9)


@pytest.mark.parametrize("share", np.linspace(0.3, 0.7, 9))
def test_vibration_is_continuous_where_one_fit_becomes_better_than_another(share):
    beside = [vibration(TIME, two_tones(TIME, share=share + off), 3 / 6.5, 6.5) for off in (0.0, 1e-6, 1e-3)]
    assert beside[1] == pytest.approx(beside[0], rel=1e-4)
    assert beside[2] == pytest.approx(beside[0], rel=1e-1)


def test_on_a_circle_vibration_is_the_diameter():
    """To 1 %: frequencies that are tried are 2.5 % apart."""
    turning = 0.02 * np.column_stack([np.cos(41 * TIME), np.sin(41 * TIME), 0.0 * TIME])
    assert vibration(TIME, turning, 6 * np.pi / 41, 41 / (2 * np.pi)) == pytest.approx(0.04, rel=0.01)


def test_settling_is_where_the_error_comes_down_to_its_share():
    """e^{−5 t} comes to 5 % at ln 20/5, between the times at which it is known, whatever these are."""
    for times in (np.linspace(0.0, 2.0, 101), np.linspace(0.0, 1.9, 73) ** 1.1):
        assert settling(times, np.exp(-5.0 * times)) == pytest.approx(np.log(20.0) / 5.0, rel=1e-5)
    assert np.isnan(settling(TIME, 1.0 + TIME))
    assert settling(TIME, 0.0 * TIME) == 0.0


THICKNESS = 0.004  # m


def arm(step):
    """A soft arm turned by 4° in 0.3 s, its hub held by PD with a rotor of 10 kg m²."""
    link = beam_link(
        0.6, rectangle(THICKNESS, 0.02), 20, modes={"count": 2, "family": "in-plane-bending"},
        damping={"ratio": 0.005}
    )  # fmt: skip
    joint = {"name": "hub", "type": "revolute", "between": ["ground", "arm.root"], "gear_ratio": 100.0}
    return {
        "name": "arm", "gravity": [0.0, 0.0], "body": [{"name": "arm", "link": link}],
        "joint": [joint | {"rotor_inertia": 1e-3}],
        "payload": [{"point": "arm.tip", "mass": 0.3}],
        "trajectory": [{"name": "swing", "joint": "hub", "via": ["0*deg", "4*deg"], "duration": 0.3}],
        "analysis": [
            {"name": "rigid", "kind": "fcid", "shape": "zero", "end": 2.0, "output_step": step},
            {"name": "held", "kind": "closed-loop", "actuation": "rigid", "sample_time": 0.001, "tip": "arm.tip",
             "controller": [{"kind": "joint-pid", "proportional": {"hub": 2000.0}, "derivative": {"hub": 200.0}}]},
        ],
    }  # fmt: skip


def test_an_arm_that_rings_below_ten_hertz_is_said_to():
    """By its own tip: peak to peak in the last period; the frequency √(3 E I/((m + 33/140 ρ A L) L³))."""
    hertz, inertia, area = 2.82, 0.02 * THICKNESS**3 / 12, 0.02 * THICKNESS
    stiffness, mass = 3 * 70e9 * inertia / 0.6**3, 0.3 + 33 / 140 * 2700 * area * 0.6
    assert np.sqrt(stiffness / mass) / (2 * np.pi) == pytest.approx(hertz, rel=0.01)
    found = []
    for step in (0.002, 0.02):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ffrobot.FfrobotWarning)
            results = ffrobot.solve(ffrobot.make_scene(**arm(step)))
        about = results.attributes("held/control")
        found.append([about[key] for key in ("vibration", "tip_error_max", "overshoot", "residual")])
        if step == 0.002:
            time, tip = results.time("held"), results["held/points/arm.tip/position"]
            swing = np.ptp(tip[time >= 2.0 - 1.0 / hertz, 1])
            assert about["vibration"] == pytest.approx(swing, rel=0.02)
            assert about["lowest_frequency"] == pytest.approx(hertz, rel=0.01)
            assert about["residual"] == pytest.approx(results["held/tip_error"][-1], rel=1e-9)
    assert found[0] == pytest.approx(found[1], rel=5e-3)  # feed-forward is that of the outputs' spline
    assert found[0][0] == pytest.approx(0.051, rel=0.02)


@pytest.mark.parametrize("count", [5, 51, 1251])
def test_slow_parts_are_those_of_savitzky_and_golay(count):
    """By SciPy, and of as many outputs as a long run has in a time that does not grow with their square."""
    values = np.cumsum(np.random.default_rng(5).normal(size=(5001, 2)), axis=0)
    t = np.linspace(0.0, 1.0, len(values))
    expected = savgol_filter(values, count, 3, axis=0)
    np.testing.assert_allclose(slow_part(t, values, (count - 1) * t[1]), expected, atol=1e-12 * np.abs(values).max())
    many = np.linspace(0.0, 1.0, 300_001)
    began = process_time()
    slow_part(many, many[:, None], 0.1)
    assert process_time() - began < 3.0
