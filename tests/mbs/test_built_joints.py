"""Rotors behind gears and friction in joints: moments in closed form, and what equilibria leave out."""

import numpy as np
import pytest
from links import arm
from mechanisms import checked_scene, make_model, pcid, relative, revolute
from oracle_runs import joint_forces, run
from rods import rod

from ffrobot.mbs.analysis.fcid import Fcid
from ffrobot.mbs.analysis.operating_points import Static

GEARED = {"gear_ratio": 60.0, "rotor_inertia": 2e-4}
FRICTION = {"viscous_friction": 0.3, "coulomb_friction": 0.5, "friction_speed": 0.05}


def geared_arm(links=None, first=GEARED, second=GEARED, **keys):
    joints = [revolute("O", "ground", "link1.root", **first), revolute("A", "link1.tip", "link2.root", **second)]
    return arm(links, joint=joints, **keys)


def test_geared_two_link_arm_needs_the_moments_of_spong():
    """Spong, Modeling and control of elastic joint robots (1987), in the limit of stiff joints: rods with rotors.

    τ_1 gets J₁N₁² α̈_1 and, since the second rotor sits on the first link, J₂(α̈_1 + N₂ γ̈_2); τ_2 J₂N₂(α̈_1 + N₂ γ̈_2).
    """
    J1, N1, J2, N2 = 3e-3, 20.0, 1e-3, 15.0

    def inverse(first, second, kind="pcid"):
        model = make_model(
            [rod("a", 0.8, 3.0), rod("b", 0.6, 2.0)],
            joint=[revolute("O", "ground", "a.root", **first), revolute("A", "a.tip", "b.root", **second)],
            trajectory=[
                {"name": "first", "joint": "O", "value": "0.4+0.9*sin(2*t)"},
                {"name": "second", "joint": "A", "value": "-1.1+0.7*cos(3*t)"},
            ],
            initial={"angles": {"a": 0.4, "b": 0.0}},
        )
        if kind == "fcid":
            return run(model, Fcid(name="i", kind="fcid", shape="zero", end=1.0, output_step=0.01))
        return run(model, pcid(tolerance=1e-9))

    for kind in ("pcid", "fcid"):
        bare = inverse({}, {}, kind)
        geared = inverse({"gear_ratio": N1, "rotor_inertia": J1}, {"gear_ratio": N2, "rotor_inertia": J2}, kind)
        t = bare.time
        alpha, gamma = -3.6 * np.sin(2 * t), -6.3 * np.cos(3 * t)
        rotor = J2 * (alpha + N2 * gamma)
        for joint, expected in (("O", J1 * N1**2 * alpha + rotor), ("A", N2 * rotor)):
            added = joint_forces(geared, joint).motor - joint_forces(bare, joint).motor
            assert relative(added, expected) < 1e-9, (kind, joint)


def test_equilibrium_knows_neither_rotors_nor_friction():
    static, keys = Static(name="static", kind="static"), {"motors": "section"}
    with_them = run(geared_arm(None, GEARED | FRICTION, GEARED | FRICTION, **keys), static)
    without = run(geared_arm(None, {}, {}, **keys), static)
    np.testing.assert_allclose(with_them.q, without.q, atol=1e-12)
    np.testing.assert_allclose(with_them.tau, without.tau, rtol=1e-9)


@pytest.mark.parametrize(("closed", "driven"), [(False, ["O", "A"]), (True, [])])
def test_motors_are_in_all_joints_of_open_chains(closed, driven):
    joints = [revolute("O", "ground", "a.root"), revolute("A", "a.tip", "b.root")]
    scene = checked_scene(joints + [revolute("B", "b.tip", "ground", at=(1.0, 0.0))] * closed, bodies=("a", "b"))
    assert [joint.name for joint in scene.motor_joints] == driven
