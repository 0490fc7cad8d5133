"""Runs in steps that the caller chooses: as the core repeats those of an earlier run."""

import numpy as np

from ffrobot.mbs import _core

NEWTON = 1e-8  # of the iterations of implicit methods


def states_of_equal_steps(core, scene, method, q, v, times, spectral_radius=0.8, every=1):
    """States (T, n_q + n_v) at `times` (T,); steps end at every one of them, or at each `every`-th."""
    controls = _core.IntegrationControls(
        tolerance=NEWTON, max_steps=0, methods=[(method, 1.0, 0.0)], spectral_radius=spectral_radius
    )
    controls.repeated_steps = list(times[every::every])
    run = _core.tree_motion(core, scene, list(times), q, v, controls, lambda _: True)
    assert run.status == _core.IntegrationStatus.completed
    assert run.steps == len(controls.repeated_steps)
    return np.array(run.states)
