"""Rounding of the recursion against 40 digits, chains of links in the plane."""

import numpy as np
import pytest
from exact_chain import chain, eigenmode_link, errors

STATES = 2


# λ, then q̈: four times the worst of 20 states (docs/developer/kernel.md)
@pytest.mark.parametrize(
    ("count", "condition", "modes", "of_lambda", "of_q"),
    [
        (2, "simply-supported", 10, 2e-14, 4e-14),
        (2, "cantilever", 10, 4e-14, 1e-14),
        (2, "cantilever", 20, 8e-14, 4e-14),
        (6, "cantilever", 5, 2e-14, 1e-14),
    ],
)
def test_errors_are_rounding(count, condition, modes, of_lambda, of_q):
    """Long links in many cantilever modes have hardly any inertia left to turn by: what is left must not be lost."""
    found = [errors(count, condition, modes, seed) for seed in range(STATES)]
    assert max(of for of, _ in found) < of_lambda
    assert max(of for _, of in found) < of_q


@pytest.mark.parametrize("modes", [3, 20])
def test_a_load_on_a_joint_with_a_path_moves_nothing(modes):
    """Its multiplier bears that, also beside next to no inertia: 1e5 N m leave 1e-9 of modal accelerations else."""
    links, load = [eigenmode_link(f"b{k}", "cantilever", modes) for k in range(2)], np.zeros(2 * (1 + modes))
    model, rng = chain(links, coordinates=(0, 1 + modes)), np.random.default_rng(5)
    number = np.tile(np.append(1, np.arange(1, modes + 1)), 2)
    q, v, load[0] = rng.standard_normal(model.n_q) / number**4, rng.standard_normal(model.n_v) / number, 1e5
    alone, borne = (model.evaluate(q, v, np.array([0.6, -0.4]), force, None) for force in (None, load))
    assert np.abs(borne[0] - alone[0]).max() <= 1e-13 * np.abs(alone[0]).max()
    assert borne[1] - alone[1] == pytest.approx([1e5, 0], abs=1e-9)
