"""Sizes with which the norm of a motion compares errors: closed forms of one oscillator."""

import numpy as np

from ffrobot.mbs import _core

OMEGA, FORCE, MASS = 30.0, 5.0, 2.0


def body_with_a_mode():
    """Welded to the ground: p_ddot + ω² p = f."""
    body, data = _core.SpatialBody(), _core.SpatialData()
    body.name, body.joint = "oscillator", _core.JointKind.weld
    data.mass, data.J2 = MASS, np.diag([0.1, 0.2, 0.3])
    data.stiffness, data.damping = np.array([OMEGA**2]), np.zeros((1, 1))
    data.S_bar, data.I_bar = np.zeros((3, 1)), np.zeros((9, 1))
    marker = _core.SpatialMarker()
    marker.Phi = np.zeros((6, 1))
    data.markers = [marker]
    body.data = data
    return _core.SpatialModel([body], [_core.SpatialMarker()], [], [], np.zeros(3))


def test_sizes_of_a_mode_at_rest_are_those_of_its_force():
    """Before it has moved much, f/ω² of the deflection, f/ω of its rate, f of its acceleration: what f leads to."""
    scene = _core.TreeScene()
    scene.add_load(np.array([1.0]), _core.TimeFunction.constant(FORCE))
    one_step = _core.IntegrationControls(
        tolerance=1e-6, max_steps=1, methods=[(_core.MethodKind.dop853, 1.0, 0.0)], spectral_radius=0.8
    )
    stopped_at, rest = _core.TreeCheckpoint(), np.zeros(1)
    run = _core.tree_motion(body_with_a_mode(), scene, [0.0, 10.0], rest, rest, one_step, lambda _: True, stopped_at)
    assert 0 < run.time_reached < 0.5 / OMEGA  # half a radian: cos 0.5 of the static deflection is left to come
    of_modes = stopped_at.state_peaks[2::3]  # groups: ways, angles, modes; of states, rates, accelerations
    np.testing.assert_allclose(of_modes, [FORCE / OMEGA**2, FORCE / OMEGA, FORCE], rtol=1e-12)
