"""Runs of the core with one method: in steps that the caller chooses, as it repeats those of an earlier run."""

import numpy as np

from ffrobot.mbs import _core

NEWTON = 1e-8  # of the iterations of implicit methods


def controls(method="dop853", tolerance=1e-11, max_steps=0, spectral_radius=0.8, keep_steps=False, repeated=()):
    """Of a run by one method of `_core.MethodKind`, by its name."""
    methods = [(getattr(_core.MethodKind, method), 1.0, 0.0)]
    made = _core.IntegrationControls(
        tolerance=tolerance, max_steps=max_steps, methods=methods, spectral_radius=spectral_radius
    )
    made.keep_steps, made.repeated_steps = keep_steps, list(repeated)
    return made


def states_of_equal_steps(core, scene, method, q, v, times, spectral_radius=0.8, every=1):
    """States (T, n_q + n_v) at `times` (T,); steps end at every one of them, or at each `every`-th."""
    of_steps = controls(method, NEWTON, spectral_radius=spectral_radius, repeated=times[every::every])
    run = _core.tree_motion(core, scene, list(times), q, v, of_steps, lambda _: True)
    assert run.status == _core.IntegrationStatus.completed
    assert run.steps == len(of_steps.repeated_steps)
    return np.array(run.states)
