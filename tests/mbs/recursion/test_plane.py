"""The recursion in the plane = the core in absolute coordinates: accelerations and multipliers at random states."""

import numpy as np
import pytest
import zoo
from mechanisms import assemble, relative
from recursion_trees import tree_of

T = 0.37
# Stiffening is not in the recursion yet; rotors on prismatic joints are not, either.
NAMES = [name for name in zoo.ALL if "stiffened" not in name and "as built" not in name and "loaded" not in name]


def compare(tree, seed=1, speed=1.0):
    """Largest relative differences of accelerations and of multipliers that both have."""
    rng = np.random.default_rng(seed)
    model, assembly = tree.model, tree.assembly
    q, v = 0.1 * rng.standard_normal(model.n_q) + 0.5, speed * rng.standard_normal(model.n_v)
    target = np.array([assembly.constraints[i].target(T)[2] for i in tree.rows])
    a, lambda_ = model.evaluate(q, v, target, None, None)
    Q, V, A = tree.from_tree(q, v, a)
    expected_a, expected_lambda = assembly.system.evaluate(T, Q, V)
    errors = [relative(A, expected_a)]
    if tree.rows:
        errors.append(relative(lambda_, expected_lambda[tree.rows]))
    return errors


@pytest.mark.parametrize("free", [False, True], ids=["tree", "rows"])
@pytest.mark.parametrize("name", NAMES)
def test_accelerations_and_multipliers(name, free):
    assembly = assemble(zoo.build(name))
    if free and len(assembly.constraints) > 31:
        pytest.skip("more rows than the recursion takes")
    assert max(compare(tree_of(assembly, free=free))) < 1e-12


@pytest.mark.parametrize("seed", range(10))
def test_many_states_of_a_mixed_tree(seed):
    """Prismatic, welded and revolute joints between bodies of random modes, fast."""
    assembly = assemble(zoo.mixed(np.random.default_rng(seed)))
    assert max(compare(tree_of(assembly), seed, speed=5.0)) < 1e-12


def test_rows_have_the_values_and_rates_of_the_core():
    assembly = assemble(zoo.build("mixed"))
    tree = tree_of(assembly, free=True)
    rng = np.random.default_rng(3)
    q, v = rng.standard_normal(tree.model.n_q), rng.standard_normal(tree.model.n_v)
    tree.model.evaluate(q, v, np.zeros(len(tree.rows)), None, None)
    Q, V, _ = tree.from_tree(q, v)
    C, C_dot, _ = assembly.system.constraints(T, Q, V)
    targets = np.array([assembly.constraints[i].target(T) for i in tree.rows])
    offsets = np.array([assembly.constraints[i].measure.offset for i in tree.rows])
    value, rate = tree.model.measure(q, v)
    assert np.abs(value - offsets - targets[:, 0] - C[tree.rows]).max() < 1e-13
    assert np.abs(rate - targets[:, 1] - C_dot[tree.rows]).max() < 1e-13
