"""Random spatial bodies of material points, their joints, states and rows."""

import numpy as np
from points_3d import Body, J, Mechanism, r
from random_mechanisms import symmetric

JOINTS = list(J)
GRAVITY = np.array([0.3, 1.0, -9.81])


def rotation(rng):
    Q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    return Q * np.linalg.det(Q)


def random_body(rng, modes, joint, clamped=False, curved=False, line=False, **keys):
    """Points with random modes, dense damping, a root and two outer sections; `clamped`: modes leave the root alone.

    `curved`: they move to second order besides, all but a clamped root; `line`: they are on a line.
    """
    points = 10
    mass, x = rng.uniform(0.1, 0.4, points), rng.uniform([0, -0.1, -0.1], [1, 0.1, 0.1], (points, 3))
    if line:
        x = x[:, :1] * rotation(rng)[:, 0] + rng.standard_normal(3)
    Phi = rng.standard_normal((points, 3, modes)) * 0.5
    if modes:
        flat = Phi.reshape(3 * points, modes)
        gram = flat.T @ (np.repeat(mass, 3)[:, None] * flat)
        Phi = (flat @ np.linalg.inv(np.linalg.cholesky(gram)).T).reshape(points, 3, modes)
    C = rng.standard_normal((modes, modes)) * 0.3
    markers = [
        (
            rng.standard_normal(3) * 0.3,
            rotation(rng),
            rng.standard_normal((6, modes)) * (0 if clamped and k == 0 else 0.5),
        )
        for k in range(3)
    ]
    stiffness = np.sort(rng.uniform(1, 60, modes))
    if curved and modes:
        keys["G"] = symmetric(rng, 4, 3, modes) / modes
        keys["K"] = [symmetric(rng, 6, modes) * (0 if clamped and k == 0 else 1 / modes) for k in range(3)]
    return Body(mass, x, Phi, stiffness, C @ C.T, markers, joint, lead=0.13, **keys)


def ground(rng, count=1):
    return [(rng.standard_normal(3), rotation(rng)) for _ in range(count)]


def random_state(rng, mechanism, model, deflection=0.1):
    q, v = deflection * rng.standard_normal(model.n_q), rng.standard_normal(model.n_v)
    for body, (joint_q, p_q, *_) in zip(mechanism.bodies, model.first, strict=True):
        q[joint_q:p_q] = rng.standard_normal(p_q - joint_q)
        if body.joint in (J.spherical, J.free):
            e = q[p_q - 4 : p_q]
            e /= np.linalg.norm(e)
    return q, v


def state_near_rest(rng, mechanism, model, deflection, speed):
    """Of small coordinates; joints with quaternions are not turned."""
    q, v = deflection * rng.standard_normal(model.n_q), speed * rng.standard_normal(model.n_v)
    for body, (_, p_q, *_) in zip(mechanism.bodies, model.first, strict=True):
        if body.joint in (J.spherical, J.free):
            q[p_q - 4 : p_q] = [1, 0, 0, 0]
    return q, v


def row(kind, a, b, f, g=(1, 0, 0), name="row"):
    row = r.ConstraintModel()
    row.name, row.kind, row.a, row.b = name, kind, r.MarkerAt(*a), r.MarkerAt(*b)
    row.f, row.g = np.array(f, dtype=float), np.array(g, dtype=float)
    return row, (a, b)


def three_links(rng, modes=3, **keys):
    return [
        random_body(rng, modes, J.revolute, **keys),
        random_body(rng, modes, J.spherical, parent=0, parent_marker=1, **keys),
        random_body(rng, modes, J.universal, parent=1, parent_marker=1, **keys),
    ]


def random_tree(rng, **keys):
    """Of random joints, rigid bodies and bodies of up to five modes, clamped or not; of keys that are None, any."""
    bodies = []
    for i in range(6):
        parent = int(rng.integers(-1, i)) if i else -1
        at = {"parent": parent, "parent_marker": 0 if parent < 0 else int(rng.integers(1, 3))}
        joint = JOINTS[int(rng.integers(len(JOINTS)))]
        drawn = {key: value if isinstance(value, bool) else bool(rng.integers(2)) for key, value in keys.items()}
        bodies.append(random_body(rng, int(rng.integers(0, 6)), joint, bool(rng.integers(2)), **at, **drawn))
    return with_rows(rng, bodies, [], bases=1)


def with_rows(rng, bodies, rows, bases=2):
    """The bodies on `bases` sections of the ground, under rows as `row` makes them."""
    return Mechanism(bodies, ground(rng, bases), GRAVITY, [x for x, _ in rows], [x for _, x in rows])


def rows_of_every_kind(rng, **keys):
    """Path of a point, two rotations, a slide to the ground, a right angle between bodies."""
    K = r.ConstraintKind
    rows = [
        *(row(K.point, (-1, 1), (2, 1), axis) for axis in np.eye(3)),
        *(row(K.rotation, (-1, 1), (2, 2), axis) for axis in np.eye(3)[:2]),
        row(K.slide, (0, 2), (1, 2), (0.6, 0.8, 0)),
        row(K.dot, (0, 1), (2, 1), (0, 0, 1), (0.6, 0, 0.8)),
    ]
    return with_rows(rng, three_links(rng, 4, **keys), rows)


def check_balance(mechanism, rng, bound=1e-11, force=False, deflection=0.1):
    """Accelerations of the recursion, and forces that others take, against d'Alembert's principle over all points."""
    model = mechanism.model()
    q, v = random_state(rng, mechanism, model, deflection=deflection)
    target = rng.standard_normal(len(mechanism.rows))
    applied = rng.standard_normal(model.n_v) if force else None
    wrench = rng.standard_normal(6 * len(mechanism.wrenches))
    a, lambda_ = model.evaluate(q, v, target, applied, wrench)
    along = mechanism.directions(model, q)
    left, size, accelerations = mechanism.forces(model, along, q, v, a, lambda_, applied, wrench)
    assert np.abs(left).max() < bound * size
    if len(target):
        assert np.abs(accelerations - target).max() < bound * (1 + np.abs(a).max())
    check_known_motion(mechanism, model, along, q, v, a + rng.standard_normal(len(a)), bound)


def check_known_motion(mechanism, model, along, q, v, a, bound):
    """Newton–Euler: M a − Q and second derivatives of rows at accelerations that no forces of the mechanism make."""
    scene, unloaded = r.TreeScene(), np.zeros(6 * len(mechanism.wrenches))
    for _ in mechanism.rows:
        scene.add_target(r.TimeFunction.constant(0.0), 1.0)
    expected, size, accelerations = mechanism.forces(
        model, along, q, v, a, np.zeros(len(mechanism.rows)), None, unloaded
    )
    state = [0.0], q[None], v[None], a[None]
    required, of_rows = model.required_forces(scene, *state)[0], model.row_accelerations(scene, *state)[0]
    np.testing.assert_allclose(required, expected, rtol=0, atol=bound * size)
    if len(of_rows):
        np.testing.assert_allclose(of_rows, accelerations, rtol=0, atol=bound * (1 + np.abs(a).max()))
