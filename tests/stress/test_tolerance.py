"""The tolerance at every output of every reported history: robots that once broke it, and long runs without damping.

Many more robots, others each time: tests/campaigns/tolerance.py.
"""

import pytest
from links import ANGLES, TIP, arm, arm_links
from mechanisms import relative
from robots import inverse
from tolerance import try_robot

# Of tests/campaigns/tolerance.py, seed 101; what was outside before moments of motors and rates of joints
# were judged by themselves.
# 12: moments of an arm; 47: rates in a four-bar.


@pytest.mark.parametrize("number", [12, pytest.param(47, marks=pytest.mark.nightly)])
def test_robots_that_were_outside(number):
    found = try_robot(101, number)
    worst = [max(run["errors"].values()) for run in found["runs"] if run["status"] == "completed"]
    assert len(worst) > 6
    assert max(worst)[0] <= 1.0, max(worst)


@pytest.mark.parametrize("end", [5.0, pytest.param(50.0, marks=pytest.mark.long)])
@pytest.mark.parametrize("integrator", ["dop853", pytest.param("dopri5", marks=pytest.mark.nightly)])
def test_errors_of_long_undamped_runs(end, integrator):
    """Errors of phase add up step by step: after five seconds 2.6 tolerances, when a random walk was assumed."""
    path = {"name": "tip", "point": "link2.tip", "x": f"{TIP[0]!r}-0.1*sin(t)", "y": f"{TIP[1]!r}+0.1*sin(t)"}
    model = arm(arm_links(EI=30.0, modes=2), initial={"angles": ANGLES}, trajectory=[path])
    keys = {"end": end, "output_step": end / 500}
    exact = inverse(model, tolerance=1e-9, integrator="dop853", **keys)
    found = inverse(model, tolerance=1e-5, integrator=integrator, **keys)
    reported = ("q", "v", "lambda_", "tau", "F_p")
    errors = {name: relative(getattr(found, name), getattr(exact, name)) for name in reported}
    assert max(errors.values()) <= 1e-5, errors
