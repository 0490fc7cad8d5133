"""Rigid robots from their URDF through `ffrobot import` and `ffrobot solve`: motor moments against other codes."""

import re

import h5py
import numpy as np
import pytest
from rigid_robots import ROBOTS, moments, with_motion

# Motor moments at q = 0.1(1 … n), q̇ = 0.2(n … 1), q̈ = 0.3 cos(0 … n − 1), gravity −9.81 along z, no friction: Pinocchio
# 2.6.20 and MuJoCo 4.0.0, equal to all these digits.
OTHERS = {
    "ur5": [-2.19784031, -54.77458172, -12.468253, 0.17824312, 0.47975015, -0.05791279],
    "z1": [0.140006549, 4.44682343, -7.27741968, -1.5586138, 0.553306243, 0.0226056378, 0.00447557451],
}


def solved_moments(ffrobot, urdf, folder, motion, *, friction=False):
    """{joint: moment} at t = 0, with the friction of the URDF or without."""
    ffrobot.ok("import", urdf, "-o", folder)
    scene = folder / "scene.toml"
    text = scene.read_text()
    if not friction:
        text = re.sub(r"^(viscous|coulomb)_friction = .*\n", "", text, flags=re.MULTILINE)
    scene.write_text(with_motion(text, *motion))
    ffrobot.ok("solve", scene)
    with h5py.File(scene.with_suffix(".results.h5")) as file:
        return {name: float(joint["moment"][0]) for name, joint in file["inverse/joints"].items() if "moment" in joint}


def joint_names(urdf):
    return re.findall(r'<joint name="(\w+)" type="(?!fixed)', urdf.read_text())


@pytest.mark.parametrize("robot", OTHERS)
def test_real_arms(robot, tmp_path, ffrobot):
    urdf = ROBOTS / f"{robot}.urdf"
    names = joint_names(urdf)
    n = len(names)
    values = 0.1 * np.arange(1, n + 1), 0.2 * np.arange(n, 0, -1), 0.3 * np.cos(np.arange(n))
    motion = [dict(zip(names, row, strict=True)) for row in values]
    found = solved_moments(ffrobot, urdf, tmp_path, motion)
    expected = OTHERS[robot]
    np.testing.assert_allclose([found[name] for name in names], expected, rtol=1e-8, atol=5e-9)
    of_urdf = moments(urdf.read_text(), *motion)
    np.testing.assert_allclose([found[name] for name in names], [of_urdf[name] for name in names], atol=1e-11)


def test_friction_of_joints(tmp_path, ffrobot):
    """<dynamics> of the Z1, damping c and friction τ_c, at rest and beside v_s = 0.01 rad/s: c q̇ + τ_c tanh(q̇/v_s)."""
    urdf = ROBOTS / "z1.urdf"
    names = joint_names(urdf)
    n = len(names)
    motion = [dict.fromkeys(names, value) for value in (0.2, 0.0, 0.1)]
    motion[1] = dict(zip(names, 0.004 * np.arange(n) - 0.012, strict=True))
    without = solved_moments(ffrobot, urdf, tmp_path / "without", motion)
    found = solved_moments(ffrobot, urdf, tmp_path / "with", motion, friction=True)
    dynamics = {
        name: [float(value) for value in re.findall(r'<dynamics damping="(.*?)" friction="(.*?)"', text)[0]]
        for name, text in re.findall(r'<joint name="(\w+)"(.*?)</joint>', urdf.read_text(), flags=re.DOTALL)
        if name in names
    }
    for name in names:
        c, tau_c = dynamics[name]
        assert c > 0 or tau_c > 0
        rate = motion[1][name]
        assert found[name] - without[name] == pytest.approx(c * rate + tau_c * np.tanh(rate / 0.01), abs=1e-12)
