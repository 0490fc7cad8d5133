"""Many modes, and links in other proportions."""

from beam_links import modal_body, paper_link, rectangle
from links import ANGLES, arm
from mechanisms import relative
from robots import inverse

from ffrobot.mbs.model.body import from_modal_body
from ffrobot.mbs.quantities.motion import constraint_violation


def beams(modes=6, height=0.015):
    """The two links of the paper's arm, without geometric stiffening."""
    geometry = {"kind": "beam", "length": 1.0, "section": rectangle(height, 0.025)}
    mesh = {"elements": max(20, 2 * modes)}
    return [
        from_modal_body(name, modal_body(paper_link(condition, modes, mesh=mesh, geometry=geometry)), is_planar=True)
        for name, condition in (("link1", "simply-supported"), ("link2", "cantilever"))
    ]


STATIC = {"angles": ANGLES, "state": "static"}


def forces(links, **keys):
    outcome = inverse(arm(links, initial=STATIC), **({"end": 0.2, "tolerance": 1e-4} | keys))
    outcome.check_completed()
    assert constraint_violation(outcome.motion).max() < 1e-11
    return outcome.lambda_


def test_modes():
    """Two integrators that share neither formulas nor step sizes agree on forces."""
    one, other = (forces(beams(modes=5), integrator=name) for name in ("dop853", "radau"))
    assert relative(one, other) < 2e-5
    many = forces(beams(modes=40))
    assert relative(one, many) < 1e-3  # of a static start: modes 6 … 40 are hardly stirred


def test_too_thin():
    """A millimetre of steel a metre long bends under its own weight by more than small deformations allow."""
    outcome = inverse(arm(beams(height=1e-3), initial=STATIC), end=1.0, tolerance=1e-4)
    assert outcome.status == "diverged"
    assert '"link2" is bent by' in outcome.statistics.cause
    assert len(outcome.q) == len(outcome.time) > 10  # what there is up to then
