"""Friction and loads in all joints of a loop in 3D, where one of them is cut: the numbers of the planar scene."""

import numpy as np
import pytest
from four_bar import SIDES, in_3d, planar
from scipy.interpolate import CubicSpline
from tables_3d import solved

import ffrobot
from ffrobot.actuation.control.robot import RigidArm
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.run.bodies import load_bodies

ROUGH = {"viscous_friction": 0.3, "coulomb_friction": 0.2, "friction_speed": 0.05}
TIMES = {"end": 0.5, "output_step": 0.01, "tolerance": 1e-10}
INVERSE = {"name": "inverse", "kind": "pcid"} | TIMES


def of_joints(order):
    return {name: ROUGH | ({"rotor_inertia": 1e-4, "gear_ratio": 30.0} if name == "A" else {}) for name in order}


def close(found, expected, share=1e-9):
    np.testing.assert_allclose(found, expected, rtol=0, atol=share * max(np.abs(expected).max(), 1e-3))


@pytest.mark.parametrize("name", SIDES)
def test_friction_and_rotors_in_every_joint_of_a_loop(name):
    """The motor gives what friction takes and the rotor gains; the loop is cut elsewhere."""
    plain, built = (
        solved(in_3d({key: {} for key in SIDES} | {name: keys}, [INVERSE]))
        for keys in ({}, {"viscous_friction": 2.0, "rotor_inertia": 0.7})
    )
    rate, body = built[f"inverse/joints/{name}/rate"], SIDES[name][0].partition(".")[0]
    spin = rate if body == "ground" else rate + built[f"inverse/bodies/{body}/angular_velocity"][:, 2]
    power, energy = 2.0 * rate**2, 0.35 * spin**2
    keys = ("joints/A/moment", "energy/kinetic")
    moment, kinetic = (built[f"inverse/{key}"] - plain[f"inverse/{key}"] for key in keys)
    assert np.ptp(rate) > 0.1
    np.testing.assert_allclose(built["inverse/energy/dissipated_power"], power, atol=1e-9)
    np.testing.assert_allclose(kinetic, energy, atol=1e-9)
    t, work = built["inverse/time"], moment * built["inverse/joints/A/rate"]
    gained = CubicSpline(t, energy)(t, 1)
    inside = slice(5, -5)  # where the spline has neighbours on both sides
    np.testing.assert_allclose(work[inside], (power + gained)[inside], atol=1e-5 * np.abs(work).max())


@pytest.mark.parametrize("cut", ["D", "C"])
def test_computed_torque_knows_the_friction_of_the_joint_that_is_cut(cut):
    own = of_joints([*(name for name in "ABCD" if name != cut), cut])
    scene = ffrobot.make_scene(**in_3d(own, [INVERSE]))
    results = ffrobot.solve(scene)
    t, moment, rate = (results[f"inverse/{key}"][30] for key in ("time", "joints/A/moment", "joints/A/rate"))
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])
    assert [joint.name for joint in model.tree.loops] == [cut]
    arm = RigidArm(model, undeformed_posture(model).q)
    found = arm.moments(*(np.array([x]) for x in (1 + 0.3 * (1 - np.cos(3 * t)), rate, 2.7 * np.cos(3 * t))))
    np.testing.assert_allclose(found, moment, rtol=1e-8)


@pytest.mark.parametrize(
    ("keys", "named"),
    [({"motor": True}, "motor"), ({"motor": True, "rotor_inertia": 1e-3, "stiffness": 100.0}, "stiffness")],
)
def test_motors_without_a_rotor_and_compliant_gears_in_all_joints_are_refused(keys, named):
    scene = ffrobot.make_scene(**in_3d(dict.fromkeys(SIDES, keys), [INVERSE]))
    expected = 'joint "D": expected a loop with a joint that has neither a motor without rotor_inertia'
    with pytest.raises(ffrobot.InputError, match=f'{expected}.*found "{named}"'):
        ffrobot.solve(scene)


BUILT = ROUGH | {"rotor_inertia": 0.05, "gear_ratio": 3.0}


@pytest.mark.parametrize(("limits", "is_told"), [([0.0, 1.0], True), ([0.0, 1.5], False)])
def test_limits_of_the_joint_that_is_cut(limits, is_told):
    own = of_joints("ABDC")
    own["C"] = ROUGH | {"position_limit": limits}
    results = solved(in_3d(own, [INVERSE]))
    peak = results["inverse/joints/C/coordinate"].max()
    assert 1.0 < peak < 1.5
    told = [text for text in results.warnings.get("inverse", ()) if 'joint "C": leaves its position_limit' in text]
    assert len(told) == is_told
    assert all(f"to {peak:.6g} rad" in text for text in told)


ENCODERS = [{"joint": name, "measure": measure} for name in ("C", "A") for measure in ("value", "rate")]
HELD = {
    "name": "held", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.005, "delay": 0.001,
    "disturbance": [{"point": "coupler.tip", "y": "4.0"}], "sensor": ENCODERS, "tip": "coupler.tip",
    "controller": [{"kind": "joint-pid", "proportional": {"A": 20.0}, "derivative": {"A": 1.0}}],
} | TIMES  # fmt: skip


@pytest.mark.parametrize("built", [{}, dict.fromkeys("ABCD", BUILT)], ids=["one rotor", "rotors in all joints"])
def test_sensors_on_any_joint_of_a_loop(built):
    """Also on the one that is listed last, at which it would be cut; with rotors in all, where it is cut."""
    own = of_joints("ABDC") | built
    expected, found = (solved(tables(own, [INVERSE, HELD])) for tables in (planar, in_3d))
    outputs, known = (list(results.attributes("held/control")["outputs"]) for results in (found, expected))
    assert {"joint/C", "joint/C/rate", "joint/A"} <= set(outputs)
    for number, output in enumerate(known):
        readings = expected["held/control/readings"][:, number]
        close(found["held/control/readings"][:, outputs.index(output)], readings, 1e-8)
    close(found["held/control/commands"], expected["held/control/commands"], 1e-8)
    assert np.ptp(found["held/control/readings"][:, outputs.index("joint/C")]) > 0.1


def test_sensors_on_all_joints_of_a_loop_without_a_rotor_are_refused():
    own = {name: ROUGH for name in SIDES}
    sensed = HELD | {"sensor": [{"joint": name} for name in SIDES]}
    with pytest.raises(ffrobot.InputError, match=r'expected one with coordinates, found "D".* at which a loop is cut'):
        solved(in_3d(own, [INVERSE, sensed]))


@pytest.mark.parametrize("tables", [planar, in_3d])
def test_loops_without_motors_have_no_torques_and_say_so(tables):
    analyses = [{"name": "inverse", "kind": "pcid", "end": 0.02, "output_step": 0.01}]
    for has_motor in (True, False):
        keys = tables({"A": {"motor": has_motor}} | {name: {} for name in "BCD"}, analyses)
        found = solved(keys).verdict["inverse"].notes
        assert any(text.startswith("no motors, so no torques") for text in found) != has_motor
