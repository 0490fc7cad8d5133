"""The paper's slider-crank through `ffrobot solve`: a closed loop, a rigid crank, a damped flexible rod."""

import numpy as np
import pytest
from checkpoints import check_column, reference

CHECKPOINTS = reference("slider_crank/reference.csv")
RELATIVE = 1e-6  # of each quantity's peak
TIMES = np.arange(201) * 0.001
TIMES[-1] = 0.2


@pytest.mark.parametrize("name", [name for name in CHECKPOINTS if name != "t"])
def test_checkpoints(slider_crank, name):
    times = np.array(CHECKPOINTS["t"], dtype=float)
    check_column(slider_crank, "inverse", name, times, CHECKPOINTS[name], RELATIVE)


def test_loop_is_closed_and_the_slider_on_its_path(slider_crank):
    """From the outputs alone."""
    group = slider_crank.file["inverse"]
    slider, pin, tip = (group[f"points/{name}/position"][()] for name in ("slider.pin", "crank.tip", "rod.tip"))
    path = 0.35 - 0.12 * np.sin(100 * group["time"][()])
    np.testing.assert_allclose(slider, np.column_stack([path, np.zeros(201)]), rtol=0, atol=1e-12)
    np.testing.assert_allclose(tip, slider, rtol=0, atol=1e-12)
    np.testing.assert_allclose(pin, group["bodies/rod/position"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.hypot(*pin.T), 0.15, rtol=0, atol=1e-12)
    assert np.all(pin[:, 1] > 0.0)  # the branch that the initial angles pick


def test_guide_carries_no_force_along_itself(slider_crank):
    reaction = slider_crank.file["inverse/joints/guide/reaction"][()]
    assert np.abs(reaction[:, 0]).max() < 1e-12 * np.abs(reaction[:, 1]).max()


def test_slider_moves_by_its_own_force(slider_crank):
    """Newton's law of the slider, 0.1 kg: trajectory force plus the push of the rod equal m ẍ of the path."""
    group = slider_crank.file["inverse"]
    push = group["joints/B/reaction"][:, 0]  # on the slider, the second of B
    acceleration = 0.12 * 100**2 * np.sin(100 * group["time"][()])
    total = group["trajectories/slider/force"][:, 0] + push
    np.testing.assert_allclose(total, 0.1 * acceleration, rtol=0, atol=1e-8 * np.abs(push).max())


def test_forward_run_under_the_force_follows_the_path(slider_crank):
    """The paper's Figs. 4–5: the recorded force alone moves the slider as specified."""
    inverse, forward = slider_crank.file["inverse"], slider_crank.file["forward"]
    for name in ("points/slider.pin/position", "points/rod.mid/deflection", "bodies/crank/angle"):
        expected = inverse[name][()]
        assert np.abs(forward[name][()] - expected).max() < 1e-5 * np.abs(expected).max()
