"""The violation that runs report of constraints that hold; of ones that do not: `test_planar_tree.py`."""

import numpy as np
import pytest
import zoo
from mechanisms import assemble, core_run

from ffrobot.mbs.solve.initial_state import undeformed_state

SLIDES = ("mixed", "mixed backwards", "slider-crank")


def moving(name):
    assembly = assemble(zoo.build(name))
    start = undeformed_state(assembly)
    return assembly, start.q, start.v + np.random.default_rng(0).standard_normal(len(start.v))


@pytest.mark.parametrize("name", SLIDES)
def test_constraints_of_a_moving_mechanism_with_slides_hold_on_all_levels(name):
    """A slide's velocity terms must not be counted in the row after it, as they once were."""
    assembly, q, v = moving(name)
    run = core_run(assembly, q, v, [0.0, 1e-6], max_steps=1)
    assert run.residual[0].max() < 1e-13
    C, C_dot, _ = assembly.system.constraints(0.0, run.q[0], run.v[0])
    assert max(np.abs(C).max(), np.abs(C_dot).max()) < 1e-13
