"""Random trees in 3D that move: one instant of their motion by the recursion."""

import numpy as np
from checkpoint_scenes import as_scene, coordinates, tree_model
from random_mechanisms import random_tree
from tree_oracle import row_values

from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.quantities.motion import RobotMotion

SMALL = 0.01  # modal coordinates: sections turn by about 0.1 rad
NOW = np.zeros(1)


def moving(rng, types, kinds, loops=0):
    """A random tree at random velocities, and what the recursion makes of it: motion of one instant, and its core."""
    tree = random_tree(rng, types, kinds, chain=True, size=SMALL, loops=loops)
    plain, tables = as_scene(tree, False)
    model, mechanism = tree_model(plain, tables), plain.mechanism()
    system = MultibodySystem(model)
    q = model.tree.at_rest(coordinates(model, plain, False))
    for node in model.tree.nodes:
        q[node.p_q] = mechanism.coordinates.parts(tree.q, node.body.name)[2]
    v = rng.standard_normal(model.tree.n_v)
    C_v = row_values(model, q[None], NOW)[1][0]
    v -= np.linalg.pinv(C_v, rcond=1e-10) @ (C_v @ v)
    if len(model.rows):
        system.core.keep_independent_rows(q, v)
    a, multipliers = system.core.evaluate(q, v, np.zeros(len(model.rows)), None, None)
    return RobotMotion(model, NOW, q[None], v[None], a[None], multipliers[None]), system
