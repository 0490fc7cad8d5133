"""Motions in joint coordinates: closed forms, identities."""

import numpy as np
import pytest
from equal_steps import controls
from mechanisms import relative
from points_3d import J, Mechanism, r
from random_bodies import ground, random_body, row, state_near_rest, three_links

from ffrobot.mbs import _core
from ffrobot.mbs.fields.expressions import parse_expression

OMEGA, FORCE = 30.0, 5.0  # of an oscillator


def on(t):
    return True


def test_laws_that_share_parts():
    """A mass on sines and cosines of one angle: place, rate and, opposite to multipliers, m (a - g), by calculus."""
    body, data = r.SpatialBody(), r.SpatialData()
    data.mass, data.J2, data.markers = 2.0, np.eye(3), [r.SpatialMarker()]
    body.name, body.joint, body.data = "mass", J.free, data
    rows = [row(r.ConstraintKind.point, (-1, 0), (0, 0), axis)[0] for axis in np.eye(3)]
    gravity = np.array([0.0, 0, -9.81])
    model = r.SpatialModel([body], [r.SpatialMarker()], rows, [], gravity)
    scene = _core.TreeScene()
    texts = "2+0.5*cos(3*t-1)", "0.3*sin(3*t-1)-(3*t-1)/7", "0.1*cos(3*t-1)*sin(3*t-1)-0.3*sin(3*t-1)"
    laws = [parse_expression(text) for text in texts]
    for law in laws:
        scene.add_target(law)
    q, v = (np.array([*(law(0.7)[k] for law in laws), *rest]) for k, rest in ((0, [1.0, 0, 0, 0]), (1, [0, 0, 0])))
    run = _core.tree_motion(model, scene, [0.7, 0.8], q, v, controls(), on)
    for t, state, force in zip((0.7, 0.8), run.states, run.multipliers, strict=True):
        c, s = np.cos(3 * t - 1), np.sin(3 * t - 1)
        place = [2 + 0.5 * c, 0.3 * s - (3 * t - 1) / 7, 0.1 * c * s - 0.3 * s]
        rate = [-1.5 * s, 0.9 * c - 3 / 7, 0.3 * (c * c - s * s) - 0.9 * c]
        acceleration = np.array([-4.5 * c, -2.7 * s, -3.6 * s * c + 2.7 * s])
        np.testing.assert_allclose(model.measure(state[:7], state[7:]), [place, rate], rtol=0, atol=1e-12)
        np.testing.assert_allclose(-force, 2.0 * (acceleration - gravity), rtol=0, atol=1e-11)


def links_held_at_a_point(rng, directions):
    """Three links with rows of their last tip along `directions`, and a state near rest."""
    rows = [row(r.ConstraintKind.point, (-1, 1), (2, 1), axis) for axis in directions]
    bodies, bases = three_links(rng), ground(rng, 2)
    mechanism = Mechanism(bodies, bases, np.array([0, 0, -9.81]), [x for x, _ in rows], [x for _, x in rows])
    model = mechanism.model()
    return mechanism, model, *state_near_rest(rng, mechanism, model, 0.1, 1.0)


def test_dependent_rows_are_found_and_left_out():
    """The same point held twice: three of six rows are kept, motion as with three."""
    mechanism, model, q, v = links_held_at_a_point(np.random.default_rng(8), [*np.eye(3), *np.eye(3)])
    assert len(model.keep_independent_rows(q, v)) == 3
    a, lambda_ = model.evaluate(q, v, np.ones(6), None, None)
    mechanism.rows, mechanism.row_sides = mechanism.rows[:3], mechanism.row_sides[:3]
    expected, _ = mechanism.model().evaluate(q, v, np.ones(3), None, None)
    assert relative(a, expected) < 1e-12
    assert np.count_nonzero(lambda_) == 3


def test_of_dependent_rows_the_largest_are_kept():
    """A point held along x and z, and the sum of both a million times smaller, listed first: S of the kept is regular.

    Multipliers of the small row would be a million times as large.
    """
    directions = 1e-6 * np.array([1.0, 0, 1]), np.eye(3)[0], np.eye(3)[2], 1e-9 * np.eye(3)[1]
    _, model, *state = links_held_at_a_point(np.random.default_rng(8), directions)
    assert model.keep_independent_rows(*state) == [1, 2, 3]


def test_a_run_ends_where_it_is_told_to():
    """What there was is kept; an exception of the caller comes through."""
    rng = np.random.default_rng(0)
    model = Mechanism([random_body(rng, 2, J.revolute)], ground(rng), np.array([0, 0, -9.81])).model()
    q, v, times = np.zeros(model.n_q), 0.1 * np.ones(model.n_v), list(np.linspace(0, 500, 5001))
    asked = []
    run = _core.tree_motion(
        model, _core.TreeScene(), times, q, v, controls(), lambda t: asked.append(t) or len(asked) < 3
    )
    assert run.status == _core.IntegrationStatus.interrupted
    assert len(asked) == 3
    assert run.time_reached == asked[-1] < 500
    assert 0 < len(run.states) == len(run.multipliers) == np.searchsorted(times, asked[-1], "right")
    with pytest.raises(ZeroDivisionError):
        _core.tree_motion(model, _core.TreeScene(), times, q, v, controls(), lambda t: 1 / 0)


def test_a_force_that_begins_at_zero_in_a_run_from_before():
    """Closed form x = t² F / 2 m; numbers next to 0 are 5e-324 apart, times of steps and samples are not."""
    body = random_body(np.random.default_rng(4), 0, J.prismatic)
    model = Mechanism([body], ground(np.random.default_rng(5)), np.zeros(3)).model()
    q, _, v, _ = model.first[0]
    along = np.eye(model.n_v)[v]
    acceleration = model.evaluate(np.zeros(model.n_q), np.zeros(model.n_v), np.zeros(0), along, None)[0][v]
    scene = _core.TreeScene()
    scene.add_load(along, parse_expression("where(t < 0, 0, 1)"))
    samples, times = _core.Samples(1e-3, 10_000), np.linspace(-0.3, 1.0, 14)
    start = np.zeros(model.n_q), np.zeros(model.n_v)
    run = _core.tree_motion(model, scene, list(times), *start, controls(), on, None, samples)
    assert np.abs(run.states[:, q] - np.maximum(times, 0) ** 2 * acceleration / 2).max() < 1e-12 * acceleration
    assert np.diff(samples.times).min() > 1e-20
    assert run.evaluations < 2000


def body_with_a_mode():
    """Welded to the ground: p_ddot + ω² p = f."""
    body, data = _core.SpatialBody(), _core.SpatialData()
    body.name, body.joint = "oscillator", J.weld
    data.mass, data.J2 = 2.0, np.diag([0.1, 0.2, 0.3])
    data.stiffness, data.damping = np.array([OMEGA**2]), np.zeros((1, 1))
    data.S_bar, data.I_bar = np.zeros((3, 1)), np.zeros((9, 1))
    marker = _core.SpatialMarker()
    marker.Phi = np.zeros((6, 1))
    data.markers = [marker]
    body.data = data
    return _core.SpatialModel([body], [_core.SpatialMarker()], [], [], np.zeros(3))


def test_sizes_of_a_mode_at_rest_are_those_of_its_force():
    """With which the norm compares errors, before it has moved much: f/ω², f/ω, f, which f leads to."""
    scene = _core.TreeScene()
    scene.add_load(np.array([1.0]), _core.TimeFunction.constant(FORCE))
    stopped_at, rest, one_step = _core.TreeCheckpoint(), np.zeros(1), controls(tolerance=1e-6, max_steps=1)
    run = _core.tree_motion(body_with_a_mode(), scene, [0.0, 10.0], rest, rest, one_step, on, stopped_at)
    assert 0 < run.time_reached < 0.5 / OMEGA  # half a radian: cos 0.5 of the static deflection is left to come
    of_modes = stopped_at.state_peaks[2::3]  # groups: ways, angles, modes; of states, rates, accelerations
    np.testing.assert_allclose(of_modes, [FORCE / OMEGA**2, FORCE / OMEGA, FORCE], rtol=1e-12)
