"""Geometric stiffening in the recursion in 3D, against d'Alembert's principle over points that move to second order.

Their second-order field is affine, so that the projection in the core is exact.
"""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from points_3d import J, Mechanism, Series, r
from random_bodies import GRAVITY, JOINTS, check_balance, ground, random_body, random_state, row, three_links

check = partial(check_balance, deflection=0.3)


@pytest.mark.parametrize("joint", JOINTS, ids=[joint.name for joint in JOINTS])
@pytest.mark.parametrize("clamped", [False, True], ids=["free modes", "clamped"])
@pytest.mark.parametrize("line", [False, True], ids=["solid", "line of mass"])
def test_each_joint_at_the_ground_and_between_bodies(joint, clamped, line):
    """Three bodies; the joint in question holds the first and the last."""
    rng = np.random.default_rng(1)
    bodies = [
        random_body(rng, 3, joint, clamped, curved=True, line=line),
        random_body(rng, 4, J.revolute, clamped, curved=True, line=line, parent=0, parent_marker=1),
        random_body(rng, 3, joint, clamped, curved=True, line=line, parent=1, parent_marker=2),
    ]
    check(Mechanism(bodies, ground(rng), GRAVITY, wrenches=[(2, 2), (1, 1)]), rng, force=True)


@pytest.mark.parametrize("seed", range(6))
def test_trees_of_bodies_with_and_without(seed):
    rng = np.random.default_rng(seed)
    bodies = []
    for i in range(6):
        parent = int(rng.integers(-1, i)) if i else -1
        joint = JOINTS[int(rng.integers(len(JOINTS)))]
        keys = {"parent": parent, "parent_marker": 0 if parent < 0 else int(rng.integers(1, 3))}
        keys["curved"] = bool(rng.integers(2))
        bodies.append(random_body(rng, int(rng.integers(0, 6)), joint, bool(rng.integers(2)), **keys))
    check(Mechanism(bodies, ground(rng), GRAVITY), rng)


def test_rows_of_every_kind():
    rng = np.random.default_rng(4)
    K = r.ConstraintKind
    rows = [
        *(row(K.point, (-1, 1), (2, 1), axis) for axis in np.eye(3)),
        *(row(K.rotation, (-1, 1), (2, 2), axis) for axis in np.eye(3)[:2]),
        row(K.slide, (0, 2), (1, 2), (0.6, 0.8, 0)),
        row(K.dot, (0, 1), (2, 1), (0, 0, 1), (0.6, 0, 0.8)),
    ]
    bodies = three_links(rng, 4, curved=True)
    check(Mechanism(bodies, ground(rng, 2), GRAVITY, [x for x, _ in rows], [x for _, x in rows]), rng)


def test_a_loop():
    rng = np.random.default_rng(5)
    bodies = [
        random_body(rng, 3, J.revolute, curved=True),
        random_body(rng, 3, J.spherical, curved=True, parent=0, parent_marker=1),
        random_body(rng, 3, J.universal, curved=True, parent_marker=1),
        random_body(rng, 3, J.cylindrical, curved=True, parent=2, parent_marker=2),
    ]
    rows = [row(r.ConstraintKind.point, (3, 1), (1, 2), axis) for axis in np.eye(3)]
    check(Mechanism(bodies, ground(rng, 2), GRAVITY, [x for x, _ in rows], [x for _, x in rows]), rng)


def test_fields_that_vanish_change_nothing():
    """K of zeros takes the path of stiffened bodies: the numbers are those of the other one."""
    rng = np.random.default_rng(6)
    plain = three_links(rng, 4)
    zero = [replace(body, G=np.zeros((4, 3, 4, 4)), K=[np.zeros((6, 4, 4))] * 3) for body in plain]
    models = [Mechanism(bodies, ground(np.random.default_rng(0)), GRAVITY).model() for bodies in (plain, zero)]
    q, v = random_state(rng, Mechanism(plain, [], GRAVITY), models[0])
    a, b = (model.evaluate(q, v, np.zeros(0), None, None)[0] for model in models)
    np.testing.assert_allclose(a, b, rtol=0, atol=1e-12 * np.abs(a).max())


def test_energy_and_momentum_of_points():
    """Totals of free bodies in a tree are sums over their points."""
    rng = np.random.default_rng(7)
    bodies = [random_body(rng, 4, J.free, curved=True), random_body(rng, 3, J.universal, curved=True, parent=0)]
    mechanism = Mechanism(bodies, ground(rng), GRAVITY)
    model = mechanism.model()
    q, v = random_state(rng, mechanism, model, deflection=0.3)
    z = [Series([0.0, rate, 0.0]) for rate in v]
    kinetic, gravitational, momentum, angular = 0.0, 0.0, np.zeros(3), np.zeros(3)
    for body, points in zip(bodies, mechanism.motion(model, q, z)[1], strict=True):
        place, velocity = points.c[0], points.c[1]
        kinetic += 0.5 * body.mass @ np.sum(velocity**2, axis=1)
        gravitational -= body.mass @ place @ GRAVITY
        momentum += body.mass @ velocity
        angular += body.mass @ np.cross(place, velocity)
    found = model.totals(q, v)
    np.testing.assert_allclose([found.kinetic, found.gravitational], [kinetic, gravitational], rtol=1e-12)
    np.testing.assert_allclose(found.momentum, momentum, rtol=1e-11)
    np.testing.assert_allclose(found.angular_momentum, angular, rtol=1e-11)


def test_derivatives_by_differences():
    """Dual numbers through the same equations; quaternions aside, which are turned as without stiffening."""
    rng = np.random.default_rng(8)
    joints = (J.revolute, J.universal, J.prismatic)
    bodies = [
        random_body(rng, 3, joint, curved=True, line=k == 1, parent=k - 1, parent_marker=min(k, 1))
        for k, joint in enumerate(joints)
    ]
    rows = [row(r.ConstraintKind.point, (-1, 1), (2, 1), (0.6, 0.8, 0))]
    mechanism = Mechanism(bodies, ground(rng, 2), GRAVITY, [x for x, _ in rows], [x for _, x in rows])
    model = mechanism.model()
    q, v = random_state(rng, mechanism, model, deflection=0.3)
    target, force, h = np.zeros(1), rng.standard_normal(model.n_v), 1e-6
    found = model.derivatives(q, v, target, force, None)

    def slope(of):
        return np.array([(of(h * e) - of(-h * e)) / (2 * h) for e in np.eye(model.n_v)]).T

    def a(q, v, force):
        return model.evaluate(q, v, target, force, None)[0]

    by = {
        "a_q": slope(lambda e: a(q + e, v, force)),
        "a_v": slope(lambda e: a(q, v + e, force)),
        "a_f": slope(lambda e: a(q, v, force + e)),
        "value_q": slope(lambda e: model.measure(q + e, v)[0]),
        "rate_q": slope(lambda e: model.measure(q + e, v)[1]),
    }
    for key, expected in by.items():
        np.testing.assert_allclose(
            getattr(found, key), expected, rtol=0, atol=2e-8 * np.abs(expected).max(), err_msg=key
        )
