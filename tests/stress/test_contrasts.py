"""Many modes, and links that differ much in stiffness, mass and proportions."""

import pytest
from links import ANGLES, arm, ritz_link
from mechanisms import relative
from robots import inverse

from ffrobot.mbs.quantities.motion import constraint_violation

STATIC = {"angles": ANGLES, "state": "static"}


def forces(links, **keys):
    outcome = inverse(arm(links, initial=STATIC), **({"end": 0.2, "tolerance": 1e-4} | keys))
    outcome.check_completed()
    assert constraint_violation(outcome.motion).max() < 1e-11
    return outcome.lambda_


def test_modes(beams):
    """Two integrators that share neither formulas nor step sizes agree on forces."""
    one, other = (forces(beams(modes=5), integrator=name) for name in ("dop853", "radau"))
    assert relative(one, other) < 2e-5
    many = forces(beams(modes=40))
    assert relative(one, many) < 1e-3  # of a static start: modes 6 … 40 are hardly stirred


@pytest.mark.long
def test_200_modes(beams):
    """Up to 8.8e6 rad/s, and 1.3e-9 of the inertia is left after the modes."""
    difference = relative(forces(beams(modes=100)), forces(beams(modes=200)))
    assert difference < 1e-4


@pytest.mark.parametrize(
    "contrast", [1e2, pytest.param(1e4, marks=pytest.mark.long), pytest.param(1e6, marks=pytest.mark.long)]
)
def test_stiffness(contrast):
    links = [ritz_link("link1", "simply-supported", EI=120 * contrast), ritz_link("link2", "cantilever")]
    one, other = (forces(links, integrator=name, end=0.1, tolerance=1e-5) for name in ("dop853", "radau"))
    assert relative(one, other) < 1e-5


@pytest.mark.parametrize("contrast", [1e2, pytest.param(1e4, marks=pytest.mark.long)])
def test_mass(contrast):
    """A heavy link at the end of a light one, as stiff as it has to be to carry it."""
    links = [
        ritz_link("link1", "simply-supported", EI=120 * contrast),
        ritz_link("link2", "cantilever", EI=30 * contrast, mass=contrast),
    ]
    one, other = (forces(links, integrator=name, end=0.1, tolerance=1e-5) for name in ("dop853", "radau"))
    assert relative(one, other) < 1e-5


def test_too_thin(beams):
    """A millimetre of steel a metre long bends under its own weight by more than small deformations allow."""
    outcome = inverse(arm(beams(height=1e-3), initial=STATIC), end=1.0, tolerance=1e-4)
    assert outcome.status == "diverged"
    assert '"link2" is bent by' in outcome.statistics.cause
    assert len(outcome.q) == len(outcome.time) > 10  # what there is up to then
