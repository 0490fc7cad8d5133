"""`integrator = "auto"`: what it looks at, and what it chooses."""

from dataclasses import replace

import numpy as np
import pytest
import zoo
from links import ANGLES, TIP, arm, arm_links
from mechanisms import assemble, forward, oracle_of, pcid, relative
from planar_runs import run

from ffrobot.mbs.model.masses import mass_matrix
from ffrobot.mbs.solve.state import State
from ffrobot.mbs.solve.vibration import modal_excitation, vibrations

AT_REST = {"angles": ANGLES, "state": "static"}


def chosen(model, **keys):
    """What a run begins with; it may change."""
    choice = run(model, pcid(**keys)).statistics.integrator
    return replace(choice, name=choice.candidates[0].name) if choice.candidates else choice


def test_mass_matrix_is_the_oracle_s():
    assembly = assemble(zoo.build("chain of 3"))
    oracle, q = oracle_of(assembly), np.random.default_rng(0).standard_normal(assembly.system.coordinates)
    for body in oracle.bodies:
        i = oracle.columns[body.name]
        np.testing.assert_allclose(mass_matrix(body, q[i]), oracle.mass_matrix(q)[i, i], atol=1e-14)


def test_vibrations_solve_the_linearised_equations():
    assembly = assemble(arm())
    state = undeformed_state(assembly)
    modes, oracle = vibrations(assembly, state), oracle_of(assembly)
    M, (_, _, C_q) = oracle.mass_matrix(state.q), oracle.constraint_values(0.0, state.q, state.v)
    K = np.concatenate([[0, 0, 0, *body.stiffness] for body in oracle.bodies])
    terms = K[:, None] * modes.shape
    np.testing.assert_allclose(C_q @ modes.shape, 0, atol=1e-12)
    np.testing.assert_allclose(modes.shape.T @ M @ modes.shape, np.eye(len(modes.frequency)), atol=1e-9)
    residual = M @ modes.shape * modes.frequency**2 - terms - C_q.T @ modes.force
    assert np.abs(residual).max() < 1e-9 * np.abs(terms).max()
    assert len(modes.frequency) == 6  # three modes a link; the path leaves the frames no freedom


def test_vibrations_show_in_the_motion():
    """A little of one mode as the initial deflection comes back after its period."""
    assembly = assemble(
        arm(gravity=(0.0, 0.0), trajectory=[{"name": "tip", "point": "link2.tip", "x": "1.2", "y": "1.4"}])
    )
    rest = undeformed_state(assembly)
    modes = vibrations(assembly, rest)
    q = rest.q + 1e-7 * modes.shape[:, 0]
    a, _ = oracle_of(assembly).solve(0.0, q, rest.v)
    np.testing.assert_allclose(a, -(modes.frequency[0] ** 2) * (q - rest.q), atol=1e-3 * np.abs(a).max())


def test_ringing_is_what_a_static_start_leaves():
    """A path that accelerates at once: the links vibrate about the deflection that follows it statically.

    For some periods the static part of λ is a parabola; a fit of it and of the vibrations, against the estimate, whose
    forces are relative to the multiplier and all vibrations together.
    """
    path = {"name": "tip", "point": "link2.tip", "x": f"{TIP[0]!r}-t**2", "y": f"{TIP[1]!r}"}
    model = arm(arm_links(EI=3000.0, modes=1), initial=AT_REST, trajectory=[path])
    outcome = run(model, pcid(end=0.02, output_step=1e-4, tolerance=1e-8))
    assembly, start, t = outcome.assembly, State(outcome.q[0], outcome.v[0]), outcome.time
    modes = vibrations(assembly, start)
    waves = [wave(omega * t) for omega in modes.frequency for wave in (np.cos, np.sin)]
    fit = np.linalg.lstsq(np.column_stack([t**0, t, t**2, *waves]), outcome.lambda_, rcond=None)[0]
    measured = np.hypot(fit[3::2], fit[4::2])  # (modes, constraints)
    group = np.array(assembly.groups)
    scale = [np.abs(outcome.lambda_[0, group == g]).max() + measured[:, group == g].sum(axis=0).max() for g in group]
    np.testing.assert_allclose(modal_excitation(assembly, start, modes), (measured / scale).max(axis=1), rtol=0.1)


def test_what_rings_is_resolved_explicitly():
    choice = chosen(arm(), tolerance=1e-6)
    assert choice.name == "dop853"
    assert "highest excited frequency" in choice.reason


def test_stiff_links_that_do_not_ring_are_integrated_implicitly():
    links = arm_links(EI=300.0, modes=12, extra=2)
    choice = chosen(arm(links, initial=AT_REST), tolerance=1e-3)
    assert choice.name == "radau"
    top, rings = (float(text.split()[0]) for text in choice.reason.split("frequency ")[1:])
    assert rings < 0.05 * top


def test_damping_lets_steps_grow():
    """The same ringing start: with strong damping it is over soon."""
    undamped, damped = (arm_links(EI=300.0, modes=8, extra=2, damping_ratio=ratio) for ratio in (0.0, 0.3))
    assert chosen(arm(undamped), tolerance=1e-3).name == "dop853"
    assert chosen(arm(damped), tolerance=1e-3).name == "radau"


@pytest.fixture(scope="module")
def at_rest():
    """Stiff links from rest, and a PCID of them that takes long steps."""
    model = arm(arm_links(EI=300.0, modes=12, extra=2), initial=AT_REST, motors="section")
    return model, run(model, pcid(tolerance=1e-4, integrator="radau"))


def test_a_replay_that_does_not_ring_is_integrated_implicitly(at_rest):
    model, inverse = at_rest
    analysis = forward(tolerance=1e-3, actuation="inverse", apply="trajectory")
    outcome = run(model, analysis, inverse)
    assert outcome.statistics.integrator.candidates[0].name == "radau"
    assert np.abs(outcome.q - inverse.q).max() < 1e-4


def test_motors_without_the_modal_forces_that_went_with_them_let_links_ring(at_rest):
    """From the same rest, under the same moments: judged by how the replay itself rings, not by its source."""
    model, inverse = at_rest
    analysis = forward(tolerance=1e-3, actuation="inverse", apply="joints", max_steps=100)
    outcome = run(model, analysis, inverse)
    assert inverse.statistics.integrator.name == "radau"
    assert outcome.statistics.integrator.candidates[0].name == "dop853"


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


def test_a_choice_of_the_scene_is_kept():
    for name in ("dopri5", "dop853", "radau", "generalized-alpha"):
        choice = chosen(arm(initial=AT_REST), tolerance=1e-2, integrator=name)
        assert (choice.name, choice.reason) == (name, "requested")


@pytest.mark.parametrize("name", ["four-bar", "slider-crank", "tree", "mixed"])
@pytest.mark.parametrize("integrator", ["radau", "generalized-alpha"])
def test_implicit_integrators_agree_with_dop853_on_every_kind_of_joint(name, integrator):
    model = zoo.build(name, analysis=(pcid(),))
    keys = {"end": 0.05, "output_step": 0.01}
    exact = run(model, pcid(tolerance=1e-9, integrator="dop853", **keys))
    outcome = run(model, pcid(tolerance=1e-3, integrator=integrator, **keys))
    assert outcome.status == "completed"
    peak = np.abs(exact.lambda_).max()
    assert np.abs(outcome.lambda_ - exact.lambda_).max() < 1e-3 * peak
