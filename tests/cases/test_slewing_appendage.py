"""The spacecraft that turns its boom: what holds without outer forces, and the hub of a rigid one integrated apart."""

import numpy as np
import pytest
from checkpoint_scene_files import solved as run

from ffrobot.common.rotations import exponential, of_quaternion

MASS, CENTER = 200.0, np.array([0.3, 0.1, 0.2])  # of the hub, and where the boom is
INERTIA = np.diag([32.0, 28.0, 36.0])
AXIS = np.array([0.0, 0.6, 0.8])


@pytest.mark.parametrize("name", ["slew", "again"])
def test_momentum_stays_nothing(name, slewing_appendage):
    """To 1e-12 of what the motor gives the boom and takes back, 5 N·m·s; linear momentum likewise, per metre."""
    slew, group = slewing_appendage.file["slew"], slewing_appendage.file[name]
    given = 0.5 * np.abs(slew["joints/drive/moment"]).mean() * slew["time"][-1]
    for kind in ("linear", "angular"):
        assert np.abs(group[f"momentum/{kind}"]).max() < 1e-12 * given


def test_the_motor_alone_makes_the_motion(slewing_appendage):
    one, other = (slewing_appendage.file[name] for name in ("slew", "again"))
    for key in ("points/boom.tip/position", "bodies/hub/angular_velocity", "bodies/boom/modal"):
        np.testing.assert_allclose(other[key], one[key], atol=1e-7 * np.abs(one[key]).max())


def test_its_work_is_the_energy_and_what_damping_takes(slewing_appendage):
    """By Simpson's rule over the outputs, 20 ms apart, of vibrations of 2 Hz and more."""
    group = slewing_appendage.file["slew"]
    t = group["time"][()]
    power = group["joints/drive/moment"][()] * group["joints/drive/rate"][()] - group["energy/dissipated_power"][()]
    energy = group["energy/kinetic"][()] + group["energy/strain"][()]
    work = (t[1] - t[0]) / 3 * np.cumsum(power[:-2:2] + 4 * power[1:-1:2] + power[2::2])
    np.testing.assert_allclose(energy[2::2] - energy[0], work, atol=1e-4 * energy.max())


RIGID = """[body.rigid]
mass = 1.0
center = [1.1, 0.02, 0.05]
inertia = [[0.15, 0.0, 0.01], [0.0, 0.6, 0.0], [0.01, 0.0, 0.7]]
points = { root = [0.0, 0.0, 0.0], tip = [2.5, 0.0, 0.0] }
"""


def hub_by_momentum(times):
    """A (T, 3, 3) of the hub with that rigid boom: the angular velocity that keeps angular momentum at nothing.

    In axes of the hub, about the centre of mass of both, with μ = m M/(m + M), r from centre to centre, R the boom's
    turn: I ω + R J Rᵀ(ω + α̇ n) + μ r × (ω × r + α̇ n × R c) = 0.
    """
    from scipy.integrate import solve_ivp

    m, c = 1.0, np.array([1.1, 0.02, 0.05])
    J = np.array([[0.15, 0.0, 0.01], [0.0, 0.6, 0.0], [0.01, 0.0, 0.7]])
    mu = m * MASS / (m + MASS)

    def rate(t, flat):
        s = min(t / 4, 1.0)
        alpha, alpha_dot = np.pi / 2 * (10 * s**3 - 15 * s**4 + 6 * s**5), np.pi / 8 * 30 * s**2 * (1 - s) ** 2
        R = exponential(alpha * AXIS)
        r, turning = CENTER + R @ c, R @ J @ R.T
        I = INERTIA + turning + mu * (r @ r * np.eye(3) - np.outer(r, r))  # noqa: E741
        h = alpha_dot * (turning @ AXIS + mu * np.cross(r, np.cross(AXIS, R @ c)))
        x, y, z = np.linalg.solve(I, -h)
        return (flat.reshape(3, 3) @ np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])).ravel()

    found = solve_ivp(rate, (0, times[-1]), np.eye(3).ravel(), "DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
    return found.y.T.reshape(-1, 3, 3)


def test_hub_with_a_rigid_boom_turns_as_momentum_says(case_copy_of_module, ffrobot):
    scene = case_copy_of_module("slewing_appendage")
    text = scene.read_text(encoding="utf-8")
    head, tail = text[: text.index("[[payload]]")], text[text.index("[[joint]]") :]
    assert 'link = "boom.toml"\n' in head
    scene.write_text(head.replace('link = "boom.toml"\n', RIGID) + tail, encoding="utf-8")
    with run(ffrobot, scene) as file:
        found = of_quaternion(file["slew/bodies/hub/quaternion"][()])
        expected = hub_by_momentum(file["slew/time"][()])
    np.testing.assert_allclose(found, expected, atol=1e-8)
    assert np.abs(expected[-1] - np.eye(3)).max() > 0.05
