"""The tree of a scene in 3D against the oracle: places, coordinates, gradients, loops, both orders of sides."""

import numpy as np
import pytest
from checkpoint_scenes import as_scene, coordinates, tree_model
from random_mechanisms import TYPES, placed, random_tree
from rotations import quaternion

from ffrobot.mbs.model.model import row_values


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
@pytest.mark.parametrize("seed", range(6))
def test_bodies_stand_where_the_oracle_has_them(seed, turned):
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, rng.permutation(TYPES)[:6], size=0.1)
    plain, tables = as_scene(tree, turned)
    model = tree_model(plain, tables)
    q = model.tree.at_rest(coordinates(model, plain, turned))
    mechanism = plain.mechanism()
    p = [mechanism.coordinates.parts(tree.q, body.name)[2] for body in tree.bodies]
    expected = placed(plain, p)
    for node in model.tree.nodes:
        q[node.p_q] = mechanism.coordinates.parts(tree.q, node.body.name)[2]
    for node, frame in zip(model.tree.nodes, model.tree.frames(q[None]), strict=True):
        R, e, _ = mechanism.coordinates.parts(expected, node.body.name)
        np.testing.assert_allclose(frame.r[0], R, atol=1e-13)
        np.testing.assert_allclose(quaternion(frame.F[0]) * np.sign(e @ quaternion(frame.F[0])), e, atol=1e-13)


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
def test_jacobians_by_differences(turned):
    """L of every frame and section, and C_v of all rows of loops, against differences along `integrate`."""
    rng = np.random.default_rng(7)
    tree = random_tree(rng, TYPES, loops=3)
    plain, tables = as_scene(tree, turned)
    model = tree_model(plain, tables)
    q, h = model.tree.at_rest(coordinates(model, plain, turned)), 1e-6
    for node in model.tree.nodes:
        q[node.p_q] = 0.1 * rng.standard_normal(node.body.n_modes)
    steps = h * np.eye(model.tree.n_v)
    ahead, behind = model.tree.integrate(q, steps), model.tree.integrate(q, -steps)
    times = np.zeros(model.tree.n_v)
    _, C_v = row_values(model, q[None], np.zeros(1))
    difference = (row_values(model, ahead, times)[0] - row_values(model, behind, times)[0]) / (2 * h)
    np.testing.assert_allclose(difference.T, C_v[0], atol=2e-8)
    section = model.tree.section("b9.tip", np.eye(3))
    found = model.tree.motion(section, q[None], model.tree.frames(q[None]))
    r = [model.tree.motion(section, moved, model.tree.frames(moved)) for moved in (ahead, behind)]
    np.testing.assert_allclose((r[0].r - r[1].r).T / (2 * h), found.L[0, :3], atol=2e-8)
    turn = (r[0].F - r[1].F) @ found.F[0].T / (2 * h)
    np.testing.assert_allclose(np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]]), found.L[0, 3:], atol=2e-8)


def test_rows_of_loops_hold_where_the_oracle_has_them():
    """Joints that close loops are where they happen to be: their rows are zero, and as many as the oracle has."""
    for seed in range(3):
        tree = random_tree(np.random.default_rng(seed), ["revolute", "spherical", "cylindrical"], loops=2)
        if any(joint.type == "screw" for joint in tree.loops):
            continue
        plain, tables = as_scene(tree, turned=False)
        model = tree_model(plain, tables)
        q = model.tree.at_rest(coordinates(model, plain, turned=False))
        mechanism = plain.mechanism()
        for node in model.tree.nodes:
            q[node.p_q] = mechanism.coordinates.parts(tree.q, node.body.name)[2]
        C, _ = row_values(model, q[None], np.zeros(1))
        assert C.shape[1] == sum(len(joint.rows()) for joint in tree.loops)
        assert np.abs(C).max() < 1e-12
