"""The recursion, as scenes in space make it, against the oracle in absolute coordinates: random trees, all joints."""

import numpy as np
import pytest
from spatial_scenes import as_scene, coordinates, tree_model
from spatial_trees import TYPES, placed, random_beam, random_tree

from ffrobot.common.errors import InputError
from ffrobot.mbs.model.spatial_system import SpatialSystem

SMALL = 0.01  # modal coordinates: sections turn by about 0.1 rad


def systems(tree):
    """Accelerations (n_v,) of the scene, and the oracle's p̈ by node, in the same state with random velocities."""
    plain, tables = as_scene(tree, False)
    model = tree_model(plain, tables)
    mechanism = plain.mechanism()
    system = SpatialSystem(model)
    q = model.tree.at_rest(coordinates(model, plain, False))
    bent = {body.name: mechanism.coordinates.parts(tree.q, body.name)[2] for body in tree.bodies}
    for node in model.tree.nodes:
        q[node.p_q] = bent[node.body.name]
    absolute = placed(plain, list(bent.values()))
    v = np.random.default_rng(0).standard_normal(model.tree.n_v)
    velocity = np.zeros(mechanism.size)
    for node, frame in zip(model.tree.nodes, model.tree.frames(q[None]), strict=True):
        twist = frame.L[0] @ v
        R_dot, omega, p_dot = mechanism.coordinates.rates(velocity, node.body.name)
        R_dot[:], omega[:], p_dot[:] = twist[:3], frame.F[0].T @ twist[3:], v[node.p_v]
    expected, _ = mechanism.solve(0.0, absolute, velocity)
    found, _ = system.core.evaluate(q, v, np.zeros(len(model.rows)), None, None)
    nodes = [(node, mechanism.coordinates.rates(expected, node.body.name)[2]) for node in model.tree.nodes]
    return found, nodes


@pytest.mark.parametrize("joint", TYPES)
def test_modes_accelerate_as_the_oracle_says(joint):
    kinds = ("rigid", "beam") if joint == "free" else ("rigid", "solid", "beam", "supported beam")
    rng, compared = np.random.default_rng(TYPES.index(joint)), 0
    for _ in range(6):
        found, nodes = systems(random_tree(rng, [joint] * 2, kinds, chain=True, size=SMALL))
        for node, expected in nodes:
            compared += len(expected)
            np.testing.assert_allclose(found[node.p_v], expected, rtol=0, atol=1e-11 * np.abs(found).max(initial=0))
    assert compared


def test_free_joint_at_a_section_that_modes_turn_is_refused():
    """Its coordinates would be those of the section, and the core takes those of the frame."""
    rng = np.random.default_rng(0)
    tree = random_tree(rng, ["free"], ("rigid",))
    tree.bodies = [random_beam(rng, "b1", (2, 0, 0, 0), "simply-supported")]
    tree.q = placed(tree, [np.zeros(2)])
    with pytest.raises(InputError, match=r"expected a point that modes do not move, found \"root\" of \"b1\""):
        systems(tree)
