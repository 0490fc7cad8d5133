"""The violation that runs report: what it says of constraints that hold, and of ones that do not."""

import numpy as np
import zoo
from mechanisms import assemble, core_run

from ffrobot.mbs.solve.initial_state import undeformed_state


def reported(name):
    assembly = assemble(zoo.build(name))
    start = undeformed_state(assembly)
    v = start.v + np.random.default_rng(0).standard_normal(len(start.v))
    run = core_run(assembly, start.q, v, [0.0, 1e-6], max_steps=1)
    return assembly.system, run


def test_constraints_of_a_moving_mechanism_with_slides_hold_on_all_levels():
    """A slide's velocity terms must not be counted in the row after it, as they once were."""
    for name in ("mixed", "mixed backwards", "slider-crank"):
        system, run = reported(name)
        assert run.residual[0].max() < 1e-13
        C, C_dot, _ = system.constraints(0.0, run.q[0], run.v[0])
        assert max(np.abs(C).max(), np.abs(C_dot).max()) < 1e-13
