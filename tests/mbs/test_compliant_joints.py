"""Gears that give: steps of stiffness in closed form, and motors that carry out an inverse analysis."""

import numpy as np
import pytest
from links import ANGLES, TIP, arm, arm_links, quintic, ritz_link
from mechanisms import forward, make_model, pcid, relative, revolute
from oracle_runs import place_of, run, total_energy
from rods import rod

from ffrobot.common.errors import InputError
from ffrobot.mbs.analysis.operating_points import Static
from ffrobot.mbs.inversion.motors_only import MotorsOnly
from ffrobot.mbs.joints.joint import StiffnessSteps, TwistSpring
from ffrobot.mbs.linear.joint_conditions import joint_conditions
from ffrobot.mbs.linear.linearisation import LinearEquations
from ffrobot.mbs.model.gears import with_compliance
from ffrobot.mbs.quantities.supply import gear_motions, motor_motion
from ffrobot.mbs.run.gears import unresolved_gears, with_motor_coordinates

L, M, J, N, K = 0.7, 2.0, 3e-3, 9.0, 500.0
MOTOR, LINK = J * N**2, M * L**2 / 3
GIVES = {"gear_ratio": N, "rotor_inertia": J, "stiffness": K}
GEARED = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 3e3, "damping": 2.0}
RIGID = {key: GEARED[key] for key in ("gear_ratio", "rotor_inertia")}


def pendulum(load="0", trajectory=(), **keys):
    """A rod in no field of gravity, turned, or shifted, by a motor behind a compliant gear."""
    return make_model(
        [rod("a", L, M)], joint=[revolute("O", "ground", "a.root") | GIVES | keys],
        load=[] if trajectory else [{"joint": "O", "moment": load}], trajectory=trajectory, gravity=(0.0, 0.0),
    )  # fmt: skip


def geared_arm(first, second=None, **keys):
    joints = [
        revolute("O", "ground", "link1.root", **first),
        revolute("A", "link1.tip", "link2.root", **(second or first)),
    ]
    return arm(arm_links(EI=300.0, modes=2, damping_ratio=0.02), joint=joints, **keys)


def linearised(robot, q, v, a):
    """With compliant gears."""
    return LinearEquations(with_compliance(robot.model.without_paths()), q).at(0.0, q, v, a)


def rigid_arm(first, second, **keys):
    """Rods under the rest-to-rest path of the flexible arm."""
    joints = [revolute("O", "ground", "a.root", **first), revolute("A", "a.tip", "b.root", **second)]
    path = {"name": "tip", "point": "b.tip", "x": quintic(TIP[0], 0.4), "y": quintic(TIP[1], 1.5)}
    angles = dict(zip("ab", ANGLES.values(), strict=True))
    tables = {"joint": joints, "trajectory": [path], "initial": {"angles": angles}}
    return make_model([rod("a", 1.0, 1.0), rod("b", 1.0, 1.0)], **(tables | keys))


def carried_out(model, end=1.0):
    """Distance (T,) of the tip from its path when the motors do what the inverse analysis says; and that analysis."""
    source = run(model, pcid(tolerance=1e-9, end=end, output_step=0.0025))
    replay = forward(actuation="inverse", apply="joints", tolerance=1e-9, end=end, output_step=0.0025)
    outcome = run(model, replay, source)
    assert outcome.status == "completed"
    tip = f"{model.bodies[-1].name}.tip"
    error = place_of(outcome, tip) - place_of(source, tip)
    return np.linalg.norm(error, axis=1), source, outcome


def nonic(start, end):
    """From rest to rest in a second with jerk and snap of zero at both ends."""
    return f"{float(start)!r}+{float(end - start)!r}*(126*t**5-420*t**6+540*t**7-315*t**8+70*t**9)"


@pytest.mark.parametrize(("second", "left"), [(RIGID, 1e-6), (GEARED, 2e-5)])
def test_motors_alone_carry_flexible_links_behind_gears_that_give(second, left):
    """By stable inversion: 7e-7 and 9e-6 m are left, where moments of rigid gears leave 1.3e-3 and 1.9e-3 m.

    The quintic's jumps of the jerk would ask the motor for impulses: it leaves 1e-3 m.
    """
    path = {"name": "tip", "point": "link2.tip", "x": nonic(TIP[0], 0.4), "y": nonic(TIP[1], 1.5)}
    model = geared_arm(GEARED, second, initial={"state": "static", "angles": ANGLES}, trajectory=[path])
    servo = MotorsOnly(name="servo", kind="motors-only", end=1.0, output_step=0.005)
    source = run(model, servo)
    replay = forward(actuation="servo", apply="joints", tolerance=1e-8, output_step=0.005)
    outcome = run(model, replay, source)
    error = place_of(outcome, "link2.tip") - place_of(source, "link2.tip")
    assert np.linalg.norm(error, axis=1).max() < left


def test_coarse_outputs_are_told_of():
    model = rigid_arm(GEARED | {"stiffness": 30.0}, RIGID)
    source = run(model, pcid(tolerance=1e-6, output_step=0.05))
    (line,) = unresolved_gears(gear_motions(source.motion))
    assert "refine output_step" in line


def test_dampers_that_hold_a_gear_for_good_are_refused():
    """Moments say nothing of a twist that takes 15 000 analyses to come; splines would have no solution to rounding."""
    model = rigid_arm(GEARED | {"damping": 4.5e7}, RIGID)
    with pytest.raises(InputError, match=r'joint "O": damping: expected .* within 1e\+04 s .*, found 1.5e\+04'):
        gear_motions(run(model, pcid(tolerance=1e-6)).motion)


def test_equilibrium_winds_the_gears():
    """About it, forces are needed along the motors alone: springs carry the links."""
    held = [{"name": name, "joint": name, "value": value} for name, value in (("O", "0.4"), ("A", "0.9"))]
    model = geared_arm(GEARED, trajectory=held)
    about = run(model, Static(name="static", kind="static"))
    q = with_motor_coordinates(about.outcome, with_compliance(model.model.without_paths())).q[0]
    mechanism = linearised(model, q, *np.zeros((2, len(q))))
    along = [mechanism.names.index(f"motor/{joint}") for joint in "OA"]
    assert mechanism.force[along].min() > 1.0
    expected = [gear_motions(about.motion)[joint].moment[0] for joint in "OA"]
    np.testing.assert_allclose(mechanism.force[along], expected, rtol=1e-9)
    assert np.abs(np.delete(mechanism.force, along)).max() < 1e-9 * mechanism.force[along].max()


def test_what_does_not_go_is_refused():
    with pytest.raises(InputError, match="a joint with a motor"):
        run(pendulum(motor=False), forward())
    model = geared_arm(GEARED)
    source = run(model, pcid(end=0.1))
    with pytest.raises(InputError, match='"joints" or "joints\\+pzt" for joints'):
        run(model, forward(actuation="inverse", apply="trajectory", end=0.1), source)
    loaded = geared_arm(GEARED, load=[{"joint": "O", "moment": "1"}])
    with pytest.raises(InputError, match=r"expected no \[\[load\]\] on"):
        gear_motions(run(loaded, pcid(end=0.1)).motion)


K1, K2, KNEE = 400.0, 1200.0, 0.4  # N·m/rad up to a torque of 0.4 N·m, N·m/rad beyond
STEPS = {"values": (K1, K2), "torques": (KNEE,)}


def swing_beyond_a_knee(tau, t):
    """The twist of two masses by a constant τ, from rest: two sinusoids that meet at the knee, to and fro.

    δ̈ = τ/I_m − k(δ) (1/I_m + 1/I), so that δ₁ = a₁ (1 − cos ω₁t) up to the knee δ_k = T/k₁, from there on an
    oscillation at ω₂ about e₂, where k(e₂)(1/I_m + 1/I) = τ/I_m.
    """
    m = 1 / MOTOR + 1 / LINK
    o1, o2, knee = np.sqrt(K1 * m), np.sqrt(K2 * m), KNEE / K1
    a1 = tau / MOTOR / o1**2
    e2 = knee + (tau / MOTOR / m - KNEE) / K2
    t1 = np.arccos(1 - knee / a1) / o1
    rate = a1 * o1 * np.sin(o1 * t1)
    size = np.hypot(knee - e2, rate / o2)
    start = np.arctan2(-rate / o2, knee - e2)  # of the phase: e₂ + size cos(ω₂ s + start)
    half = -start / o2  # to the largest twist
    period = 2 * (t1 + half)
    s = np.abs((t + period / 2) % period - period / 2)  # as far from rest, whichever way
    return np.where(s < t1, a1 * (1 - np.cos(o1 * s)), e2 + size * np.cos(o2 * (s - t1) + start)), e2 + size


def test_a_gear_that_stiffens_swings_as_two_sinusoids():
    """Forward dynamics against the closed form; energy is kept, and beyond the knee for a good part of the time."""
    tau, t = 2.0, np.linspace(0.0, 1.0, 101)
    outcome = run(pendulum(str(tau), stiffness=STEPS), forward(tolerance=1e-10))
    expected, most = swing_beyond_a_knee(tau, t)
    twist = motor_motion(outcome.motion, "O")[0] - outcome.q[:, 2]
    assert relative(twist, expected) < 1e-6
    assert most > 1.5 * KNEE / K1
    gear = motor_motion(outcome.motion, "O")[2]
    beyond = np.abs(twist) > KNEE / K1
    np.testing.assert_allclose(gear, np.where(beyond, KNEE + K2 * (twist - KNEE / K1), K1 * twist), atol=1e-12)
    work = tau * motor_motion(outcome.motion, "O")[0]
    energies, _ = total_energy(outcome)
    np.testing.assert_allclose(energies - energies[0], work - work[0], atol=1e-7 * np.abs(work).max())


@pytest.mark.parametrize(("torque", "slope"), [(0.2, K1), (-0.2, K1), (3.0, K2), (-3.0, K2)])
def test_the_linear_model_has_the_slope_of_its_torque(torque, slope):
    """A weight holds the gear at a torque: the twist by the closed form, and √(k/I) of the link with the motor held."""
    spring = TwistSpring.of(StiffnessSteps(**STEPS))
    twist = np.copysign(min(abs(torque), KNEE) / K1 + max(abs(torque) - KNEE, 0.0) / K2, torque)
    assert spring.twist(np.array(torque)) == pytest.approx(twist, rel=1e-14)
    assert spring.moment(np.array(twist)) == pytest.approx(torque, rel=1e-14)
    model = with_compliance((pendulum(stiffness=STEPS).model).without_paths())
    q = np.zeros(model.tree.n_q)
    (gear,) = model.tree.gears
    q[gear.motor.q.start] = twist
    mechanism = LinearEquations(model, q).at(0.0, q, *np.zeros((2, model.tree.n_v)))
    held = joint_conditions(mechanism)["compliant"].modes.frequency
    assert held == pytest.approx([np.sqrt(slope / LINK) / (2 * np.pi)], rel=1e-10)


@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_motors_behind_stepped_gears_carry_out_the_path(damping):
    """Inverse dynamics finds k(δ) + c δ̇ = τ: the replay stays on the path up to the kinks that the spline rounds."""
    steps = {"values": (2e3, 3e3, 4e3), "torques": (2.0, 6.0)}
    error, source, _ = carried_out(rigid_arm(RIGID | {"stiffness": steps, "damping": damping}, RIGID))
    gear = gear_motions(source.motion)["O"]
    spring = TwistSpring.of(StiffnessSteps(**steps))
    assert np.abs(gear.gear_moment).max() > 6.0
    np.testing.assert_allclose(
        spring.moment(gear.twist[:, 0]) + damping * gear.twist[:, 1], gear.gear_moment,
        atol=1e-8 * np.abs(gear.gear_moment).max(),
    )  # fmt: skip
    assert error.max() < 1e-5  # m; 5e-3 with rigid moments


@pytest.mark.parametrize(("stiffness", "error"), [(1e10, 1e-6), (1e13, 1e-3)])
def test_gears_as_stiff_as_rigid_ones_transmit_their_torques_to_round_off_which_is_told(stiffness, error):
    """Torques of the rigid gear: round-off of an angle of one radian is 2e-6 N·m, or 2e-3 N·m, of 5.3."""
    path = {"name": "tip", "motor": "O", "value": nonic(0.0, 1.0)}
    outcome = run(pendulum(trajectory=[path], stiffness=stiffness), pcid())
    x = np.polynomial.Polynomial([0.0] * 5 + [126.0, -420.0, 540.0, -315.0, 70.0])
    assert relative(outcome.tau[:, 0], (MOTOR + LINK) * x.deriv(2)(outcome.time)) < error
    assert outcome.statistics.integrator.name == "radau"
    assert outcome.statistics.steps < 200
    told = "stiff gears amplify round-off of angles" in " ".join(outcome.statistics.warnings)
    assert told == (error > 1e-6)


def test_a_light_stiff_link_behind_a_driven_motor_takes_no_more_steps_than_without_the_gear():
    """Its root has next to no inertia under spring and damper, which implicit steps solve and explicit ones follow."""
    link = ritz_link("crank", "cantilever", length=0.12, mass=0.24, EI=1130.0, modes=4, damping_ratio=0.05)
    gear = {"stiffness": 1e4, "damping": 5.0, "rotor_inertia": 1e-4}

    def moved(followed, keys, **asked):
        path = {"name": "turn", followed: "A", "value": "0.3*(1 - cos(6*t))"}
        joint = revolute("A", "ground", "crank.root", **keys)
        model = make_model([link], joint=[joint], trajectory=[path], gravity=(0.0, 0.0))
        return run(model, pcid(end=0.1, **asked))

    geared, direct = moved("motor", gear), moved("joint", {})
    exact = moved("motor", gear, tolerance=1e-9, integrator="radau", max_steps=50_000)
    assert geared.statistics.steps < 1.5 * direct.statistics.steps
    assert relative(geared.q, exact.q) < 1e-6
