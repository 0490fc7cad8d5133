"""The violation that runs report: what it says of constraints that hold, and of ones that do not."""

import numpy as np
import pytest
import zoo
from mechanisms import always, assemble

from ffrobot.mbs import _core
from ffrobot.mbs.solve.initial_state import undeformed_state

SLIDES = ("mixed", "mixed backwards", "slider-crank")
T = 0.3


def moving(name):
    assembly = assemble(zoo.build(name))
    start = undeformed_state(assembly)
    return assembly, start.q, start.v + np.random.default_rng(0).standard_normal(len(start.v))


@pytest.mark.parametrize("name", SLIDES)
def test_constraints_of_a_moving_mechanism_with_slides_hold_on_all_levels(name):
    """A slide's velocity terms must not be counted in the row after it, as they once were."""
    assembly, q, v = moving(name)
    run = _core.run(
        assembly.system, assembly.groups, assembly.moments, None, [0.0, 1e-6], q, v, 1e-6, 1,
        _core.MethodKind.dop853, 0.8, None, always, None, None,
    )  # fmt: skip
    assert run.residual[0].max() < 1e-13
    C, C_dot, _ = assembly.system.constraints(0.0, run.q[0], run.v[0])
    assert max(np.abs(C).max(), np.abs(C_dot).max()) < 1e-13


@pytest.mark.parametrize("name", sorted(zoo.ALL))
def test_violation_at_rest_is_what_the_jacobian_says(name):
    """Without velocities C̈ = C_q a − c̈, with the targets' c̈; relative to 1 + |c̈| where bodies are straight, a small."""
    assembly = assemble(zoo.build(name))
    system, rng = assembly.system, np.random.default_rng(1)
    q, rest = np.zeros(system.coordinates), np.zeros(system.coordinates)
    q[assembly.frame_coordinates] = rng.standard_normal(len(assembly.frame_coordinates))
    C_q = system.constraints(T, q, rest)[2]
    if not len(C_q):
        assert system.acceleration_violation(T, q, rest, rng.standard_normal(system.coordinates)) == 0.0
        return
    target = np.array([constraint.target(T)[2] for constraint in assembly.constraints[: len(C_q)]])
    for size in (0.0, 1e-6):
        a = size * rng.standard_normal(system.coordinates)
        expected = np.abs((C_q @ a - target) / (1 + np.abs(target))).max()
        assert system.acceleration_violation(T, q, rest, a) == pytest.approx(expected, rel=1e-4, abs=1e-15)
    assert expected > 1e-8


@pytest.mark.parametrize("name", SLIDES)
def test_accelerations_that_violate_a_constraint_are_seen(name):
    """Those of the equations hold it; with any coordinate moved, or the velocity terms left out, they do not."""
    assembly, q, v = moving(name)
    system = assembly.system
    a, _ = system.evaluate(0.0, q, v)
    assert system.acceleration_violation(0.0, q, v, a) < 1e-13
    C_q = system.constraints(0.0, q, v)[2]
    for k in range(system.coordinates):
        moved = a + 1e-3 * (1 + np.abs(a).max()) * np.eye(system.coordinates)[k]
        felt = 1e-3 * (1 + np.abs(a).max()) * np.abs(C_q[:, k]).max()
        found = system.acceleration_violation(0.0, q, v, moved)
        assert found <= felt * (1 + 1e-9) + 1e-13
        assert found > 1e-6 if felt > 1e-3 else found < 1e-3
    without_velocities, _ = system.evaluate(0.0, q, np.zeros_like(v))
    assert system.acceleration_violation(0.0, q, v, without_velocities) > 1e-2
