"""The same physics in other units gives the same numbers: no absolute tolerance hides in the code."""

import pytest
from mechanisms import relative
from rewritten_scenes import SYSTEMS
from tables_3d import Y, revolute, scene

import ffrobot


def falling_arm(units, integrator, axis):
    """Two rigid links from rest; lengths of 0.5 m, for a second."""
    length = 0.5 * units.length
    inertia = 0.02 * units.mass * units.length**2
    points = {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]}
    rod = {"mass": units.mass, "center": [length / 2, 0.0, 0.0], "inertia": [0.1 * inertia, inertia, inertia]}
    run = {"kind": "forward", "end": units.time, "output_step": 0.1 * units.time, "tolerance": 1e-4}
    bodies = [{"name": name, "rigid": rod | {"points": points}} for name in ("upper", "fore")]
    joints = [revolute("O", "ground", "upper.root", Y), revolute("A", "upper.tip", "fore.root", axis)]
    gravity = [0.0, 0.0, -9.81 * units.length / units.time**2]
    fall = {"name": "fall", "integrator": integrator} | run
    return ffrobot.make_scene(**scene(bodies, joints, fall, gravity=gravity))


@pytest.mark.parametrize("axis", [[0.0, 1.0, 0.0], [0.0, 0.8, 0.6]], ids=["in a plane", "askew"])
@pytest.mark.parametrize("integrator", ["dop853", "dopri5", "radau", "generalized-alpha"])
def test_rigid_links(integrator, axis):
    """In the very same steps."""
    found = {}
    for name, units in SYSTEMS.items():
        results = ffrobot.solve(falling_arm(units, integrator, axis))
        found[name] = results["fall/joints/A/coordinate"], int(results.attributes("fall")["steps"])
    angle, steps = found["SI"]
    assert {taken for _, taken in found.values()} == {steps}
    assert max(relative(other, angle) for other, _ in found.values()) < 1e-9
