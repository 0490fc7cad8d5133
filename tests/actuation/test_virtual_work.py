"""Motors and patches do the work of the force on the tip, in a run through `solve` with links from stage 1."""

import numpy as np
import pytest
import tree_oracle
from beam_links import paper_link
from patches_on_links import CERAMIC

import ffrobot
from ffrobot.actuation.points import find_driving_forces
from ffrobot.mbs.quantities.motion import body_motion, joint_motion, node_of
from ffrobot.mbs.quantities.supply import actuator_forces, motor_moments, path_force
from ffrobot.run.solve import solve_scene

ANALYSES, BODIES = ("inverse", "straight", "sagging"), ("link1", "link2")


def solved_with(motors="section", points=(), **of_patches):
    """The two-link arm with keys of its own for patches and points."""
    shapes = {"straight": "zero", "sagging": "static"}
    run = {"end": 0.1, "output_step": 0.02}
    return solve_scene(ffrobot.make_scene(
        name="two_link", gravity=[0.0, -9.81], motors=motors,
        body=[{"name": "link1", "link": paper_link("simply-supported")}, {"name": "link2", "link": paper_link()}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
               {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]}],
        initial={"angles": {"link1": 0.0, "link2": np.pi / 3}},
        trajectory=[{"name": "tip", "point": "link2.tip", "x": "1.5*cos(pi*t/4)", "y": "sqrt(3)/2*cos(pi*t/4)"}],
        pzt=[CERAMIC | {"body": body, "count": 10, "structural": False} | of_patches for body in BODIES],
        actuation_points=[{"body": body} | dict(points) for body in BODIES],
        analysis=[{"name": "inverse", "kind": "pcid", "tolerance": 1e-6} | run,
                  *({"name": name, "kind": "fcid", "shape": shape} | run for name, shape in shapes.items())],
    ))  # fmt: skip


@pytest.fixture(scope="module", params=["section", "frame"])
def solution(request):
    return solved_with(request.param)


@pytest.fixture(scope="module")
def limited():
    """Patches at ±200 V; points too few to carry Q_a."""
    return solved_with(limit=200.0, points={"transverse": [0.25, 0.5, "tip"]})


def velocity(result, body):
    """(T, 6 + n): of the frame and its turn, in axes of the body, and p."""
    moving, node = body_motion(result.run, body), node_of(result.run, body)
    F = tree_oracle.frames(result.run.model.tree, result.run.q)[result.run.model.tree.index[body]].F
    frame = [np.einsum("tji,tj->ti", F, of) for of in (moving.velocity, moving.angular_velocity)]
    return np.column_stack([*frame, result.run.v[:, node.p_v]])


def in_plane(result, body):
    """(T, 3 + n): of (R, θ, p), R in global axes."""
    moving, node = body_motion(result.run, body), node_of(result.run, body)
    frame = moving.velocity[:, :2], moving.angular_velocity[:, 2]
    return np.column_stack([*frame, result.run.v[:, node.p_v]])


def Q_a_power(result, body):
    return (find_driving_forces(result.run)[body] * velocity(result, body)).sum(axis=1)


def driving_power(result):
    """Q_a · q̇ of every body: (T, 2)."""
    return np.column_stack([Q_a_power(result, body) for body in BODIES])


def motor_power(solution, result):
    """Angles turn with the section or with the frame, as the scene says."""
    section = solution.scene.motors == "section"

    def turn(body, point):
        moving = in_plane(result, body)
        of_section = node_of(result.run, body).body.points[point].rotation[2]
        return moving[:, 2] + (moving[:, 3:] @ of_section if section else 0.0)

    rates = np.column_stack([turn("link1", "root"), turn("link2", "root") - turn("link1", "tip")])
    found = np.column_stack([joint_motion(result.run, joint)[1] for joint in "OA"])
    np.testing.assert_allclose(found, rates, atol=1e-12)
    return np.column_stack([motor_moments(result.run)[joint] for joint in "OA"]) * rates


def patch_power(solution, result, which):
    """Of the patches of each link, and of the modal forces they leave unmet."""
    patches, unmet = [], []
    for body, of_link in solution.patches.items():
        voltages, p_dot = result.actuation.voltages[body], body_motion(result.run, body).modal_velocity
        patches.append(((getattr(voltages, which) @ of_link.Phi_V.T) * p_dot).sum(axis=1))
        unmet.append((result.actuation.unmet[body] * p_dot).sum(axis=1))
    return np.column_stack(patches), np.column_stack(unmet)


def check_sum_is_zero(*terms):
    """To 1e-10 of the largest term, at every output after the start from rest."""
    terms = np.column_stack(terms)[1:]
    assert np.all(np.abs(terms).max(axis=1) > 1e-6)
    assert np.all(np.abs(terms.sum(axis=1)) < 1e-10 * np.abs(terms).max(axis=1))


def test_power_of_the_force_on_the_tip_is_that_of_Q_a(solution):
    result = solution.analyses["inverse"]
    rate = -np.pi / 4 * np.sin(np.pi * result.run.time / 4)
    tip_velocity = np.outer(rate, [1.5, np.sqrt(3) / 2])
    check_sum_is_zero((path_force(result.run, "tip") * tip_velocity).sum(axis=1), -driving_power(result))


@pytest.mark.parametrize("analysis", ANALYSES)
def test_power_of_motors_and_patches_is_that_of_Q_a(solution, analysis):
    """Joint forces do none; without patches the motors leave that of the modal forces."""
    result = solution.analyses[analysis]
    motors, Q_a = motor_power(solution, result), driving_power(result)
    patches, _ = patch_power(solution, result, "required")
    modal = actuator_forces(result.run).modal
    unmet = np.hstack([modal[body] * body_motion(result.run, body).modal_velocity for body in BODIES])
    for supplied in (patches, unmet):
        check_sum_is_zero(motors, supplied, -Q_a)


@pytest.mark.parametrize("analysis", ANALYSES)
def test_power_at_the_actuation_points_is_that_of_Q_a(solution, analysis):
    """Thirteen components on each link, chosen by the program, carry all of Q_a."""
    result = solution.analyses[analysis]
    for body in BODIES:
        chosen, forces = solution.points[body], result.point_forces[body]
        assert forces.rank == 13
        assert forces.condition_number < 1e4
        assert np.all(forces.residual <= 1e-11 * np.abs(forces.force).max())
        terms, Q_a = point_power(result, chosen, forces.force), Q_a_power(result, body)
        if (body, analysis) == ("link1", "inverse"):  # no trajectory drives it
            assert not np.any(forces.force)
        else:  # the power of a link held straight is zero, that of its components is not
            check_sum_is_zero(terms, -Q_a)


def point_power(result, chosen, force):
    """F_a · ṙ of every component, with the velocity of its point from R + A (x + Φ p)."""
    node, moving, powers = node_of(result.run, chosen.body), velocity(result, chosen.body), []
    p = result.run.q[:, node.p_q]
    for point, direction, f in zip(chosen.points, chosen.direction.T, force.T, strict=True):
        u = point.position + p @ point.translation.T
        in_body = moving[:, :3] + np.cross(moving[:, 3:6], u) + moving[:, 6:] @ point.translation.T
        powers.append(f * (in_body @ direction))
    return np.column_stack(powers)


@pytest.mark.parametrize("analysis", ["inverse", "straight"])
def test_power_that_limits_leave_unmet_is_residual_times_velocity(limited, analysis):
    result = limited.analyses[analysis]
    patches, unmet = patch_power(limited, result, "within_limit")
    assert np.abs(unmet).max() > 10 * np.abs(patches).max() or analysis == "straight"
    assert np.abs(result.actuation.voltages["link1"].within_limit).max() == 200.0
    check_sum_is_zero(motor_power(limited, result), patches, unmet, -driving_power(result))


@pytest.mark.parametrize("analysis", ANALYSES)
def test_power_that_too_few_points_leave_unmet_is_residual_times_velocity(limited, analysis):
    result = limited.analyses[analysis]
    for body in BODIES:
        forces, Q_a = result.point_forces[body], Q_a_power(result, body)
        assert forces.force.shape == (6, 3)
        if np.any(Q_a):
            assert forces.residual.max() > 1e-3
            unmet = (forces.unmet * in_plane(result, body)).sum(axis=1)
            check_sum_is_zero(point_power(result, limited.points[body], forces.force), unmet, -Q_a)


def test_checkpoint_of_voltages(solution):
    """At t = 0.1 s: kilovolts, of which link 1 needs none with motors at the frames."""
    voltages = solution.analyses["inverse"].actuation.voltages
    expected = {"section": [91903.83, 76997.78, 22644.86], "frame": [0.0, 0.0, 0.0]}[solution.scene.motors]
    np.testing.assert_allclose(voltages["link1"].required[-1, [0, 3, 9]], expected, atol=1e-5 * 92000)
    np.testing.assert_allclose(
        voltages["link2"].required[-1, [0, 3, 9]], [20542.10, 11524.44, -3430.40], atol=1e-5 * 20542
    )
