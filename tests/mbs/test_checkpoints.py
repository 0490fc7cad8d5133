"""The oracle in 3D at the states of independent numbers: λ_s, τ, F_p, voltages, accelerations of joints."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoint_mechanisms import CASES, load, mechanism_of, modal_body, state_of
from oracle_3d import Mechanism
from random_mechanisms import JointState, Tree, placed
from rotations import rotation, rotation_about
from scipy.integrate import solve_ivp
from triad_measures import Section

from ffrobot.mbs.model.body import from_modal_body, rigid_body

# Samples have the digits in which two step sizes agree (`relative_difference_between_step_sizes`): 1e-9 of the peak.
CLOSE = 2e-9
EVERY = 6


def frames(joint):
    """The joint's coordinates between the frames of its bodies, about the axis that its sections have."""
    return replace(joint, a=joint.a if joint.a.body is None else Section(joint.a.body, ""), b=Section(joint.b.body, ""))


def moved(joints):
    return [row for joint in joints for row in joint.coordinates() if joint.type != "universal"]


@pytest.fixture(params=CASES)
def case(request):
    data = load(request.param)
    mechanism, joints, mechanical = mechanism_of(request.param)
    samples = data["samples"][:: max(1, len(data["samples"]) // EVERY)]
    return data, mechanism, joints, mechanical, [(s, *state_of(mechanism, s)) for s in samples]


def peak(data, *keys):
    values = []
    for sample in data["samples"]:
        for key in keys:
            sample = sample[key]
        values.append(sample)
    return np.abs(values).max()


def test_modal_bodies_are_those_of_the_numbers(case):
    data, mechanism = case[:2]
    for record in data["scene"]["bodies"]:
        if "link" in record:
            body = modal_body(record["link"])
            assert list(body.family) == record["family"]
            np.testing.assert_allclose(2 * np.pi * body.frequency, record["omega"], rtol=1e-9)
            assert mechanism.body(record["name"]).n_modes == record["modes"]


def test_constraints_hold_at_the_samples(case):
    _, mechanism, _, _, states = case
    for sample, q, v in states:
        C, rate, _, _ = mechanism.constraint_values(sample["t"], q, v)
        assert np.abs(C).max() < 1e-11
        assert np.abs(rate).max() < 1e-8


def test_accelerations_and_forces_on_the_path(case):
    data, mechanism, joints, mechanical, states = case
    coordinates = [row for joint in joints for row in joint.coordinates()]
    for sample, q, v in states:
        a, lambda_ = mechanism.solve(sample["t"], q, v)
        force = -lambda_[mechanical:]
        expected = np.array(sample["path_force"])[: len(force)]  # of the slider-crank, two rows belong to its guide
        np.testing.assert_allclose(force, expected, atol=CLOSE * peak(data, "path_force"))
        found = [mechanism.row(row, q, v, sample["t"]) for row in coordinates][: len(sample["joints"])]
        accelerations = [row.gradient @ a + row.bias for row in found]
        np.testing.assert_allclose(
            accelerations, sample["joint_accelerations"], atol=CLOSE * peak(data, "joint_accelerations")
        )
        np.testing.assert_allclose([row.value for row in found], sample["joints"], atol=1e-10)
        np.testing.assert_allclose(
            [row.rate for row in found], sample["joint_rates"], atol=1e-8 * peak(data, "joint_rates")
        )


@pytest.mark.parametrize("motors", ["section", "frame"])
def test_moments_and_modal_forces(case, motors):
    data, mechanism, joints, mechanical, states = case
    loop = "motor_moment" in data["samples"][0]
    if loop and motors == "frame":
        pytest.skip("the numbers have none")
    driven = joints[:1] if loop else [joint for joint in joints if joint.type != "weld"]
    rows = [row for row, _ in mechanism.constraints[:mechanical]]
    for sample, q, v in states:
        _, lambda_ = mechanism.solve(sample["t"], q, v)
        _, _, C_v, _ = mechanism.constraint_values(sample["t"], q, v)
        G = np.array([motor_rate(mechanism, joint, q, motors) for joint in driven])
        tau, F_p = mechanism.required(sample["t"], q, -C_v[mechanical:].T @ lambda_[mechanical:], rows, G)
        key = "motor_moment" if loop else "moments"
        np.testing.assert_allclose(tau, np.atleast_1d(sample[key]), atol=CLOSE * peak(data, key))
        for name, found in F_p.items():
            if len(found):
                key = "modal_force" if motors == "section" else "modal_force_frame"
                wanted = sample["bodies"][name][key]
                np.testing.assert_allclose(found, wanted, atol=CLOSE * peak(data, "bodies", name, key))


def motor_rate(mechanism, joint, q, motors):
    """Gradient of what a motor's moment works on: sections' spin, or that of the frames, about the axis there."""
    rest = np.zeros(mechanism.size)
    row = joint.coordinates()[0]
    if motors == "section" or joint.type == "prismatic":
        return mechanism.row(row, q, rest).gradient
    z = mechanism.marker(joint.a, q, rest).F[:, 2]
    a, b = (mechanism.marker(at if at.body is None else Section(at.body, ""), q, rest) for at in (joint.a, joint.b))
    return z @ (b.L[3:] - a.L[3:])


def test_voltages(case):
    data, _, _, _, states = case
    patches = data["scene"]["patches"]
    for record in data["scene"]["bodies"]:
        own = [patch for patch in patches if patch["body"] == record["name"]]
        if not own:
            continue
        link = modal_body(record["link"])
        Phi_V = np.array(
            [
                patch["c"]
                * np.array(patch["axis"])
                @ (link.interpolate(patch["x2"]).rotation - link.interpolate(patch["x1"]).rotation)
                for patch in own
            ]
        ).T
        for sample, _, _ in states:
            found = sample["bodies"][record["name"]]
            V = np.linalg.lstsq(Phi_V, found["modal_force"], rcond=None)[0]
            np.testing.assert_allclose(V, found["voltage"], atol=1e-8 * peak(data, "bodies", record["name"], "voltage"))


@pytest.mark.parametrize(("name", "robot"), [("arm3_line_fcid", "arm3_line_static"), ("arm6_fcid", "arm6_static")])
def test_forces_of_links_that_keep_straight(name, robot):
    """p = 0 (FCID): F_a and F_p from M v̇ − Q at the joints' given motion; good to rounding."""
    mechanism, joints, mechanical = mechanism_of(robot)
    rows = [row for row, _ in mechanism.constraints[:mechanical]]
    coordinates = [row for joint in joints for row in joint.coordinates()]
    for sample in load(name)["samples"]:
        poses = {
            joint.name: JointState(np.array([angle]), np.zeros(3), rotation_about(2, angle))
            for joint, angle in zip(joints, sample["joints"], strict=True)
        }
        q = placed(Tree(mechanism.bodies, joints, poses=poses), [np.zeros(body.n_modes) for body in mechanism.bodies])
        v = motion(mechanism, rows + coordinates, q, np.zeros(mechanism.size), sample["joint_rates"], rate=True)
        a = motion(mechanism, rows + coordinates, q, v, sample["joint_accelerations"], rate=False)
        forces = mechanism.mass_matrix(q) @ a - mechanism.forces(sample["t"], q, v)
        G = np.array([mechanism.row(row, q, v).gradient for row in coordinates])
        F_a, F_p = mechanism.required(sample["t"], q, forces, rows, G)
        np.testing.assert_allclose(F_a, sample["F_a"], atol=1e-11 * np.abs(sample["F_a"]).max())
        for body, expected in sample["F_p"].items():
            np.testing.assert_allclose(F_p[body], expected, atol=1e-11 * np.abs(expected).max())


def motion(mechanism, rows, q, v, of_joints, *, rate):
    """Velocities, or accelerations, of rigid links: `of_joints` of the last rows, nothing of all others."""
    states = [mechanism.row(row, q, v) for row in rows]
    bias = np.zeros(len(rows)) if rate else np.array([state.bias for state in states])
    wanted = np.concatenate([np.zeros(len(rows) - len(of_joints)), of_joints]) - bias
    modes = np.concatenate([np.arange(i.start + 6, i.stop) for i in columns_of(mechanism)])
    matrix = np.vstack([[state.gradient for state in states], np.eye(mechanism.size)[modes]])
    return np.linalg.solve(matrix, np.concatenate([wanted, np.zeros(len(modes))]))


def columns_of(mechanism):
    return [mechanism.coordinates.columns(name) for name in mechanism.coordinates.names]


def test_free_bodies_have_the_momentum_and_energy_of_the_numbers():
    """`top_flexible` at all its samples; both keep them there."""
    body = from_modal_body("spinner", modal_body("links/spinner.toml"))
    mechanism, data = Mechanism([body], np.zeros(3)), load("top_flexible")
    for sample in data["samples"]:
        q = np.concatenate([sample[key] for key in ("position", "quaternion", "modal")])
        omega, p_dot = np.array(sample["angular_velocity_body"]), np.array(sample["modal_velocity"])
        v = np.concatenate([np.zeros(3), omega, p_dot])
        # The centre of mass is at rest: that is Ṙ.
        v[:3] = -(mechanism.momentum(q, v)[:3]) / body.mass
        np.testing.assert_allclose(mechanism.energies(q, v).sum(), sample["energy"], rtol=1e-9)
        R = -rotation(q[3:7]) @ (body.first_moment + body.S_bar @ q[7:]) / body.mass
        momentum = mechanism.momentum(np.concatenate([R, q[3:]]), v)[3:]
        np.testing.assert_allclose(momentum, sample["angular_momentum"], atol=1e-9)


def test_rigid_top_turns_as_jacobi_says():
    """Free rotation at all samples: ω̄̇ by differences of the numbers, which are exact to 1e-13."""
    data = load("top_rigid")
    top = rigid_body("top", data["mass"], np.zeros(3), np.diag(data["inertia"]), {})
    mechanism = Mechanism([top], np.zeros(3))
    found = solve_ivp(
        lambda t, x: mechanism.solve(t, np.array([0.0, 0, 0, 1, 0, 0, 0]), np.concatenate([np.zeros(3), x]))[0][3:],
        (0.0, 4.0), data["samples"][0]["angular_velocity_body"], "DOP853", rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    at_end = next(sample for sample in data["samples"] if sample["t"] == 4.0)
    np.testing.assert_allclose(found.y[:, -1], at_end["angular_velocity_body"], atol=1e-10)
    np.testing.assert_allclose(found.y[:, -1], [2.64241551, -1.49727169, 3.92456121], atol=1e-8)
