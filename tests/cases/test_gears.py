"""Compliant gears, in 3D: two masses on a spring, momentum and energy, acting again."""

import numpy as np
import pytest
import tables_3d
from checkpoints import CASES
from scipy.integrate import simpson
from scipy.linalg import eigh
from tables_3d import ORIGIN, revolute, solved

from ffrobot.common.errors import SolveError
from ffrobot.mbs.joints.joint import TwistSpring
from ffrobot.mbs.run.gears import GearSpring, gear_motion

J, N, K = 3e-3, 9.0, 500.0
GIVES = {"gear_ratio": N, "rotor_inertia": J, "stiffness": K}
GEARED = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 3e3, "damping": 2.0}
RUN = {"name": "run", "kind": "forward", "end": 1.0, "output_step": 0.002, "tolerance": 1e-10, "integrator": "dop853"}
FIRM = {"gear_ratio": 30.0, "rotor_inertia": 1e-4}
SOFTER = FIRM | {"stiffness": 1e3, "damping": 0.7}
AXIS = np.array([0.48, -0.6, 0.64])  # of length 1


def rigid(name, inertia, mass=1.0, center=ORIGIN):
    return tables_3d.rigid(name, mass, inertia, center, tip=[0.5, 0.1, -0.2])


def scene(bodies, joints, *analyses, **tables):
    return tables_3d.scene(bodies, joints, *analyses, **{"gravity": ORIGIN} | tables)


INERTIA = np.diag([0.3, 0.2, 0.4])
I_B = AXIS @ INERTIA @ AXIS


def motor_and_body(turned):
    """A body on the ground behind a gear that gives, and the inertia (2, 2) of its motor's angle and of the body's.

    I_m = J N² where the rotor sits on the ground; on the body, that turns then (first of `between`), u = (N − 1) γ̇'
    and I has its part: with coordinates q of the body and θ_m the kinetic energy is ½ I q̇² + ½ J (N θ̇_m + q̇)², and
    q = −γ.
    """
    sides = ("b.root", "ground") if turned else ("ground", "b.root")
    M = np.array([[N**2 * J, -N * J], [-N * J, I_B + J]]) if turned else np.diag([N**2 * J, I_B])
    return [rigid("b", INERTIA.tolist())], [revolute("O", *sides, AXIS, **GIVES)], M


@pytest.mark.parametrize("turned", [False, True])
def test_two_masses_turn_and_swing(turned):
    """A moment τ behind the gear: the center of inertia turns with τ/(I_m + I), the twist goes as 1 − cos ωt."""
    tau, (*of_scene, M) = 2.0, motor_and_body(turned)
    with solved(scene(*of_scene, RUN, load=[{"joint": "O", "moment": str(tau)}])) as found:
        t, gamma, motor = (found[f"run/{key}"] for key in ("time", "joints/O/coordinate", "joints/O/motor_angle"))
    values, T = eigh(K * np.array([[1, -1], [-1, 1]]), M)  # modes of (θ_m, γ)
    along, omega = T.T @ [tau, 0.0], np.sqrt(values[1])
    expected = T @ np.stack([along[0] * t**2 / 2, along[1] / omega**2 * (1 - np.cos(omega * t))])
    assert abs(values[0]) < 1e-9 * values[1]
    np.testing.assert_allclose([motor, gamma], expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("turned", [False, True])
def test_linear_model_of_a_motor_behind_its_gear(turned):
    """The frequency at which it swings against the body; θ = γ far below: both turn together."""
    *of_scene, M = motor_and_body(turned)
    expected = np.sqrt(eigh(K * np.array([[1, -1], [-1, 1]]), M, eigvals_only=True)[1])
    with solved(scene(*of_scene, {"name": "rest", "kind": "linear"})) as results:
        assert results["rest/linear/frequency"][0, 1] == pytest.approx(expected / (2 * np.pi), rel=1e-9)
        (model,) = results.linear("rest")
    low = model.frequency_response(np.array([1e-3]), "joint/O", ["joint/O", "motor/O"])[0, :, 0]
    np.testing.assert_allclose(low, -1e6 / M.sum(), rtol=1e-4)


def free_arm():
    """Two bodies on a free one, joints askew, rotors on links that turn: no axis is a principal one."""
    bodies = [
        rigid("base", [0.3, 0.2, 0.4], 2.0, [0.1, 0.0, 0.05]),
        rigid("a", [0.05, 0.04, 0.03], 0.8, [0.2, 0.1, 0.0]),
        rigid("b", [0.02, 0.05, 0.04], 0.5, [0.1, -0.1, 0.1]),
    ]
    soft = GIVES | {"stiffness": 1.0}
    first = revolute("A", "base.tip", "a.root", AXIS, **soft)
    second = revolute("B", "b.root", "a.tip", [1.0, 0.5, 0.2], **soft)  # its rotor sits on b
    return scene(bodies, [first, second], RUN, initial={"joint_rates": {"A": 2.0, "B": -3.0}})


def test_momentum_and_energy_of_a_free_arm_are_kept():
    with solved(free_arm()) as found:
        for key in ("linear", "angular"):
            momentum = found[f"run/momentum/{key}"]
            np.testing.assert_allclose(momentum, momentum[:1] + 0 * momentum, atol=2e-8 * np.abs(momentum).max())
        energy = found["run/energy/kinetic"] + found["run/energy/strain"]
        assert np.ptp(found["run/energy/strain"]) > 0.01 * energy[0]
        np.testing.assert_allclose(energy, energy[0], rtol=2e-8)


def test_replays_behind_gears_are_as_good_as_outputs_are_close():
    """Motors act by splines through the outputs of the inverse analysis: with the fourth power of their step at least.

    Steps of the integrators have no part in it: the path of a rigid arm is known at any time.
    """
    arm = rigid("arm", [0.02, 0.05, 0.04], 0.8, [0.3, 0.1, 0.0])
    path = "0.9*(10*(t/0.3)**3 - 15*(t/0.3)**4 + 6*(t/0.3)**5)"
    apart = []
    for outputs in (20, 80, 320):
        analyses = [
            {"name": "inverse", "kind": "pcid", "end": 0.3, "output_step": 0.3 / outputs},
            RUN | {"actuation": "inverse", "apply": "joints", "end": 0.3, "output_step": 0.015},
        ]
        joint = revolute("A", "ground", "arm.root", AXIS, **SOFTER)
        keys = {"gravity": [0.0, 0.0, -9.81], "trajectory": [{"name": "path", "joint": "A", "value": path}]}
        with solved(scene([arm], [joint], *analyses, **keys)) as found:
            exact = found["inverse/joints/A/coordinate"][:: outputs // 20]
            apart.append(np.abs(found["run/joints/A/coordinate"] - exact).max())
    assert apart[0] > 1e-8
    assert np.all(np.divide(apart[:-1], apart[1:]) > 4.0**4)


@pytest.mark.parametrize("second", [FIRM, SOFTER], ids=["stiff", "soft"])
@pytest.mark.parametrize("between", [("b.root", "a.tip"), ("a.tip", "b.root")])
@pytest.mark.parametrize(("kind", "followed"), [("pcid", "joint"), ("pcid", "motor"), ("fcid", "joint")])
def test_inverse_analyses_account_for_what_gears_store_and_lose(kind, followed, between, second):
    """What motors put in is in kinetic, strain and gravitational energy, or dissipated; springs k δ² / 2, c δ̇².

    The rotor of the second joint sits on either body, both of which move.
    """
    soft = GEARED | {"viscous_friction": 0.3}
    joints = [
        revolute("O", "ground", "a.root", AXIS, **soft),
        revolute("A", *between, [0.3, 1.0, -0.2], **second, viscous_friction=0.1),
    ]
    bodies = [rigid(name, [0.02, 0.03, 0.04], 1.5, [0.2, 0.05, -0.1]) for name in "ab"]
    paths = [
        {"name": "o", followed: "O", "value": "0.8*sin(pi*t)**4"},
        {"name": "a", followed: "A", "value": "0.5-0.6*sin(pi*t)**4"},
    ]
    run = {"name": "run", "kind": kind, "end": 1.0, "output_step": 1e-3, "tolerance": 1e-10}
    run |= {"shape": "zero"} if kind == "fcid" else {"integrator": "dop853"}
    tables = scene(bodies, joints, run, trajectory=paths, initial={"state": "static", "joints": {"A": 0.5}})
    with solved(tables | {"gravity": [1.0, -3.0, 9.0]}) as found:
        t = found["run/time"]
        twist, rate = (
            found[f"run/joints/O/motor_{key}"] - found[f"run/joints/O/{of}"]
            for key, of in (("angle", "coordinate"), ("rate", "rate"))
        )
        if second is FIRM:
            np.testing.assert_allclose(found["run/energy/strain"], 1500 * twist**2, rtol=1e-9, atol=1e-15)
        moment = 3e3 * twist + 2.0 * rate
        np.testing.assert_allclose(found["run/joints/O/gear_moment"], moment, atol=1e-9 * np.abs(moment).max())
        power = found["run/joints/O/moment"] * found["run/joints/O/motor_rate"]
        power = (
            power + found["run/joints/A/moment"] * found[f"run/joints/A/{'rate' if second is FIRM else 'motor_rate'}"]
        )
        energy = sum(found[f"run/energy/{key}"] for key in ("kinetic", "strain", "gravitational"))
        left = power - found["run/energy/dissipated_power"]
        for last in (250, 500, 800):
            assert simpson(left[: last + 1], x=t[: last + 1]) == pytest.approx(energy[last] - energy[0], abs=1e-8)
        assert np.ptp(energy) > 1.0


def test_motors_behind_gears_are_judged_between_outputs():
    """γ = A sin ωt against inertia I: k δ = I γ̈ and τ = (I + J N²) γ̈ + J N² δ̈, θ̇_m = γ̇ + δ̇; peaks at no output."""
    A, w, I = 0.3, 7.4, 0.4  # noqa: E741
    joint = revolute("O", "ground", "b.root", AXIS, **GIVES, moment_limit=100.0, speed_limit=9.0)
    path = {"name": "o", "joint": "O", "value": f"{A}*sin({w}*t)"}
    run = {"name": "run", "kind": "fcid", "shape": "zero", "end": 1.0, "output_step": 0.05}
    tables = scene([rigid("b", np.diag([I, I, I]).tolist())], [joint], run, trajectory=[path])
    with solved(tables) as found:
        judged = found.attributes("run/feasibility/joints/O")
        moment = A * w**2 * abs(I + J * N**2 - J * N**2 * I * w**2 / K)
        assert np.abs(found["run/joints/O/moment"]).max() < 0.998 * moment
        assert judged["moment"] == pytest.approx(moment, rel=1e-4)
        assert judged["speed"] == pytest.approx(A * w * (1 - I * w**2 / K), rel=1e-4)


def test_moments_that_set_out_from_nothing():
    """Springs that hold nothing, in no gravity: moments of their rounding are not what steps follow.

    The springs vibrate at 700 rad/s, 110 times in all; before, the run ended at its start in steps of nothing.
    """
    stiff = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 4e4}
    joints = [
        revolute("O", "ground", "a.root", [0.0, 0.0, 1.0], **stiff),
        revolute("A", "a.tip", "b.root", [0.0, 0.0, 1.0], **stiff),
    ]
    bodies = [tables_3d.rigid(name, 1.0, [1e-6, 1 / 12, 1 / 12], [0.5, 0.0, 0.0], tip=[1.0, 0.0, 0.0]) for name in "ab"]
    load = [{"joint": "O", "moment": "4*sin(2*t)**4"}, {"joint": "A", "moment": "sin(2*t)**4"}]
    run = RUN | {"output_step": 0.05, "max_steps": 2000}
    tables = scene(bodies, joints, run, load=load, initial={"joints": {"O": 0.4, "A": 0.9}})
    with solved(tables) as found:
        for joint in "OA":
            motor, link = (found[f"run/joints/{joint}/{key}"] for key in ("motor_angle", "coordinate"))
            assert np.abs(motor - link).max() < 4.0 / 4e4  # the largest moment on the softest spring


def test_springs_at_rest_do_not_hold_the_steps():
    """A tube that carries a wrist and a tool straight down behind stiff gears; motors set out smoothly.

    The springs make more accelerations of the rounding of angles than a share of the tolerance that falls with the step
    has room for: it once drove steps below any size, and 100 000 led to 0.6 ms.
    """
    strain_wave = {"gear_ratio": 101.0, "stiffness": 5e3, "damping": 0.6, "rotor_inertia": 1.5e-5}
    hand = rigid("hand", [0.02, 0.04, 0.04], 6.0, [0.1, 0.0, 0.0])
    tool = rigid("tool", [0.007, 0.009, 0.009], 5.0, [0.06, 0.0, 0.0])
    hand["rigid"]["points"]["tip"] = [0.2, 0.0, 0.0]
    joints = [
        revolute("elbow", "ground", "forearm.root", [0.0, 1.0, 0.0], **strain_wave | {"stiffness": 1.6e4}),
        revolute("wrist", "forearm.tip", "hand.root", [0.0, 1.0, 0.0], **strain_wave),
        revolute("roll", "hand.tip", "tool.root", [1.0, 0.0, 0.0], **strain_wave),
    ]
    start = {"elbow": 0.6, "wrist": 0.9708, "roll": -0.24}
    paths = [
        {"name": name, "motor": name, "via": [angle, angle + 0.5], "profile": "rest-to-rest", "duration": 0.27}
        for name, angle in start.items()
    ]
    lift = {"name": "lift", "kind": "pcid", "end": 0.3, "output_step": 0.005, "tolerance": 1e-6, "max_steps": 40_000}
    bodies = [{"name": "forearm", "link": str(CASES / "arm_6r" / "forearm.toml")}, hand, tool]
    tables = scene(bodies, joints, lift, initial={"state": "static", "joints": start}, trajectory=paths)
    with solved(tables | {"gravity": [0.0, 0.0, -9.81]}) as found:
        assert found.attributes("lift")["status"] == "completed"


def test_a_twist_that_newton_does_not_find_is_an_error():
    """Moments without any smoothness on a spring that becomes 600 times as stiff: its parts go on to change."""
    rng = np.random.default_rng(3)
    slopes, knots = tuple(np.exp(rng.uniform(0, 9, 3))), tuple(np.cumsum(rng.uniform(0.001, 0.1, 2)))
    time = np.linspace(0.0, 1.0, int(rng.integers(12, 40)))
    gear = GearSpring(TwistSpring(slopes, knots), np.exp(rng.uniform(-3, 6)), 1.0, "scene.toml: joint.A: gear")
    moment, still = rng.standard_normal(len(time)) * np.exp(rng.uniform(0, 8)), np.zeros((len(time), 3))
    with pytest.raises(SolveError, match=r"joint\.A: gear: expected the twist of its gear within 50 iterations"):
        gear_motion(gear, time, moment, still[:, 0], still)
