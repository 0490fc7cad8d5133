"""The recursion in the plane = the oracle in absolute coordinates: accelerations and multipliers at random states."""

from dataclasses import replace

import numpy as np
import pytest
import zoo
from mechanisms import assemble, oracle_of, relative
from recursion_trees import tree_of

T = 0.37
# Friction, rotors and loads are not in these trees.
NAMES = [name for name in zoo.ALL if "as built" not in name and "loaded" not in name]


def compare(tree, seed=1, speed=1.0):
    """Largest relative differences of accelerations and of multipliers that both have."""
    rng = np.random.default_rng(seed)
    model, assembly = tree.model, tree.assembly
    q, v = tree.random_state(rng)
    v *= speed
    target = np.array([assembly.constraints[i].target(T)[2] for i in tree.rows])
    a, lambda_ = model.evaluate(q, v, target, None, None)
    Q, V, A = tree.from_tree(q, v, a)
    expected_a, expected_lambda = oracle_of(assembly).solve(T, Q, V)
    errors = [relative(A, expected_a)]
    if tree.rows:
        errors.append(relative(lambda_, expected_lambda[tree.rows]))
    return errors


@pytest.mark.parametrize("free", [False, True], ids=["tree", "rows"])
@pytest.mark.parametrize("name", NAMES)
def test_accelerations_and_multipliers(name, free):
    assembly = assemble(zoo.build(name, **({"load": []} if "stiffened" in name else {})))
    assert max(compare(tree_of(assembly, free=free))) < 1e-12


@pytest.mark.parametrize("seed", range(10))
def test_many_states_of_a_mixed_tree(seed):
    """Prismatic, welded and revolute joints between bodies of random modes, fast."""
    assembly = assemble(zoo.mixed(np.random.default_rng(seed)))
    assert max(compare(tree_of(assembly), seed, speed=5.0)) < 1e-12


def test_rows_have_the_values_and_rates_of_the_oracle():
    assembly = assemble(zoo.build("mixed"))
    tree = tree_of(assembly, free=True)
    q, v = tree.random_state(np.random.default_rng(3))
    tree.model.evaluate(q, v, np.zeros(len(tree.rows)), None, None)
    Q, V, _ = tree.from_tree(q, v)
    C, C_dot, _ = oracle_of(assembly).constraint_values(T, Q, V)
    targets = np.array([assembly.constraints[i].target(T) for i in tree.rows])
    offsets = np.array([assembly.constraints[i].measure.offset for i in tree.rows])
    value, rate = tree.model.measure(q, v)
    assert np.abs(value - offsets - targets[:, 0] - C[tree.rows]).max() < 1e-13
    assert np.abs(rate - targets[:, 1] - C_dot[tree.rows]).max() < 1e-13


@pytest.mark.parametrize("name", NAMES)
def test_energies(name):
    tree = tree_of(assemble(zoo.build(name)))
    rng = np.random.default_rng(4)
    q, v = 0.1 * rng.standard_normal(tree.model.n_q), rng.standard_normal(tree.model.n_v)
    found = tree.model.totals(q, v)
    Q, V, _ = tree.from_tree(q, v)
    expected = oracle_of(tree.assembly).energies(Q, V)
    np.testing.assert_allclose([found.kinetic, found.strain], expected[:2], rtol=1e-12)
    np.testing.assert_allclose(found.gravitational, expected[2], rtol=1e-11, atol=1e-11 * found.kinetic)


@pytest.mark.parametrize("name", ["chain of 3", "mixed", "tree"])
def test_stiffening_that_vanishes_changes_nothing(name):
    """K of zeros takes the path of stiffened bodies: the numbers are those of the other one."""
    bare, rng = zoo.build(name), np.random.default_rng(6)
    stiffened = [replace(body, stiffening=zoo.random_stiffening(rng, body, size=0.0)) for body in bare.bodies]
    trees = [tree_of(assemble(model)) for model in (bare, replace(bare, bodies=tuple(stiffened)))]
    q, v = 0.1 * rng.standard_normal(trees[0].model.n_q) + 0.5, rng.standard_normal(trees[0].model.n_v)
    expected, found = (tree.model.evaluate(q, v, np.zeros(len(tree.rows)), None, None) for tree in trees)
    assert relative(found[0], expected[0]) < 1e-12
    if trees[0].rows:
        assert relative(found[1], expected[1]) < 1e-12


def differences(function, n, h):
    """∂function/∂x (…, n) at x = 0 by differences of fourth order."""
    steps = h * np.eye(n)
    columns = [function(-2 * x) - 8 * function(-x) + 8 * function(x) - function(2 * x) for x in steps]
    return np.stack(columns, axis=-1) / (12 * h)


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_are_those_of_evaluations(name):
    check_derivatives(tree_of(assemble(zoo.build(name))))


def test_derivatives_with_rows_in_several_blocks():
    tree = tree_of(assemble(zoo.chain(np.random.default_rng(0), 8)), free=True)
    assert len(tree.rows) == 18
    check_derivatives(tree)


def check_derivatives(tree):
    model, rng = tree.model, np.random.default_rng(5)
    q, v = tree.random_state(rng)
    target, force = rng.standard_normal(len(tree.rows)), rng.standard_normal(model.n_v)
    found = model.derivatives(q, v, target, force, None)

    def a(dq=0.0, dv=0.0, df=0.0):
        return model.evaluate(q + dq, v + dv, target, force + df, None)[0]

    # By v accelerations are quadratic, by forces linear: with long steps differences are exact but for rounding.
    for key, by, h in (("a_q", "dq", 1e-3), ("a_v", "dv", 1.0), ("a_f", "df", 1.0)):
        expected = differences(lambda x, by=by: a(**{by: x}), model.n_v, h)
        atol = (1e-8 if by == "dq" else 1e-11) * max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(getattr(found, key), expected, rtol=0, atol=atol, err_msg=key)
    if tree.rows:
        for derivative, which in ((found.value_q, 0), (found.rate_q, 1)):
            expected = differences(lambda x, which=which: model.measure(q + x, v)[which], model.n_v, 1e-3)
            np.testing.assert_allclose(derivative, expected, rtol=0, atol=1e-9 * max(1.0, np.abs(expected).max()))
