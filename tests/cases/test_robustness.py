"""What is left of computed motions where the robot is not its model: scaled links, lanes, bad input."""

import re

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from test_tracked_robots import geared, in_plane, patches, revolute, strip
from test_tracked_robots import scene as tables_of

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.body import from_modal_body, scaled

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")


def test_scaled_bodies_are_those_of_other_materials():
    """Of 5 % less stiffness and 7 % more mass, with geometric stiffening; modes may have the other sign."""
    links = [
        beam_link(0.5, rectangle(0.008, 0.012), 8, E=E, rho=rho, modes={"count": 4}, damping={"ratio": 0.02})
        for E, rho in ((70e9, 2700.0), (0.95 * 70e9, 1.07 * 2700.0))
    ]
    bodies = [from_modal_body("link", modal_body(keys), stiffened=True) for keys in links]
    found, wanted = scaled(bodies[0], stiffness=0.95, mass=1.07), bodies[1]
    assert found.mass == pytest.approx(wanted.mass, rel=1e-12)
    moving = [np.vstack([of.points["tip"].translation, of.points["tip"].rotation]) for of in bodies]
    signs = np.sign((moving[0] * moving[1]).sum(axis=0))
    for key in ("stiffness", "first_moment", "second_moment", "J_spin"):
        np.testing.assert_allclose(getattr(found, key), getattr(wanted, key), rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(found.damping, wanted.damping, rtol=1e-8, atol=1e-9)
    for key in ("S_bar", "I_bar"):
        size = np.abs(getattr(wanted, key)).max()
        np.testing.assert_allclose(getattr(found, key) * signs, getattr(wanted, key), atol=1e-6 * size)
    for ours, theirs in (
        (found.stiffening.K_x, wanted.stiffening.K_x),
        (found.stiffening.at("tip"), wanted.stiffening.at("tip")),
    ):
        np.testing.assert_allclose(ours * signs * signs[:, None], theirs, atol=1e-6 * np.abs(theirs).max())


T, HOLD, BANDWIDTH, FORCE, INERTIA, GEAR = 0.4, 2e-3, 25.0, 1e-4, 0.05, 2 * np.pi * 20
SHARES = {"stiffness": 0.3, "mass": 0.3, "gear stiffness": 0.1}


class OneModeBehindAGear:
    """A strip with one mode behind a gear: γ, p and the motor's angle θ, under its torque, a voltage and a force."""

    def __init__(self, results):
        link = results.modal_body("arm")
        (self.omega,), (self.zeta,) = 2 * np.pi * link.frequency, link.damping_ratio
        self.J, self.felt = link.second_moment[0, 0], link.I_bar[0, 1, 0]
        self.tip = np.array([link.length, link.interfaces["tip"].translation[1, 0], 0.0])
        slope = link.along_axis(np.array([0.26, 0.34]))[2][:, 2, 0]
        self.per_volt = 63e9 * 110e-12 * 0.02 * (0.004 + 0.25e-3) * (slope[1] - slope[0])
        self.time = results.time("carried/joints/hub/moment")
        names = ("joints/hub/moment", "pzt/arm/voltage", "points/arm.tip/position")
        curves = (results[f"carried/{name}"].reshape(len(self.time), -1)[:, -1] for name in names)
        self.torque, self.voltage, self.wanted = (CubicSpline(self.time, curve) for curve in curves)
        self.motor = self.simulated(*self.linear()).sol

    def linear(self, force=0.0, **factors):
        """ẋ = A x + B u and where it begins."""
        elastic, mass, gear = (factors.get(name, 1.0) for name in SHARES)
        zero, one, K = np.zeros((3, 3)), np.eye(3), INERTIA * GEAR**2
        twisted, own = np.array([1.0, 0.0, -1.0]), np.diag([0.0, 1.0, 0.0])
        M = np.array([[mass * self.J, mass * self.felt, 0], [mass * self.felt, mass, 0], [0, 0, INERTIA]])
        S = gear * K * np.outer(twisted, twisted) + elastic * self.omega**2 * own
        C = 0.04 * K / GEAR * np.outer(twisted, twisted) + 2 * self.zeta * self.omega * (mass * elastic) ** 0.5 * own
        u = np.column_stack([one[2], self.per_volt * one[1], self.tip])
        A = np.block([[zero, one], [-np.linalg.solve(M, S), -np.linalg.solve(M, C)]])
        start = np.append(np.linalg.solve(S[:2, :2], force * self.tip[:2]), np.zeros(4))
        return A, np.vstack([zero, np.linalg.solve(M, u)]), force, start

    def simulated(self, A, B, force, start):
        def rate(t, x):
            return A @ x + B @ [self.torque(t), self.voltage(t), force]

        span, accuracy = (0.0, self.time[-1]), {"rtol": 1e-10, "atol": 1e-14, "max_step": 2e-3}
        return solve_ivp(rate, span, start, "DOP853", self.time, dense_output=True, **accuracy)

    def open_loop(self, *robot):
        return np.abs(self.tip @ self.simulated(*robot).y[:3] - self.wanted(self.time)).max()

    def sampled(self, A, B, force, x, *, control=1.0, volts=1.0, parts=20):
        """Commands held from sample to sample, the motor's angle fed back by a PD controller."""
        held = expm(np.block([[A, B], [np.zeros((3, 9))]]) * HOLD / parts)[:6]
        P, before, worst = control * (self.J + INERTIA) * BANDWIDTH**2, None, 0.0
        for t in HOLD * np.arange(round(self.time[-1] / HOLD)):
            error = self.motor(t)[2] - x[2]
            damped = 0.0 if before is None else 2.0 / BANDWIDTH * (error - before) / HOLD
            before, middle = error, t + HOLD / 2
            u = [self.torque(middle) + P * (error + damped), volts * self.voltage(middle), force]
            for k in range(parts):
                x = held @ [*x, *u]
                worst = max(worst, abs(self.tip @ x[:3] - self.wanted(t + (k + 1) * HOLD / parts)))
        return worst


def test_every_cause_behind_a_gear_against_a_linear_model():
    """Of a strip with one mode, its patch and motor on a path of 1 mm, in three lanes."""
    nonic = f"(126*(t/{T})**5 - 420*(t/{T})**6 + 540*(t/{T})**7 - 315*(t/{T})**8 + 70*(t/{T})**9)"
    tables = tables_of(
        T, [0.0, 0.0], {"point": "arm.tip", "y": f"1e-3*{nonic}"},
        body=[{"name": "arm", "link": strip(1.0, 0.004, 0.02, count=1)}],
        joint=[revolute("hub", "ground", "arm.root", motor=True)], pzt=[patches("arm", 0.02, centers=[0.3])],
    )  # fmt: skip
    keys = {"sample_time": HOLD, "resolution": 1e-10, "bandwidth": BANDWIDTH, "force": FORCE, "parameters": [0.3]}
    tables["analysis"] = [tables["analysis"][0] | {"output_step": T / 3200, "robustness": keys}]
    with ffrobot.solve(ffrobot.make_scene(**geared(tables, 20, hub=INERTIA))) as results:
        causes = results.attributes("carried/robustness")["causes"][1:]
        found = {lane: results[f"carried/robustness/{lane}"][1:] for lane in results.names("carried/robustness")}
        own = OneModeBehindAGear(results)
    varied = [[own.linear(**{name: 1 + sign * share}) for sign in (-1, 1)] for name, share in SHARES.items()]
    robots = [[own.linear()], *varied, [own.linear(FORCE)]]
    assert [str(cause).split(" ±")[0] for cause in causes[1:4]] == list(SHARES)
    worst = {
        "open_loop": [own.sampled(*robots[0][0], control=0.0)],
        "joint_control": [own.sampled(*robots[0][0])],
        "joint_control_without_voltages": [own.sampled(*robots[0][0], volts=0.0)],
    }
    for of_cause in robots[1:]:
        worst["open_loop"] += [max(own.open_loop(*robot) for robot in of_cause)]
        worst["joint_control"] += [max(own.sampled(*robot) for robot in of_cause)]
        worst["joint_control_without_voltages"] += [max(own.sampled(*robot, volts=0.0) for robot in of_cause)]
    for lane, expected in worst.items():
        np.testing.assert_allclose(found[lane], expected, rtol=1e-3, atol=5e-10, err_msg=lane)


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_gears_of_slides_vary_like_those_of_hinges(kind):
    from ffrobot.mbs.scene.analysis import Robustness
    from ffrobot.run.robustness import varied_robots
    from ffrobot.run.solve import prepare_scene

    body = {"mass": 2.0, "center": [0.0, 0.0], "inertia": 3.0, "points": {"root": [0.0, 0.0]}}
    joint = {"name": "j", "type": kind, "between": ["ground", "b.root"], "motor": True, "stiffness": 500.0}
    joint |= {"rotor_inertia": 1e-3} | ({"axis": [1.0, 0.0]} if kind == "prismatic" else {})
    tables = {"name": "one", "gravity": [0.0, 0.0], "body": [{"name": "b", "rigid": body}], "joint": [joint]}
    made = ffrobot.make_scene(**tables, analysis=[{"name": "still", "kind": "static"}])
    robots = varied_robots(prepare_scene(made).model, Robustness(gears=(0.1,)))
    stiffness = [robot.scene.joint[0].stiffness for cause, robot in robots if cause.startswith("gear")]
    assert stiffness == pytest.approx([450.0, 550.0])


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"parameters": [1.5]}, "robustness.parameters[0]: expected a number less than 1, found 1.5"),
        ({"sample_time": 0.0}, "robustness.sample_time: expected a number greater than 0"),
        ({"sampletime": 1e-3}, 'did you mean "sample_time"?'),
    ],
)
def test_deviations_that_are_none(keys, text):
    tables = in_plane()
    tables["analysis"][0]["robustness"] = keys
    with pytest.raises(InputError, match=re.escape(text)):
        ffrobot.make_scene(**tables)
