"""Bodies without modes against closed forms, and flexible links that approach them as 1/E."""

import numpy as np
import pytest
from links import ANGLES, TIP, arm, arm_links
from mechanisms import make_model, pcid, relative, revolute
from oracle_runs import joint_forces, run, trajectory_force
from rods import rod, slider_crank

from ffrobot.mbs.quantities.motion import joint_motion

G = 9.81


def inverse(model, **keys):
    outcome = run(model, pcid(**({"tolerance": 1e-9, "output_step": 0.002, "max_steps": 200_000} | keys)))
    assert outcome.status == "completed"
    return outcome


def test_two_link_arm_needs_the_moments_of_the_textbook():
    """Craig, Introduction to Robotics, sec. 6.7, for rods: joint angles on given functions, moments in closed form."""
    l1, l2, m1, m2 = 0.8, 0.6, 3.0, 2.0
    joints = [revolute("O", "ground", "a.root"), revolute("A", "a.tip", "b.root")]
    paths = [
        {"name": "first", "joint": "O", "value": "0.4+0.9*sin(2*t)"},
        {"name": "second", "joint": "A", "value": "-1.1+0.7*cos(3*t)"},
    ]
    angles = {"a": 0.4, "b": 0.0}
    model = make_model([rod("a", l1, m1), rod("b", l2, m2)], joint=joints, trajectory=paths, initial={"angles": angles})
    outcome = inverse(model)

    t = outcome.time
    a1, a1_dot, a1_ddot = 0.4 + 0.9 * np.sin(2 * t), 1.8 * np.cos(2 * t), -3.6 * np.sin(2 * t)
    a2, a2_dot, a2_ddot = -1.1 + 0.7 * np.cos(3 * t), -2.1 * np.sin(3 * t), -6.3 * np.cos(3 * t)
    coupling, arm2 = m2 * l1 * l2 / 2, m2 * l2**2 / 3
    M11 = m1 * l1**2 / 3 + m2 * l1**2 + arm2 + 2 * coupling * np.cos(a2)
    M12 = arm2 + coupling * np.cos(a2)
    gravity2 = m2 * G * l2 / 2 * np.cos(a1 + a2)
    gravity1 = (m1 / 2 + m2) * G * l1 * np.cos(a1) + gravity2
    quadratic = coupling * np.sin(a2)
    tau_O = M11 * a1_ddot + M12 * a2_ddot - quadratic * (2 * a1_dot + a2_dot) * a2_dot + gravity1
    tau_A = M12 * a1_ddot + arm2 * a2_ddot + quadratic * a1_dot**2 + gravity2
    for joint, tau in (("O", tau_O), ("A", tau_A)):
        assert relative(joint_forces(outcome, joint).motor, tau) < 1e-10


def test_slider_crank_moves_as_its_geometry_says():
    """x = r cos φ + √(l² − r² sin² φ), crank turning at a given angle for more than a turn."""
    r, length = 0.2, 0.5
    outcome = inverse(slider_crank({"name": "crank", "joint": "O", "value": "0.9+8*t"}))
    phi, phi_dot = 0.9 + 8 * outcome.time, 8.0
    root = np.sqrt(length**2 - (r * np.sin(phi)) ** 2)
    x = r * np.cos(phi) + root
    x_dot = phi_dot * (-r * np.sin(phi) - r**2 * np.sin(phi) * np.cos(phi) / root)
    slider, rod_ = outcome.coordinates("slider"), outcome.coordinates("rod")
    assert np.abs(outcome.q[:, slider][:, 0] - x).max() < 1e-10
    assert np.abs(outcome.v[:, slider][:, 0] - x_dot).max() < 1e-10
    assert np.abs(outcome.q[:, slider][:, 1:]).max() < 1e-10
    assert np.abs(outcome.q[:, rod_][:, 2] - np.arcsin(-r * np.sin(phi) / length)).max() < 1e-10
    guide, crank = (joint_motion(outcome.motion, name) for name in ("rail", "O"))
    assert np.abs(guide[0][:, 0] - guide[0][0] - (x - x[0])).max() < 1e-10
    assert np.abs(crank[0][:, 0] - phi).max() < 1e-10  # turns are counted
    assert np.abs(crank[1] - phi_dot).max() < 1e-9


def test_slider_crank_force_and_crank_moment_do_the_same_work():
    """F ẋ = τ φ̇ for a loop whose motion is the slider's: what the motor must do in place of the force."""
    outcome = inverse(slider_crank({"name": "slider", "point": "slider.pin", "x": "0.6+0.05*sin(6*t)"}))
    force = trajectory_force(outcome, "slider")[:, 0]
    x_dot = outcome.v[:, outcome.coordinates("slider")][:, 0]
    phi_dot = outcome.v[:, outcome.coordinates("crank")][:, 2]
    assert relative(joint_forces(outcome, "O").motor * phi_dot, force * x_dot) < 1e-10


FACTORS = np.array([1.0, 4.0, 16.0])


def septic(start, end):
    """As `quintic`, with the jerk zero at both ends, too."""
    return f"{float(start)!r}+{float(end - start)!r}*(35*t**4-84*t**5+70*t**6-20*t**7)"


def deviations(law):
    """Peak deviations from rigid links: frame angles, force at the tip, joint moments; a row for each factor on E."""
    keys = {
        "trajectory": [{"name": "tip", "point": "link2.tip", "x": law(TIP[0], 0.4), "y": law(TIP[1], 1.5)}],
        "initial": {"angles": ANGLES, "state": "static"},
    }
    rigid = inverse(arm([rod("link1", 1.0, 1.0), rod("link2", 1.0, 1.0)], **keys))
    result = []
    for factor in FACTORS:
        flexible = inverse(arm(arm_links(EI=600.0 * factor, modes=2), **keys), tolerance=1e-7)
        turns = [flexible.q[:, flexible.coordinates(n)][:, 2] - rigid.q[:, rigid.coordinates(n)][:, 2] for n in ANGLES]
        forces = trajectory_force(flexible, "tip") - trajectory_force(rigid, "tip")
        result.append([np.abs(turns).max(), np.abs(forces).max(), np.abs(flexible.tau - rigid.tau).max()])
    return np.array(result)


def slopes(values):
    return -np.polyfit(np.log(FACTORS), np.log(values), 1)[0]


def test_forces_approach_the_rigid_ones_as_one_over_E_where_the_jerk_starts_from_zero_too():
    assert slopes(deviations(septic)) == pytest.approx([1.0, 1.0, 1.0], abs=0.1)
