"""`integrator = "auto"`: what it looks at, and what it chooses."""

import numpy as np
import pytest
import tree_oracle
from beam_links import beam_link, tube
from body_equations import maps
from links import ANGLES, arm, arm_links, quintic
from mechanisms import forward, pcid, relative, revolute
from oracle_3d import body_mass_matrix
from oracle_runs import evaluated, run
from scipy.linalg import eigh, null_space

import ffrobot
from ffrobot.mbs.inversion.motors_only import MotorsOnly
from ffrobot.mbs.linear.vibration import vibrations_of
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.mbs.quantities.motion import constraint_rows

AT_REST = {"angles": ANGLES, "state": "static"}


def chosen(model, **keys):
    """What a run begins with; it may change."""
    choice = run(model, pcid(**keys)).statistics.integrator
    return choice._replace(name=choice.candidates[0].name) if choice.candidates else choice


def test_vibrations_solve_the_linearised_equations():
    """Frequencies and shapes by the oracle's mass matrix, and by what the constraints leave free."""
    robot = arm()
    q = undeformed_posture(robot.model).q
    modes = vibrations_of(MultibodySystem(robot.model), 0.0, q)
    motion = evaluated(robot, 0.0, q, 0 * q).motion
    tree, M, K = robot.model.tree, *np.zeros((2, len(q), len(q)))
    for node, frame, (B,) in zip(tree.nodes, tree_oracle.frames(tree, motion.q), maps(tree, motion.q), strict=True):
        M += B.T @ body_mass_matrix(node.body, frame.F[0], q[node.p_q]) @ B
        K[node.p_v, node.p_v] = np.diag(node.body.stiffness)
    free = null_space(constraint_rows(motion)[1][0])
    squares = eigh(free.T @ K @ free, free.T @ M @ free, eigvals_only=True)
    np.testing.assert_allclose(modes.frequency, np.sqrt(squares), rtol=1e-9)
    np.testing.assert_allclose(modes.shape.T @ M @ modes.shape, np.eye(len(squares)), atol=1e-9)
    np.testing.assert_allclose(free.T @ (K @ modes.shape - M @ modes.shape * squares), 0.0, atol=1e-9 * squares.max())
    assert len(modes.frequency) == 6  # three modes a link; the path leaves the frames no freedom


def test_short_runs_are_not_worth_a_choice():
    """Explicit steps are stable up to 4.8 radians of the stiffest link's highest mode."""
    model = arm()
    choice = chosen(model, tolerance=1e-6)
    omega = max(np.sqrt(node.body.stiffness.max()) for node in model.model.tree.nodes if node.body.n_modes)
    assert choice.name == "dop853"
    assert choice.reason == f"{omega / 4.8:.3g} steps are stable at {omega:.3g} rad/s: a short run"


def test_what_rings_is_resolved_explicitly():
    """Stiff links that ring from the start on; from rest they do not, and damping lets steps grow: it is soon over."""
    links = arm_links(EI=300.0, modes=12, extra=2)
    ringing, at_rest = chosen(arm(links), tolerance=1e-6, end=0.1, output_step=0.01), arm(links, initial=AT_REST)
    assert ringing.name == "dop853"
    quiet = chosen(at_rest, tolerance=1e-3)
    assert quiet.name == "radau"
    top, rings = (float(text.split()[0]) for text in quiet.reason.split("frequency ")[1:])
    assert rings < 0.05 * top
    for ratio, expected in ((0.0, "dop853"), (0.3, "radau")):
        links = arm_links(EI=300.0, modes=8, extra=2, damping_ratio=ratio)
        assert chosen(arm(links), tolerance=1e-3).name == expected


@pytest.fixture(scope="module")
def at_rest():
    """Stiff links from rest, and a PCID of them that takes long steps."""
    model = arm(arm_links(EI=300.0, modes=12, extra=2), initial=AT_REST, motors="section")
    return model, run(model, pcid(tolerance=1e-4, integrator="radau"))


def test_a_replay_that_does_not_ring_is_integrated_implicitly(at_rest):
    model, inverse = at_rest
    analysis = forward(tolerance=1e-3, actuation="inverse", apply="trajectory")
    outcome = run(model, analysis, inverse)
    assert outcome.statistics.integrator.name == "radau"
    assert np.abs(outcome.q - inverse.q).max() < 1e-4


def test_motors_without_the_modal_forces_that_went_with_them_let_links_ring(at_rest):
    """From the same rest, under the same moments: judged by how the replay itself rings, not by its source."""
    model, inverse = at_rest
    analysis = forward(tolerance=1e-3, actuation="inverse", apply="joints", max_steps=100)
    outcome = run(model, analysis, inverse)
    assert inverse.statistics.integrator.name == "radau"
    assert outcome.statistics.integrator.name == "dop853"


@pytest.mark.parametrize(("tolerance", "integrator"), [(1e-2, "radau"), (1e-6, "dop853")])
def test_replays_of_motions_solved_anew(tolerance, integrator):
    """Each evaluation solves for a posture, so few of them count more than algebra; jumps of p̈ end explicit steps."""
    model = arm(arm_links(damping_ratio=0.02), initial=AT_REST, motors="section")
    source = run(model, MotorsOnly(name="inverse", kind="motors-only", end=1.0, output_step=0.01))
    keys = {"actuation": "inverse", "apply": "joints"}
    statistics = run(model, forward(tolerance=tolerance, **keys), source).statistics
    assert statistics.integrator.name == integrator
    assert statistics.rejected < 0.05 * statistics.steps


def test_a_choice_that_turns_out_badly_is_changed():
    """Damped vibrations that ring at first: with Radau from the start it is the other way round.

    The state is carried over: outputs are those of one integrator within the tolerance, and the summary says when.
    """
    model, tolerance = arm(arm_links(EI=3000.0, modes=8, extra=2, damping_ratio=0.02)), 1e-4
    watched = run(model, pcid(tolerance=tolerance))
    alone = run(model, pcid(tolerance=tolerance, integrator="dop853"))
    exact = run(model, pcid(tolerance=1e-8, integrator="dop853"))
    assert watched.statistics.integrator.name == "radau after dop853"
    assert watched.statistics.integrator.in_words == "dop853, then radau"
    assert "radau from t = 0.0" in watched.statistics.integrator.reason
    assert watched.statistics.evaluations < 0.8 * alone.statistics.evaluations
    for name in ("q", "lambda_", "tau", "F_p"):
        assert relative(getattr(watched, name), getattr(exact, name)) < tolerance, name


def test_smooth_starts_of_links_with_many_modes_are_not_followed_into_round_off():
    """At first all forces are small beside those to come: a third of all steps were spent there, many in vain."""
    table = beam_link(0.3, tube(0.02, 0.016), 40, modes={"count": 20, "family": "in-plane-bending"},
                      damping={"ratio": 0.01})  # fmt: skip
    path = quintic(0.0, 0.5)
    scene = ffrobot.make_scene(
        name="chain", gravity=[0.0, 0.0], body=[{"name": f"b{k}", "link": table} for k in range(2)],
        joint=[revolute("j0", "ground", "b0.root"), revolute("j1", "b0.tip", "b1.root")],
        trajectory=[{"name": f"t{k}", "joint": f"j{k}", "value": path} for k in range(2)],
        analysis=[{"name": "a", "kind": "pcid", "integrator": "radau", "end": 1.0, "output_step": 0.1}],
    )  # fmt: skip
    with ffrobot.solve(scene) as results:
        of = results.attributes("a")
    assert of["rejected"] < 0.02 * of["steps"]
