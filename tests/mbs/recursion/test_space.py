"""The recursion in 3D against d'Alembert's principle over material points: all joints, trees, loops, rows, loads."""

import numpy as np
import pytest
from points_3d import J, Mechanism, r
from random_bodies import GRAVITY, JOINTS, check_balance, ground, random_body, random_state, row, three_links


@pytest.mark.parametrize("modes", [0, 3])
@pytest.mark.parametrize("joint", JOINTS, ids=[joint.name for joint in JOINTS])
@pytest.mark.parametrize("clamped", [False, True], ids=["free modes", "clamped"])
def test_each_joint_at_the_ground_and_between_bodies(joint, modes, clamped):
    """Three bodies; the joint in question holds the first and the last."""
    rng = np.random.default_rng(1)
    bodies = [
        random_body(rng, modes, joint, clamped),
        random_body(rng, modes, J.revolute, clamped, parent=0, parent_marker=1),
        random_body(rng, modes, joint, clamped, parent=1, parent_marker=2),
    ]
    check_balance(Mechanism(bodies, ground(rng), GRAVITY), rng)


def test_rows_in_several_blocks():
    """Six bodies, free in the tree, that 18 rows of points hold to each other, one along an axis that turns."""
    rng = np.random.default_rng(3)
    bodies = [random_body(rng, 3, J.revolute if k == 4 else J.free, parent=-1 if k < 4 else 3) for k in range(6)]
    rows = [
        row(r.ConstraintKind.point, (k - 1, 1), (k, 2), axis, name=f"{k}")
        for k in range(6)
        for axis in np.eye(3)[: 3 if k else 2]
    ]
    rows.append(row(r.ConstraintKind.slide, (-1, 0), (5, 1), (0.6, 0.8, 0.0)))
    check_balance(Mechanism(bodies, ground(rng, 2), GRAVITY, [x for x, _ in rows], [x for _, x in rows]), rng)


@pytest.mark.parametrize("joint", JOINTS, ids=[joint.name for joint in JOINTS])
def test_forces_along_coordinates_on_modes_and_at_markers(joint):
    rng = np.random.default_rng(2)
    bodies = [
        random_body(rng, 2, J.revolute),
        random_body(rng, 3, joint, parent=0, parent_marker=1),
    ]
    mechanism = Mechanism(bodies, ground(rng), GRAVITY, wrenches=[(1, 2), (0, 1), (0, 2)])
    check_balance(mechanism, rng, force=True)


@pytest.mark.parametrize("points", [1, 2, 3])
@pytest.mark.parametrize("joint", [J.weld, J.prismatic], ids=["welded", "sliding"])
@pytest.mark.parametrize("outboard", [1, 2])
def test_bodies_without_inertia_about_an_axis(joint, points, outboard):
    """Point masses, one or some on a line, beside sections that modes move: their articulated inertia is singular."""
    rng = np.random.default_rng(8)
    small = [random_body(rng, 0, joint, line=True, parent=1, parent_marker=k + 1) for k in range(outboard)]
    for body in small:
        body.mass, body.x, body.Phi = body.mass[:points], body.x[:points], body.Phi[:points]
    link = random_body(rng, 4, J.universal, parent=0, parent_marker=1)
    mechanism = Mechanism([random_body(rng, 3, J.revolute), link, *small], ground(rng), GRAVITY)
    check_balance(mechanism, rng)


@pytest.mark.parametrize("seed", range(6))
def test_trees(seed):
    """Random trees of random joints, rigid bodies and bodies of up to five modes."""
    rng = np.random.default_rng(seed)
    bodies = []
    for i in range(6):
        parent = int(rng.integers(-1, i)) if i else -1
        joint = JOINTS[int(rng.integers(len(JOINTS)))]
        keys = {"parent": parent, "parent_marker": 0 if parent < 0 else int(rng.integers(1, 3))}
        bodies.append(random_body(rng, int(rng.integers(0, 6)), joint, bool(rng.integers(2)), **keys))
    check_balance(Mechanism(bodies, ground(rng), GRAVITY), rng)


def test_rows_of_every_kind():
    """Path of a point, two rotations, a slide to the ground, a right angle between bodies, a joint's coordinate."""
    rng = np.random.default_rng(4)
    K = r.ConstraintKind
    rows = [
        *(row(K.point, (-1, 1), (2, 1), axis) for axis in np.eye(3)),
        *(row(K.rotation, (-1, 1), (2, 2), axis) for axis in np.eye(3)[:2]),
        row(K.slide, (0, 2), (1, 2), (0.6, 0.8, 0)),
        row(K.dot, (0, 1), (2, 1), (0, 0, 1), (0.6, 0, 0.8)),
    ]
    mechanism = Mechanism(three_links(rng, 4), ground(rng, 2), GRAVITY, [x for x, _ in rows], [x for _, x in rows])
    check_balance(mechanism, rng)


@pytest.mark.parametrize("modes", [0, 3])
def test_a_loop(modes):
    """Two arms of different length on the ground, closed by a spherical joint; the first driven."""
    rng = np.random.default_rng(5)
    bodies = [
        random_body(rng, modes, J.revolute),
        random_body(rng, modes, J.spherical, parent=0, parent_marker=1),
        random_body(rng, modes, J.universal),
        random_body(rng, modes, J.cylindrical, parent=2, parent_marker=2),
    ]
    bodies[2].parent_marker = 1
    rows = [row(r.ConstraintKind.point, (3, 1), (1, 2), axis) for axis in np.eye(3)]
    mechanism = Mechanism(bodies, ground(rng, 2), GRAVITY, [x for x, _ in rows], [x for _, x in rows])
    check_balance(mechanism, rng)


def test_a_driven_joint_coordinate():
    rng = np.random.default_rng(6)
    bodies = [random_body(rng, 3, J.revolute), random_body(rng, 3, J.revolute, parent=0, parent_marker=1)]
    mechanism = Mechanism(bodies, ground(rng), GRAVITY)
    q, v = random_state(rng, mechanism, mechanism.model())
    coordinate = mechanism.model().first[1][2]
    driven, _ = row(r.ConstraintKind.coordinate, (0, 0), (0, 0), (1, 0, 0))
    driven.coordinate = coordinate
    mechanism.rows = [driven]
    model = mechanism.model()
    a, lambda_ = model.evaluate(q, v, np.array([0.7]), None, None)
    assert abs(a[coordinate] - 0.7) < 1e-12
    mechanism.rows, force = [], np.zeros(model.n_v)
    force[coordinate] = -lambda_[0]
    residual, _ = mechanism.residual(mechanism.model(), q, v, a, [], force, None)
    assert np.abs(residual).max() < 1e-11


def test_momentum_and_energy_of_a_free_tree():
    """Without gravity and damping the rates of energy and momentum vanish: differences of order 2 along the motion."""
    rng = np.random.default_rng(7)
    bodies = three_links(rng)
    bodies[0].joint = J.free
    for body in bodies:
        body.damping *= 0
    mechanism = Mechanism(bodies, ground(rng), np.zeros(3))
    model = mechanism.model()
    q, v = random_state(rng, mechanism, model)
    a, _ = model.evaluate(q, v, np.zeros(0), None, None)
    step = 1e-4

    def after(h):
        there, rates = q.copy(), v + h * a
        middle = v + 0.5 * h * a
        for body, (joint_q, p_q, joint_v, p_v) in zip(mechanism.bodies, model.first, strict=True):
            linear = 3 if body.joint == J.free else 0
            there[p_q : p_q + body.n] += h * middle[p_v : p_v + body.n]
            if body.joint in (J.spherical, J.free):
                there[joint_q : joint_q + linear] += h * middle[joint_v : joint_v + linear]
                x = h * middle[joint_v + linear : joint_v + linear + 3]
                angle = np.linalg.norm(x)
                w1, v1 = q[joint_q + linear], q[joint_q + linear + 1 : p_q]
                w2, v2 = np.cos(angle / 2), np.sin(angle / 2) * x / angle
                there[joint_q + linear : p_q] = [w1 * w2 - v1 @ v2, *(w1 * v2 + w2 * v1 + np.cross(v1, v2))]
            else:
                there[joint_q:p_q] += h * middle[joint_v:p_v]
        totals = model.totals(there, rates)
        return np.array([totals.kinetic + totals.strain, *totals.momentum, *totals.angular_momentum])

    rate = (after(step) - after(-step)) / (2 * step)
    finer = (after(step / 2) - after(-step / 2)) / step
    assert np.abs((4 * finer - rate) / 3).max() < 1e-8 * np.abs(after(step)).max()  # of order step^4, and rounding
    assert np.abs(rate).max() > 1e-8 * np.abs(after(step)).max()
