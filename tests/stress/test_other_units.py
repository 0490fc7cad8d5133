"""The same physics in other units gives the same numbers: no absolute tolerance hides in the code."""

import pytest
from links import ANGLES, TIP, arm, quintic
from mechanisms import relative
from robots import inverse
from table import at_most
from units import SI, SYSTEMS, Units

import ffrobot
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
    """In the very same steps, also where DOP853 is at its limit of stability."""
    worst = {}
    for integrator, tolerance in (("dop853", 1e-6), ("radau", 1e-6), ("generalized-alpha", 1e-3)):
        keys = {"tolerance": tolerance, "integrator": integrator}
        expected, steps = forces(SI, state, **keys)
        found = {name: forces(SYSTEMS[name], state, **keys) for name in OTHERS}
        worst[integrator] = max(relative(lambda_, expected) for lambda_, _ in found.values())
        assert worst[integrator] < 0.05 * tolerance
        assert {taken for _, taken in found.values()} == {steps}
    record(
        "Units of measure",
        f"{state} start, in {'; '.join(OTHERS)} instead of SI units",
        "forces differ by at most {dop853} (DOP853), {radau} (Radau IIA), {alpha} (generalized-α) of their peak",
        dop853=at_most(1e-9, worst["dop853"]),
        radau=at_most(2e-12, worst["radau"]),
        alpha=at_most(1e-9, worst["generalized-alpha"]),
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


def falling_arm(units):
    """Two rigid links on axes that are not parallel, from rest, in `units`; lengths of 0.5 m, for a second."""
    length = 0.5 * units.length
    inertia = 0.02 * units.mass * units.length**2
    link = {
        "rigid": {
            "mass": units.mass,
            "center": [length / 2, 0.0, 0.0],
            "inertia": [0.1 * inertia, inertia, inertia],
            "points": {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]},
        }
    }
    return ffrobot.make_scene(
        name="arm",
        space="spatial",
        gravity=[0.0, 0.0, units.gravity[1]],
        body=[{"name": name} | link for name in ("upper", "fore")],
        joint=[
            {"name": "O", "type": "revolute", "between": ["ground", "upper.root"], "axis": [0.0, 1.0, 0.0]},
            {"name": "A", "type": "revolute", "between": ["upper.tip", "fore.root"], "axis": [0.0, 0.8, 0.6]},
        ],
        analysis=[{"name": "fall", "kind": "forward", "end": units.time, "output_step": 0.1 * units.time}],
    )


@pytest.mark.parametrize("integrator", ["dop853", "generalized-alpha"])
def test_space(integrator):
    """In the very same steps."""
    found = {}
    for name, units in SYSTEMS.items():
        scene = falling_arm(units)
        analysis = scene.analysis[0].model_copy(update={"integrator": integrator, "tolerance": 1e-4})
        results = ffrobot.solve(scene.model_copy(update={"analysis": (analysis,)}))
        found[name] = results["fall/joints/A/coordinate"], int(results.attributes("fall")["steps"])
    angle, steps = found["SI"]
    assert {taken for _, taken in found.values()} == {steps}
    assert max(relative(other, angle) for other, _ in found.values()) < 1e-9
