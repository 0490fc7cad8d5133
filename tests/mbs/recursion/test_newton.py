"""The matrix of Newton's method in implicit integrators against dense matrices of all coordinates.

N x + C_qᵀν = r, C_q x = c with N = M + E: M from forces that accelerations require (Newton and Euler), C_q from rates
of rows, and one factorization of all.
"""

import numpy as np
import pytest
from points_3d import Body, J, Mechanism, r
from random_bodies import GRAVITY, ground, random_body, random_state, random_tree, row, rows_of_every_kind
from trees_in_a_plane import planar_model

from ffrobot.mbs import _core
from ffrobot.mbs.model.system import MultibodySystem

FACTORS = [(0.02, 3e-4), (3.0, 20.0), (0.7 + 0.4j, 5.0 - 8.0j)]
STILL = _core.TimeFunction.constant(0.0)


def scene_of(rows, springs=()):
    """Rows that hold still; springs and viscous friction (q, v, stiffness, damping) along joints."""
    scene = _core.TreeScene()
    for _ in range(rows):
        scene.add_target(STILL)
    for q, v, stiffness, damping in springs:
        scene.add_joint_force(q, v, stiffness, 0.0, damping, 0.0, 1.0)
    return scene


def required(system, scene, q, v, a):
    return system.required_forces(scene, [0.0], q[None], v[None], a[None])[0]


def mass_and_gradients(model, q, scene):
    """M (n_v, n_v) and C_q (rows, n_v)."""
    rest, large = np.zeros(model.n_v), 1e7  # beside what is required at rest, which is subtracted
    start, rates = required(model, scene, q, rest, rest), model.measure(q, rest)[1]
    M = [(required(model, scene, q, rest, large * unit) - start) / large for unit in np.eye(model.n_v)]
    C = [model.measure(q, unit)[1] - rates for unit in np.eye(model.n_v)]
    return np.array(M).T, np.array(C).T


def agree(found, N, C, r, c):
    """To 1e-10 of the largest entry, in units in which N has ones on its diagonal."""
    size = 1 / np.sqrt(np.abs(np.diag(N)))
    A = C * size
    of_row = 1 / np.linalg.norm(A, axis=1)
    A = A * of_row[:, None]
    whole = np.block([[N * size * size[:, None], A.T], [A, np.zeros((len(C), len(C)))]])
    expected = np.linalg.solve(whole, np.concatenate([size * r, of_row * c]))[: len(N)]
    np.testing.assert_allclose(found / size, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def check(model, q, scene, stiffness, damping, rows, seed=1):
    """`stiffness` and `damping` (n_v) of modes and joints; forces act where these are."""
    rng = np.random.default_rng(seed)
    n = model.n_v
    M, C = mass_and_gradients(model, q, scene_of(rows))
    stiff = (stiffness != 0) | (damping != 0)
    for of_damping, of_stiffness in FACTORS:
        E = np.diag(of_damping * damping + of_stiffness * stiffness)
        force, c = stiff * rng.standard_normal(n), rng.standard_normal(rows)
        if isinstance(of_damping, complex):
            force, c = force + 1j * stiff * rng.standard_normal(n), np.zeros(rows)
        found = _core.tree_newton_step(model, scene, 0.0, q, np.zeros(n), of_damping, of_stiffness, force, c)
        agree(found, M + E, C, force, c)


def check_mechanism(mechanism, rng):
    model = mechanism.model()
    q, _ = random_state(rng, mechanism, model)
    stiffness, damping, springs = np.zeros(model.n_v), np.zeros(model.n_v), []
    for body, (joint_q, p_q, joint_v, p_v) in zip(mechanism.bodies, model.first, strict=True):
        stiffness[p_v : p_v + body.n], damping[p_v : p_v + body.n] = body.stiffness, np.diag(body.damping)
        if p_q - joint_q == p_v - joint_v:
            springs += [(joint_q + k, joint_v + k, *rng.uniform(1, 9, 2)) for k in range(p_v - joint_v)]
    for _, v, k, d in springs:
        stiffness[v], damping[v] = k, d
    check(model, q, scene_of(len(mechanism.rows), springs), stiffness, damping, len(mechanism.rows))


@pytest.mark.parametrize("curved", [False, True], ids=["", "stiffened"])
@pytest.mark.parametrize(("made", "seed"), [*((random_tree, seed) for seed in range(6)), (rows_of_every_kind, 4)])
def test_trees_and_rows_of_every_kind_in_3d(made, seed, curved):
    rng = np.random.default_rng(seed)
    check_mechanism(made(rng, curved=curved), rng)


class Geared(Body):
    """With a rotor in its joint."""

    def core(self, name):
        body = super().core(name)
        body.rotor_inertia, body.gear_ratio = 0.2, 7.0
        return body


@pytest.mark.parametrize("clamped", [False, True], ids=["free modes", "clamped"])
def test_rotors(clamped):
    rng = np.random.default_rng(5)
    bodies = [
        random_body(rng, 3, J.revolute, clamped),
        random_body(rng, 3, J.prismatic, clamped, parent=0, parent_marker=1),
        random_body(rng, 3, J.revolute, clamped, parent=1, parent_marker=2),
    ]
    check_mechanism(Mechanism([Geared(**vars(body)) for body in bodies], ground(rng), GRAVITY), rng)


def test_driven_coordinate_in_3d():
    rng = np.random.default_rng(6)
    bodies = [random_body(rng, 3, J.revolute), random_body(rng, 3, J.revolute, parent=0, parent_marker=1)]
    mechanism = Mechanism(bodies, ground(rng), GRAVITY)
    driven, at = row(r.ConstraintKind.coordinate, (0, 0), (0, 0), (1, 0, 0))
    driven.coordinate = mechanism.model().first[1][2]
    mechanism.rows, mechanism.row_sides = [driven], [at]
    check_mechanism(mechanism, rng)


MIXED = ["revolute", "prismatic", "revolute", "weld", "planar", "revolute"]


@pytest.mark.parametrize("followed", [False, True], ids=["tree", "rows"])
@pytest.mark.parametrize(("types", "sprung"), [(["revolute"] * 3, False), (["revolute"] * 3, True), (MIXED, True)])
@pytest.mark.parametrize("seed", range(5))
def test_mechanisms_of_the_plane(seed, types, sprung, followed):
    """Bodies of all kinds; springs and friction along joints, or none: pins then pass no moments on."""
    rng, resisted = np.random.default_rng(seed), {"viscous_friction": 1.0} if sprung else {}
    ends = (("b1.tip", "x"), (f"b{len(types)}.tip", "y"))  # of which each moves by a joint of its own
    paths = tuple({"name": f"along_{axis}", "point": point, axis: STILL} for point, axis in ends if followed)
    tree_model = planar_model(
        rng, types, normal=[0.0, 0.0, 1.0], joint_keys=dict.fromkeys(("revolute", "prismatic"), resisted),
        trajectory=paths,
    )  # fmt: skip
    (model, *_), nodes = MultibodySystem(tree_model).integrated, tree_model.tree.nodes
    q = 0.5 + 0.1 * rng.standard_normal(model.n_q)
    stiffness, damping, springs = np.zeros(model.n_v), np.zeros(model.n_v), []
    for node in nodes:
        stiffness[node.p_v], damping[node.p_v] = node.body.stiffness, np.diag(node.body.damping)
        at = zip(range(node.q.start, node.q.stop), range(node.v.start, node.v.stop), strict=True)
        springs += [(*of_one, *rng.uniform(1, 9, 2)) for of_one in at if sprung and node.joint.type != "planar"]
    for _, v, k, d in springs:
        stiffness[v], damping[v] = k, d
    rows = 2 * followed
    check(model, q, scene_of(rows, springs), stiffness, damping, rows)
