"""Forces in joints of trees and loops against the oracle's multipliers, which know nothing of summing inwards."""

import numpy as np
import pytest
from body_equations import accelerated
from checkpoint_scenes import as_scene, coordinates, tree_model
from random_mechanisms import TYPES, placed, random_tree

from ffrobot.mbs.quantities.motion import RobotMotion
from ffrobot.mbs.quantities.reactions import reactions

JOINTS = [type_ for type_ in TYPES if type_ != "free"]
LOOPED = [
    seed
    for seed in range(40)
    if random_tree(np.random.default_rng(seed), ["revolute"] * 3, loops=1).loops[0].type == "spherical"
]


def random_case(rng, turned, types, loops):
    """A random tree in motion: of the oracle, and as a motion of one instant of the scene's model."""
    tree = random_tree(rng, types, loops=loops)
    plain, tables = as_scene(tree, turned)
    model, mechanism = tree_model(plain, tables), plain.mechanism()
    p = [mechanism.coordinates.parts(tree.q, body.name)[2] for body in tree.bodies]
    Q = placed(plain, p)
    V = rng.standard_normal(mechanism.size)
    C_v = mechanism.constraint_values(0.0, Q, V)[2]
    V -= np.linalg.pinv(C_v, rcond=1e-10) @ (C_v @ V)
    a, multipliers = mechanism.solve(0.0, Q, V)
    q, v, p_2dot = (
        model.tree.at_rest(coordinates(model, plain, turned)),
        np.zeros(model.tree.n_v),
        np.zeros(model.tree.n_v),
    )
    for node in model.tree.nodes:
        q[node.p_q] = mechanism.coordinates.parts(Q, node.body.name)[2]
        v[node.p_v], p_2dot[node.p_v] = (mechanism.coordinates.rates(x, node.body.name)[2] for x in (V, a))
    frames = model.tree.frames(q[None])
    twists = [mechanism.coordinates.rates(V, node.body.name) for node in model.tree.nodes]
    wanted = np.concatenate([[*x[0], *(frame.F[0] @ x[1])] for x, frame in zip(twists, frames, strict=True)])
    L, joints = np.concatenate([frame.L[0] for frame in frames]), model.tree.joint_columns
    v[joints] = np.linalg.lstsq(L[:, joints], wanted - L @ v, rcond=None)[0]
    np.testing.assert_allclose(L @ v, wanted, atol=1e-9)
    of_loops = multipliers[len(multipliers) - len(model.rows) :]
    motion = RobotMotion(model, np.zeros(1), q[None], v[None], p_2dot[None], of_loops[None])
    rates = [mechanism.coordinates.rates(a, node.body.name) for node in model.tree.nodes]
    wanted = np.concatenate([[*x[0], *(frame.F[0] @ x[1])] for x, frame in zip(rates, frames, strict=True)])
    bias = np.concatenate([[*x.r[0], *x.Omega[0]] for x in accelerated(motion).of_frames()])
    motion.a[0, joints] = np.linalg.lstsq(L[:, joints], wanted - bias, rcond=None)[0]
    found = np.concatenate([[*x.r[0], *x.Omega[0]] for x in accelerated(motion).of_frames()])
    np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())
    return motion, mechanism, plain, (Q, V, multipliers)


def expected_reactions(mechanism, tree, state):
    """By joint: force and moment on its outer side, at its triad there."""
    Q, V, multipliers = state
    found, number = {}, 0
    for joint in (*tree.joints, *tree.loops):
        found[joint.name] = np.zeros(6)
        for _ in joint.rows():
            found[joint.name] += mechanism.reaction(number, 0.0, Q, V, multipliers[number])
            number += 1
    return found


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
@pytest.mark.parametrize("seed", range(5))
def test_joints_of_trees(seed, turned):
    rng = np.random.default_rng(seed)
    motion, mechanism, tree, state = random_case(rng, turned, rng.permutation(JOINTS)[:5], 0)
    check(motion, mechanism, tree, state, turned)


@pytest.mark.parametrize("seed", LOOPED[:4])
def test_joints_of_loops(seed):
    case = random_case(np.random.default_rng(seed), False, ["revolute"] * 3, 1)
    check(*case, turned=False)


def check(motion, mechanism, tree, state, turned):
    found = reactions(motion)
    for joint in (*tree.joints, *tree.loops):
        expected = expected_reactions(mechanism, tree, state)[joint.name]
        force, moment = expected[:3], expected[3:]
        if turned:  # on the other side, and about where that is
            a, b = (mechanism.marker(at, *state[:2]).r for at in (joint.a, joint.b))
            force, moment = -force, -(moment + np.cross(b - a, force))
        size = max(np.abs(expected).max(), 1.0)
        np.testing.assert_allclose(found[joint.name].force[0], force, atol=1e-9 * size)
        np.testing.assert_allclose(found[joint.name].moment[0], moment, atol=1e-9 * size)
