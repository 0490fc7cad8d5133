"""Rotors behind gears and friction in joints: closed forms, energy, and the same equations written out densely."""

import numpy as np
import pytest
from links import ANGLES, arm, arm_links
from mechanisms import checked_scene, forward, make_model, pcid, relative, revolute
from oracle_runs import joint_forces, run
from rods import rigid_body, rod

from ffrobot.common.errors import InputError
from ffrobot.mbs.analysis.fcid import Fcid
from ffrobot.mbs.analysis.operating_points import Static
from ffrobot.mbs.inversion.motors_only import MotorsOnly

G = 9.81
AT_REST = {"state": "static", "angles": ANGLES}
GEARED = {"gear_ratio": 60.0, "rotor_inertia": 2e-4}
FRICTION = {"viscous_friction": 0.3, "coulomb_friction": 0.5, "friction_speed": 0.05}


def geared_arm(links=None, first=GEARED, second=GEARED, **keys):
    joints = [
        revolute("O", "ground", "link1.root", **first),
        revolute("A", "link1.tip", "link2.root", **second),
    ]
    return arm(links, joint=joints, **keys)


def test_swing_of_a_pendulum_with_a_geared_rotor():
    """A small swing from rest is a cosine with ω² = (m g L/2)/(m L²/3 + N² J)."""
    L, m, J, N, angle = 0.7, 2.0, 3e-3, 9.0, 1e-4
    model = make_model(
        [rod("a", L, m)],
        joint=[revolute("O", "ground", "a.root", gear_ratio=N, rotor_inertia=J)],
        initial={"angles": {"a": -np.pi / 2 + angle}},
    )
    omega = np.sqrt(m * G * L / 2 / (m * L**2 / 3 + N**2 * J))
    outcome = run(model, forward(end=2.0, tolerance=1e-9))
    swing = outcome.q[:, 2] + np.pi / 2
    assert np.abs(swing - angle * np.cos(omega * outcome.time)).max() < 1e-7 * angle


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


def test_motors_alone_carry_rotors_and_friction_along():
    """Inverse dynamics with motors only, applied to the flexible arm, brings its tip along the path."""
    model = geared_arm(arm_links(modes=2), GEARED | FRICTION, GEARED | FRICTION, initial=AT_REST)
    servo = MotorsOnly(name="servo", kind="motors-only", end=1.0, output_step=0.01)
    source = run(model, servo)
    replay = forward(actuation="servo", apply="joints", tolerance=1e-7)
    outcome = run(model, replay, source)
    assert source.q.shape == outcome.q.shape
    assert relative(outcome.q, source.q) < 1e-5


def test_a_prismatic_joint_moves_the_reflected_mass():
    """A slider of mass m on rails, pulled by F: ẍ = F/(m + J N²)."""
    J, N = 2e-3, 30.0
    slider = rigid_body("s", 0.4, 0.01, (0.0, 0.0), {"pin": (0.0, 0.0)})
    rail = {"name": "rail", "type": "prismatic", "between": ("ground", "s.pin"), "axis": (1.0, 0.0)}
    model = make_model(
        [slider], joint=[rail | {"gear_ratio": N, "rotor_inertia": J}], load=[{"point": "s.pin", "x": "3.0"}]
    )
    outcome = run(model, forward())
    np.testing.assert_allclose(outcome.a[:, 0], 3.0 / (0.4 + J * N**2), rtol=1e-12)


def test_equilibrium_knows_neither_rotors_nor_friction():
    static, keys = Static(name="static", kind="static"), {"motors": "section"}
    with_them = run(geared_arm(None, GEARED | FRICTION, GEARED | FRICTION, **keys), static)
    without = run(geared_arm(None, {}, {}, **keys), static)
    np.testing.assert_allclose(with_them.q, without.q, atol=1e-12)
    np.testing.assert_allclose(with_them.tau, without.tau, rtol=1e-9)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"rotor_inertia": -1.0}, "a number of at least 0"),
        ({"gear_ratio": 0.0}, "greater than 0"),
        ({"friction_speed": 0.1}, "only with coulomb_friction"),
        ({"type": "weld", "viscous_friction": 1.0}, "in a weld joint"),
    ],
)
def test_bad_keys_are_refused(keys, expected):
    with pytest.raises(InputError, match=expected):
        checked_scene([revolute("O", "ground", "a.root") | keys])


@pytest.mark.parametrize(("closed", "driven"), [(False, ["O", "A"]), (True, [])])
def test_motors_are_in_all_joints_of_open_chains(closed, driven):
    joints = [revolute("O", "ground", "a.root"), revolute("A", "a.tip", "b.root")]
    scene = checked_scene(joints + [revolute("B", "b.tip", "ground", at=(1.0, 0.0))] * closed, bodies=("a", "b"))
    assert [joint.name for joint in scene.motor_joints] == driven
