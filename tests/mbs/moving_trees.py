"""Random trees in 3D that move: one instant of their motion by the recursion."""

import numpy as np
from checkpoint_scenes import as_scene, coordinates, tree_model
from random_mechanisms import random_tree
from tree_oracle import row_values

from ffrobot.mbs.analysis.operating_points import Static
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.run.record import Run

SMALL = 0.01  # modal coordinates: sections turn by about 0.1 rad
NOW = np.zeros(1)


def state_of(model, time, q, v, a, multipliers=None):
    """A run that was at these states."""
    multipliers = np.zeros((len(time), len(model.rows))) if multipliers is None else multipliers
    analysis = Static(name="state", kind="static")
    return Run(analysis=analysis, model=model, time=time, q=q, v=v, a=a, multipliers=multipliers)


def moving(rng, types, kinds, loops=0):
    """A random tree at random velocities, and what the recursion makes of it: motion of one instant, and its core."""
    tree = random_tree(rng, types, kinds, chain=True, size=SMALL, loops=loops)
    plain, tables = as_scene(tree, False)
    model = tree_model(plain, tables)
    system = MultibodySystem(model)
    q = model.tree.at_rest(coordinates(model, plain, False))
    for node in model.tree.nodes:
        q[node.p_q] = tree.p[node.body.name]
    v = rng.standard_normal(model.tree.n_v)
    C_v = row_values(model, q[None], NOW)[1][0]
    v -= np.linalg.pinv(C_v, rcond=1e-10) @ (C_v @ v)
    if len(model.rows):
        system.core.keep_independent_rows(q, v)
    a, multipliers = system.core.evaluate(q, v, np.zeros(len(model.rows)), None, None)
    return state_of(model, NOW, q[None], v[None], a[None], multipliers[None]), system


def differences(function, n, h=1e-4):
    """∂function/∂x (…, n) at x = 0 by differences of fourth order."""
    columns = []
    for k in range(n):
        dx = np.zeros(n)
        dx[k] = h
        values = [function(s * dx) for s in (-2, -1, 1, 2)]
        columns.append((values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h))
    return np.stack(columns, axis=-1)
