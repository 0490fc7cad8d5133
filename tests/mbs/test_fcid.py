"""Fully constrained inverse dynamics: against the oracle, against PCID, and against rigid arms in closed form."""

import numpy as np
import pytest
import zoo
from links import arm, arm_links, quintic, ritz_link
from mechanisms import make_model, relative, revolute
from oracle_runs import run
from patch_sets import Patches

from ffrobot.common.errors import InputError, SolveError
from ffrobot.mbs.analysis.fcid import Fcid
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.run.replay import supplied

TIMES = np.linspace(0.0, 0.2, 5)


def fcid(shape, **keys):
    return Fcid(name="fcid", kind="fcid", shape=shape, end=0.2, output_step=0.05, **keys)


def given_shapes(model):
    """Lively p(t) for every mode."""
    return {
        body.name: tuple(parse_expression(f"{0.03 / (k + 1)}*sin({3 + k}*t+{k})") for k in range(body.n_modes))
        for body in model.bodies
    }


@pytest.mark.parametrize("name", ["mixed backwards", "four-bar", "chain of 2"])
def test_forces_at_any_time_are_those_at_outputs(name):
    """Replays ask for them at times that go to and fro; patches of all bodies serve all modes."""
    model = zoo.build(name)
    outcome = run(model, fcid("given", modal=given_shapes(model)))
    patches = {
        body.name: Patches(body.name, np.eye(body.n_modes), np.full(body.n_modes, np.inf)) for body in model.bodies
    }
    motors = outcome.tau.shape[1]
    source = supplied(outcome.outcome, np.full(motors, np.inf), patches, limited=False)
    found = source.sample(TIMES[[3, 0, 4, 1]].tolist())
    assert relative(found[:, :motors], outcome.tau[[3, 0, 4, 1]]) < 1e-11
    assert relative(found[:, motors:], outcome.F_p[[3, 0, 4, 1]]) < 1e-11


def test_zero_shape_is_the_rigid_arm_in_closed_form():
    """Two uniform links: τ of the double pendulum (Spong and Vidyasagar 1989, ch. 6); F_p of rods that move rigidly."""
    model = arm()
    outcome = run(model, Fcid(name="fcid", kind="fcid", shape="zero", end=1.0, output_step=0.05))
    theta, w, alpha = (
        np.array([x[:, outcome.coordinates(name)][:, 2] for name in ("link1", "link2")])
        for x in (outcome.q, outcome.v, outcome.a)
    )
    m, L, g = 1.0, 1.0, 9.81
    cosine, sine = np.cos(theta[1] - theta[0]), np.sin(theta[1] - theta[0])
    pull = m * L * L / 2
    elbow = m * L * L / 3 * alpha[1] + pull * (cosine * alpha[0] + sine * w[0] ** 2) + m * g * L / 2 * np.cos(theta[1])
    shoulder = (
        (m * L * L / 3 + m * L * L) * alpha[0]
        + pull * (cosine * alpha[1] - sine * w[1] ** 2)
        + 1.5 * m * g * L * np.cos(theta[0])
        + elbow
    )
    assert relative(outcome.tau[:, 0], shoulder) < 1e-10
    assert relative(outcome.tau[:, 1], elbow) < 1e-10
    np.testing.assert_array_equal(outcome.q[:, outcome.coordinates("link2")][:, 3:], 0.0)

    # Link 2 hangs from its root, the cantilever: only its own weight and inertia bend it, q(x) = ρA (a_y − g_y + α x).
    link2 = model.body("link2")
    s, c = np.sin(theta), np.cos(theta)
    root = L * np.array([-s[0] * alpha[0] - c[0] * w[0] ** 2, c[0] * alpha[0] - s[0] * w[0] ** 2])  # R̈ of link 2
    across = -s[1] * root[0] + c[1] * (root[1] + g)
    F_p = np.outer(across, link2.S_bar[1]) + np.outer(alpha[1], link2.spin[2])
    assert relative(outcome.F_p[:, outcome.modal_columns("link2")], F_p) < 1e-10

    # Link 1: the same, and what joint and motors do to its ends (simply supported: nothing but moments and rotations).
    link1 = model.body("link1")
    F_p = np.outer(c[0] * g, link1.S_bar[1]) + np.outer(alpha[0], link1.spin[2])
    ends = [link1.points[name].rotation[2] for name in ("root", "tip")]
    F_p += -np.outer(shoulder, ends[0]) + np.outer(elbow, ends[1])
    assert relative(outcome.F_p[:, outcome.modal_columns("link1")], F_p) < 1e-10


def test_static_shape_sags_as_in_closed_form():
    """A horizontal cantilever, its motor at rest: w(L) = ρA g L⁴/8EI, τ = m g L/2, nothing left for patches."""
    EI, mass = 5e3, 1.3
    link = ritz_link("link1", "cantilever", EI=EI, mass=mass, modes=8, extra=0)
    model = make_model(
        [link], joint=[revolute("O", "ground", "link1.root")], trajectory=[{"name": "hold", "joint": "O", "value": "0"}]
    )
    outcome = run(model, fcid("static"))
    sag = outcome.q[:, 3:] @ link.points["tip"].translation[1]
    np.testing.assert_allclose(sag, -mass * 9.81 / (8 * EI), rtol=1e-9)
    np.testing.assert_allclose(outcome.tau, mass * 9.81 / 2, rtol=1e-9)
    assert np.abs(outcome.F_p).max() < 1e-11 * mass * 9.81


LIFT = [{"name": "lift", "point": "link2.tip", "y": quintic(1.3, 1.5)}]


@pytest.mark.parametrize(
    ("made", "analysis", "said"),
    [
        (lambda: arm(arm_links(EI=0.2)), fcid("static"), "no static shape .* at t = 0 s: the links are too soft"),
        (lambda: arm(trajectory=LIFT), fcid("zero"), r"as many .* components as .* freedom \(2\) .* found 1"),
        # a second link bent by metres: its tip is farther from the elbow than the first link can make up for
        (arm, fcid("given", modal={"link2": (parse_expression("-50*t"),)}), "no posture was found at t = .* out of"),
    ],
)
def test_shapes_that_do_not_go(made, analysis, said):
    with pytest.raises((InputError, SolveError), match=said):
        run(made(), analysis)


def test_shapes_that_no_force_can_follow_are_refused():
    modal = {"link2": (parse_expression("1e-4*where(t < 0.1, 0, t - 0.1)"),)}
    with pytest.raises(InputError, match=r'"fcid": modal.link2\[0\]: expected a continuous velocity, found a jump'):
        run(arm(), fcid("given", modal=modal))
