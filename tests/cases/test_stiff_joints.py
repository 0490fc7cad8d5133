"""Joints in 3D at the limits of what keys may say: friction that is nearly a brake, tiny axes, starts that hang."""

import numpy as np
import pytest
from tables_3d import Y, revolute, rigid, scene

import ffrobot

MASS, ARM, G = 2.0, 0.3, 9.81


def pendulum(initial=None, analysis=None, **joint):
    pin = revolute("pin", "ground", "rod.root", Y) | joint
    free = {"name": "fall", "kind": "forward", "end": 0.5, "output_step": 0.1, "tolerance": 1e-8}
    rod, start = (
        rigid("rod", MASS, [1e-3, 0.02, 0.02], [ARM, 0.0, 0.0]),
        {} if initial is None else {"initial": initial},
    )
    return ffrobot.make_scene(**scene([rod], [pin], free | (analysis or {}), **start))


@pytest.mark.parametrize("friction", [1e6, 1e9])
def test_friction_that_is_nearly_a_brake(friction):
    """After some 1e-8 s its rate is what holds the weight: c γ̇ = m g r."""
    results = ffrobot.solve(pendulum(viscous_friction=friction))
    assert results.attributes("fall")["integrator"] == "radau"
    np.testing.assert_allclose(results["fall/joints/pin/rate"][1:], MASS * G * ARM / friction, rtol=1e-6)


def test_dry_friction_that_holds_at_once():
    """Below τ_c the joint creeps: tanh(γ̇/γ̇_s) = m g r/τ_c."""
    results = ffrobot.solve(pendulum(coulomb_friction=2 * MASS * G * ARM, friction_speed=1e-6))
    np.testing.assert_allclose(results["fall/joints/pin/rate"][1:], 1e-6 * np.arctanh(0.5), rtol=1e-3)


@pytest.mark.parametrize(
    ("friction", "advice"),
    [
        ({"viscous_friction": 1e12}, 'use integrator = "radau"'),
        ({"coulomb_friction": 1.0, "friction_speed": 1e-13}, "larger friction_speed"),
    ],
)
def test_steps_that_friction_stops(friction, advice):
    made = pendulum(analysis={"integrator": "dop853"}, **friction)
    with pytest.raises(ffrobot.SolveError, match=f'friction of joint "pin" brings it to rest within .*{advice}'):
        ffrobot.solve(made)


def test_steps_that_a_gear_makes_short_and_the_damping_that_helps():
    """ω² = k (1/I + 1/J N²) of rod and rotor; its critical damping, 2 k/ω, settles."""
    gear = {"motor": True, "rotor_inertia": 1e-4, "gear_ratio": 50.0, "stiffness": 1e12}
    inertia = np.array([0.02 + MASS * ARM**2, 1e-4 * 50.0**2])
    omega = np.sqrt(1e12 * (1.0 / inertia).sum())
    with pytest.raises(ffrobot.SolveError, match="too many steps") as failed:
        ffrobot.solve(pendulum(analysis={"max_steps": 50, "integrator": "dop853"}, **gear))
    assert f"compliant gears vibrate at {omega:.2g} rad/s, too fast for the run: give them damping" in str(failed.value)
    damped = ffrobot.solve(pendulum(**gear, damping=2e12 / omega))
    assert damped.attributes("fall")["steps"] < 1000


def test_an_axis_of_any_length():
    """Its squares may be no numbers."""
    unit, tiny = (ffrobot.solve(pendulum(axis=[0.0, length, 0.0])) for length in (1.0, 1e-200))
    np.testing.assert_array_equal(tiny["fall/joints/pin/coordinate"], unit["fall/joints/pin/coordinate"])


def test_a_start_that_hangs_is_told():
    """Nothing holds the joint in the static start of a forward run: at π/2 the rod hangs."""
    made = pendulum(initial={"state": "static", "joints": {"pin": 1.2}})
    with pytest.warns(ffrobot.FfrobotWarning, match=r'"pin" hang, away from \[initial\].*undeformed'):
        results = ffrobot.solve(made)
    np.testing.assert_allclose(results["fall/joints/pin/coordinate"], np.pi / 2, atol=1e-9)


def test_steps_of_a_run_that_was_stopped_are_all_kept(tmp_path):
    """They are those of the run that was never stopped, and can be repeated."""
    keys = {"keep_steps": True, "integrator": "dop853", "end": 3.0}
    path, whole = tmp_path / "stopped.h5", ffrobot.solve(pendulum(analysis=keys))
    steps = int(whole.attributes("fall")["steps"])
    with pytest.raises(ffrobot.SolveError, match="too many steps"):
        ffrobot.solve(pendulum(analysis=keys | {"max_steps": steps // 2}), path)
    resumed = ffrobot.solve(pendulum(analysis=keys | {"max_steps": steps}), path, resume=True)
    np.testing.assert_array_equal(resumed["fall/step_ends"], whole["fall/step_ends"])
    assert len(whole["fall/step_ends"]) == steps
