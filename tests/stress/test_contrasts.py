"""Many modes, and links that differ much in stiffness, mass and proportions."""

import numpy as np
import pytest
from links import ANGLES, arm, ritz_link
from mechanisms import relative
from oracle_runs import point_motion
from robots import inverse

STATIC = {"angles": ANGLES, "state": "static"}


def forces(links, **keys):
    outcome = inverse(arm(links, initial=STATIC), **({"end": 0.2, "tolerance": 1e-4} | keys))
    outcome.check_completed()
    assert outcome.motion.violation.max() < 1e-11
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


@pytest.mark.parametrize("height", [0.01, 0.1, 1.0])
def test_proportions(beams, height):
    """Euler–Bernoulli whatever the proportions: the solver does not know better."""
    outcome = inverse(arm(beams(height=height), initial=STATIC), tolerance=1e-4, end=0.05)
    outcome.check_completed()
    # Joint and path hold both ends of link 2, and no moment: off the tangent at the root, the tip is at the end slope
    # times L of a pinned beam under its own weight, w L⁴/24EI with w = ρ A g cos θ and I/A = h²/12. The
    # six modes, which have a moment at the root, make it 2 % more.
    sag = 7850.0 * 9.81 * np.cos(ANGLES["link2"]) * 12 / (24 * 2.068427e11 * height**2)
    at_start = np.linalg.norm(point_motion(outcome, "link2.tip").deflection[0])
    assert at_start == pytest.approx(sag, rel=0.03)


def test_too_thin(beams):
    """A millimetre of steel a metre long bends under its own weight by more than small deformations allow."""
    outcome = inverse(arm(beams(height=1e-3), initial=STATIC), end=1.0, tolerance=1e-4)
    assert outcome.status == "diverged"
    assert '"link2" is bent by' in outcome.statistics.cause
    assert len(outcome.q) == len(outcome.time) > 10  # what there is up to then
