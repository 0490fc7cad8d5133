"""Paths carried by joint motors alone: on the nonlinear model, with nothing but the moments that were found."""

import re

import numpy as np
import pytest

TIP = "link2.tip"


@pytest.fixture(scope="module")
def arm(solved):
    return solved("flexible_arm_inversion")


@pytest.fixture(scope="module")
def two_links(solved):
    return solved("two_link_motors_only")


def distance(case, run, source, point, components):
    """Of a point from the path of `source`, at the outputs of both: (T,) m, and the length of the path."""
    position = case.file[f"{run}/points/{point}/position"][:, components]
    target = case.file[f"{source}/trajectories/tip/target"][: len(position)]
    return np.linalg.norm(position - target, axis=1), np.linalg.norm(np.diff(target, axis=0), axis=1).sum()


def test_tip_of_the_soft_arm_follows_its_path(arm):
    """The requirement is 1e-6 of the path; measured 3e-10."""
    error, way = distance(arm, "exact_forward", "exact", "arm.tip", [1])
    assert error.max() < 1e-8 * way


def test_slowest_zero_of_the_soft_arm_is_that_of_a_beam(arm):
    """2η² √(EI/ρA)/L² with η = 2.36502 (its README), within what six modes and 0.5 % of damping change: 2 %."""
    zeros = arm.file["exact/zero_dynamics/zeros"][0]
    growing = zeros[(zeros[:, 0] > 0) & (zeros[:, 1] == 0), 0].min()
    assert growing == pytest.approx(2 * 2.36502**2 * np.sqrt(70e9 * 0.004**2 / 12 / 2700), rel=0.03)
    assert not arm.file["exact/zero_dynamics"].attrs["minimum_phase"]


def test_moment_of_the_soft_arm_begins_before_the_path(arm):
    """Times from −T to end + T; at its start the robot is at rest."""
    group = arm.file["exact"]
    time, moment = group["time"][()], group["joints/O/moment"][()]
    assert time[0] < -0.3
    assert np.isin([0.0, 1.0], time).all()
    assert np.abs(moment[time < -0.2]).max() < 1e-5 * np.abs(moment).max()
    assert np.abs(moment[(time > -0.01) & (time < 0)]).max() > 1e-3 * np.abs(moment).max()


def test_tip_of_the_two_links_follows_its_path(two_links):
    """The requirement is 1e-6 of the path; measured 1e-9."""
    error, way = distance(two_links, "exact_forward", "exact", TIP, [0, 1])
    assert way == pytest.approx(0.507, abs=1e-3)
    assert error.max() < 1e-8 * way


def test_two_links_come_to_rest_after_their_path(two_links):
    """What the modal forces that are left unmet (1e-6) excite rings on, undamped: 1.2e-4 of the speeds on the path."""
    group = two_links.file["exact_forward"]
    speed = np.concatenate([group[f"bodies/link{k}/modal_velocity"][()] for k in (1, 2)], axis=1)
    assert np.abs(speed[-1]).max() < 1e-3 * np.abs(speed).max()


def test_summary_tells_zeros_and_error(two_links):
    text = " ".join(two_links.stdout.split())
    assert "not minimum phase, zeros at 248.7" in text
    assert "stable inversion with 0.093 s" in text
    growing = r"times the vibration: minimum phase at rest, zeros of up to \S+ 1/s on the way grow too little"
    assert re.search(growing, text)
