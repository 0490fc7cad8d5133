"""Rounding of the recursion against 40 digits, chains of links in the plane."""

import pytest
from exact_chain import errors

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
