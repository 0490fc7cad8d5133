"""Peaks that take turns as the largest, and limits that no design keeps: optima of closed forms by other means."""

import numpy as np
import pytest
import small_robots
from scipy.optimize import minimize
from small_robots import CANTILEVER, FORCE, RHO, E, L

import ffrobot

MASS, INERTIA, LOAD, LENGTH, G = 2.0, 0.05, 0.5, 0.6, 9.81  # of small_robots.ARM
AMPLITUDES, RATES, PHASES = np.array([1.0, 0.2]), np.pi * np.array([0.5, 1.5]), np.array([0.0, 0.7])
ARM = small_robots.ARM | {
    "body": [{"name": "arm", "rigid": small_robots.RIGID | {"center": [0.1, 0.1]}}],
    "trajectory": [{"name": "swing", "joint": "shoulder", "value": "sin(pi/2*t) + 0.2*sin(3*pi/2*t + 0.7)"}],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 4.0, "output_step": 0.08}],
}
MOMENT = "peak joints.shoulder.moment"
VARY = ["body.arm.rigid.center.0=-0.5:0.5", "body.arm.rigid.center.1=-0.5:0.5"]
TIME = np.linspace(0.0, 4.0, 2001)  # of tops, 25 times as many as outputs of the scene


def moment(center):
    """(T,) J θ̈ + g (… cos θ − … sin θ) of the arm about its joint, at the outputs."""
    x, y = center
    phases = np.outer(TIME, RATES) + PHASES
    angle, acceleration = np.sin(phases) @ AMPLITUDES, -np.sin(phases) @ (AMPLITUDES * RATES**2)
    inertia = INERTIA + MASS * (x**2 + y**2) + LOAD * LENGTH**2
    static = (MASS * x + LOAD * LENGTH) * np.cos(angle) - MASS * y * np.sin(angle)
    return inertia * acceleration + G * static


def least_peak(start):
    """The center with the least largest moment of all outputs: every output of both signs is a constraint."""

    def room(z):
        return np.concatenate([z[2] - moment(z[:2]), z[2] + moment(z[:2])])

    first = [*start, np.abs(moment(start)).max()]
    found = minimize(
        lambda z: z[2], first, method="SLSQP", bounds=[(-0.5, 0.5), (-0.5, 0.5), (0.0, None)],
        constraints=[{"type": "ineq", "fun": room}], options={"ftol": 1e-11, "maxiter": 500},
    )  # fmt: skip
    assert found.success
    return found.x[:2], found.fun


def test_where_to_put_the_center_of_mass(write):
    """Several local peaks of the moment are equal where the largest is least."""
    center, peak = least_peak([0.1, 0.1])
    size = np.abs(moment(center))
    tops = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:]) & (size[1:-1] > (1.0 - 1e-5) * peak)
    assert tops.sum() + (size[[0, -1]] > (1.0 - 1e-5) * peak).sum() >= 3
    found = ffrobot.optimise(write(ARM), VARY, minimise=MOMENT)
    assert found.value == pytest.approx(peak, rel=1e-5)
    np.testing.assert_allclose(found.values, center, atol=2e-4)
    assert found.converged
    assert found.runs <= 60  # with the largest peak alone 124, and no word of convergence


@pytest.mark.nightly
def test_a_limit_of_peaks_that_take_turns(write):
    """The largest first coordinate whose least peak, over the second one, is below 1.5 N m."""
    found = ffrobot.optimise(
        write(ARM), VARY, maximise="value body.arm.rigid.center.0", subject_to=[f"{MOMENT} <= 1.5"]
    )
    best = minimize(
        lambda z: -z[0], [-0.15, -0.04], method="SLSQP", bounds=[(-0.5, 0.5)] * 2, options={"ftol": 1e-12},
        constraints=[{"type": "ineq", "fun": lambda z: 1.5 - np.concatenate([moment(z), -moment(z)])}],
    )  # fmt: skip
    assert best.success
    assert (np.abs(moment(best.x)) > 1.5 * (1.0 - 1e-6)).sum() >= 2
    np.testing.assert_allclose(found.values, best.x, atol=1e-5)
    assert found.limits[0] <= 1.5 * (1.0 + 1e-6)
    assert found.converged


HEIGHT, WIDTH = (f"links.beam.geometry.section.{key}" for key in ("height", "width"))


def test_limits_that_no_design_keeps_together(write):
    """Mass ρ L w h and deflection a/(w h³) are both beyond their limits by r at the least: h as high as it may be.

    r² = a ρ L/(h² δ m) of their limits. Frequency can be kept, and is no part of the conflict.
    """
    mass, deflection, h = 0.15, 2e-4, 0.025
    found = ffrobot.optimise(
        write(CANTILEVER),
        [f"{HEIGHT}=0.01:{h}", f"{WIDTH}=0.002:0.08"],
        minimise="mass",
        subject_to=[f"peak points.beam.tip.deflection <= {deflection}", f"mass <= {mass}", "frequency 1 beam >= 10"],
    )
    excess = np.sqrt(4.0 * FORCE * L**3 / E * RHO * L / (h**2 * deflection * mass)) - 1.0
    assert not found.feasible
    assert found.conflict is not None
    assert found.conflict.limits == (0, 1)
    assert found.conflict.bounds == (0,)
    assert found.violation == pytest.approx(excess, rel=1e-3)
    assert found.violation == found.conflict.violation
    assert found.runs <= 60  # before such an end was known the search went on beyond 150
    text = str(found)
    assert f'keeps "peak points.beam.tip.deflection <= {deflection}" and "mass <= {mass}" together' in text
    assert f"within the bounds of {HEIGHT}: at the least violation that was found they are exceeded by" in text
