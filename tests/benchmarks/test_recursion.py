"""Times per evaluation of the recursion in joint coordinates against the core in absolute ones, interleaved."""

import numpy as np
import pytest
from links import ANGLES, arm, arm_links
from mechanisms import assemble
from recursion_trees import tree_of

from ffrobot.bench.evaluation import evaluation_seconds, tree_evaluation_seconds

T, REPETITIONS, ROUNDS = 0.3, 2000, 20


def ratio(state):
    """Of the minima of both."""
    ways = tree_evaluation_seconds, evaluation_seconds
    times = [[seconds(state, T, REPETITIONS) for seconds in ways] for _ in range(ROUNDS)]
    new, old = np.min(times, axis=0)
    return new / old


@pytest.mark.parametrize("modes", [2, 10, 20])
def test_two_links_on_a_path(modes):
    """Measured 0.67, 0.65, 0.57 on a loaded machine; the prototype that this is made after, 0.5."""
    assembly = assemble(arm(arm_links(modes=modes)))
    tree = tree_of(assembly)
    q, v = np.zeros(tree.model.n_q), np.zeros(tree.model.n_v)
    first = [joint for joint, *_ in tree.model.first]
    q[first] = [ANGLES["link1"], ANGLES["link2"] - ANGLES["link1"]]
    Q, V, _ = tree.from_tree(q, v)
    assert ratio((assembly, Q, V)) < 0.95
