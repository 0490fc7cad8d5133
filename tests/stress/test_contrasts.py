"""Many modes, and links that differ much in stiffness, mass and proportions."""

import numpy as np
import pytest
from links import ANGLES, arm, ritz_link
from mechanisms import relative
from oracle_runs import point_motion
from robots import inverse
from table import at_most

STATIC = {"angles": ANGLES, "state": "static"}
GROUP = "Modes and contrasts"


def forces(links, **keys):
    outcome = inverse(arm(links, initial=STATIC), **({"end": 0.2, "tolerance": 1e-4} | keys))
    outcome.check_completed()
    assert outcome.motion.violation.max() < 1e-11
    return outcome.lambda_


def test_modes(beams, record):
    """Two integrators that share neither formulas nor step sizes agree on forces."""
    one, other = (forces(beams(modes=5), integrator=name) for name in ("dop853", "radau"))
    assert relative(one, other) < 1e-4
    many = forces(beams(modes=40))
    truncation = relative(one, many)
    assert truncation < 1e-3  # of a static start: modes 6 … 40 are hardly stirred
    # DOP853 is at its limit of stability here: where its steps fall, and what they err by, hangs on rounding.
    record(
        GROUP,
        "5 and 40 modes per link, static start",
        "forces of 5 modes: integrators differ by at most {integrators}, from 40 modes by {truncation}",
        integrators=at_most(2e-5, relative(one, other)),
        truncation=truncation,
    )


@pytest.mark.long
def test_200_modes(beams, record):
    """Up to 8.8e6 rad/s, and 1.3e-9 of the inertia is left after the modes."""
    difference = relative(forces(beams(modes=100)), forces(beams(modes=200)))
    assert difference < 1e-4
    record(GROUP, "100 and 200 modes per link, static start", "forces differ by {by}", by=difference)


@pytest.mark.parametrize(
    "contrast", [1e2, pytest.param(1e4, marks=pytest.mark.long), pytest.param(1e6, marks=pytest.mark.long)]
)
def test_stiffness(contrast, record):
    links = [ritz_link("link1", "simply-supported", EI=120 * contrast), ritz_link("link2", "cantilever")]
    one, other = (forces(links, integrator=name, end=0.1, tolerance=1e-5) for name in ("dop853", "radau"))
    assert relative(one, other) < 1e-5
    record(
        GROUP,
        f"stiffness of the links 1 : {contrast:g}",
        "forces of DOP853 and Radau IIA differ by {by} at a tolerance of 1e-5",
        by=relative(one, other),
    )


@pytest.mark.parametrize("contrast", [1e2, pytest.param(1e4, marks=pytest.mark.long)])
def test_mass(contrast, record):
    """A heavy link at the end of a light one, as stiff as it has to be to carry it."""
    links = [
        ritz_link("link1", "simply-supported", EI=120 * contrast),
        ritz_link("link2", "cantilever", EI=30 * contrast, mass=contrast),
    ]
    one, other = (forces(links, integrator=name, end=0.1, tolerance=1e-5) for name in ("dop853", "radau"))
    assert relative(one, other) < 1e-5
    record(
        GROUP,
        f"masses of the links 1 : {contrast:g}",
        "forces of DOP853 and Radau IIA differ by {by} at a tolerance of 1e-5",
        by=relative(one, other),
    )


@pytest.mark.parametrize("height", [0.01, 0.1, 1.0])
def test_proportions(beams, height, record):
    """Euler–Bernoulli whatever the proportions: the solver does not know better."""
    keys = {"tolerance": 1e-4, "end": 0.05}
    links = beams(height=height)
    outcome = inverse(arm(links, initial=STATIC), **keys)
    outcome.check_completed()
    deflection = np.abs(point_motion(outcome, "link2.tip").deflection).max()
    # Joint and path hold both ends of link 2, and no moment: off the tangent at the root, the tip is at the end slope
    # times L of a pinned beam under its own weight, w L⁴/24EI with w = ρ A g cos θ and I/A = h²/12. The
    # six modes, which have a moment at the root, make it 2 % more.
    sag = 7850.0 * 9.81 * np.cos(ANGLES["link2"]) * 12 / (24 * 2.068427e11 * height**2)
    at_start = np.linalg.norm(point_motion(outcome, "link2.tip").deflection[0])
    assert at_start == pytest.approx(sag, rel=0.03)
    record(GROUP, f"links 1 m long and {height:g} m high", "tip deflection {deflection} m", deflection=deflection)


def test_too_thin(beams, record):
    """A millimetre of steel a metre long bends under its own weight by more than small deformations allow."""
    outcome = inverse(arm(beams(height=1e-3), initial=STATIC), end=1.0, tolerance=1e-4)
    assert outcome.status == "diverged"
    assert '"link2" is bent by' in outcome.statistics.cause
    assert len(outcome.q) == len(outcome.time) > 10  # what there is up to then
    record(
        GROUP,
        "links 1 m long and 0.001 m high",
        "ends at t = {t}",
        'diverged; “"link2" is bent by 103 % of its length …”',
        t=outcome.statistics.time_reached,
    )
