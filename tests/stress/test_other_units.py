"""The same physics in other units gives the same numbers: no absolute tolerance hides in the code."""

import pytest
from links import ANGLES, TIP, arm, quintic
from mechanisms import relative
from robots import inverse
from table import at_most
from units import SI, SYSTEMS, Units

from ffrobot.mbs.analysis.static import Static, run_static

OTHERS = [name for name in SYSTEMS if name != "SI"]
STATIC = Static(name="rest", kind="static")


def forces(units, state, **keys):
    model = units.arm(initial={"angles": ANGLES, "state": state})
    outcome = inverse(model, end=0.2 * units.time, output_step=0.01 * units.time, **keys)
    assert outcome.status == "completed"
    return outcome.lambda_ / units.force, outcome.statistics.steps


@pytest.mark.parametrize("state", ["undeformed", "static"])
def test_inverse_dynamics(state, record):
    """DOP853 at its limit of stability feels rounding: steps differ; Radau IIA takes the very same ones."""
    worst = {}
    for integrator, tolerance in (("dop853", 1e-6), ("radau", 1e-6), ("generalized-alpha", 1e-3)):
        keys = {"tolerance": tolerance, "integrator": integrator}
        expected, steps = forces(SI, state, **keys)
        found = {name: forces(SYSTEMS[name], state, **keys) for name in OTHERS}
        worst[integrator] = max(relative(lambda_, expected) for lambda_, _ in found.values())
        assert worst[integrator] < 0.05 * tolerance
        if integrator == "radau":
            assert {taken for _, taken in found.values()} == {steps}
    record(
        "Units of measure",
        f"{state} start, in {'; '.join(OTHERS)} instead of SI units",
        "forces differ by at most {dop853} (DOP853), {radau} (Radau IIA), {alpha} (generalized-α) of their peak",
        dop853=at_most(2e-8, worst["dop853"]),
        radau=at_most(2e-12, worst["radau"]),
        alpha=at_most(5e-9, worst["generalized-alpha"]),
    )


@pytest.mark.parametrize("size", [1e-9, 1e-4, 1e4])
def test_robots_of_any_size(size, record):
    units = Units(size, size**3)
    keys = {"tolerance": 1e-6, "integrator": "radau"}
    difference = relative(forces(units, "undeformed", **keys)[0], forces(SI, "undeformed", **keys)[0])
    assert difference < 1e-7
    record("Units of measure", f"the arm scaled by {size:g}", "forces differ by {by} of their peak", by=difference)


@pytest.mark.parametrize("name", OTHERS)
def test_statics(name):
    units = SYSTEMS[name]
    found, expected = (run_static(u.arm(analysis=(STATIC,)), STATIC) for u in (units, SI))
    assert relative(found.lambda_ / units.force, expected.lambda_) < 1e-10


def test_slow_motion_is_as_precise(record):
    """A path that takes 20 s, against the same at a tighter tolerance: no velocity is too small to count."""
    long = 20.0
    path = {"name": "tip", "point": "link2.tip", "x": quintic(TIP[0], 0.4, long), "y": quintic(TIP[1], 1.5, long)}
    model = arm(trajectory=[path], gravity=(0.0, 0.0))
    keys = {"end": long, "output_step": long / 100, "integrator": "radau"}
    coarse, fine = (inverse(model, tolerance=tolerance, **keys) for tolerance in (1e-4, 1e-5))
    error = relative(coarse.lambda_, fine.lambda_)
    assert error < 1e-4
    record(
        "Units of measure",
        "a path that takes 20 s, no gravity, tolerance 1e-4",
        "forces err by {error} of their peak",
        error=error,
    )
