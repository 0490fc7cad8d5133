"""Long runs: what drifts of energy, momentum and constraints, undamped and without any of them being imposed."""

import pytest
from links import arm_links
from mechanisms import make_model, revolute
from robots import energy_drift, free_run, momentum_drift, pendulum

from ffrobot.mbs.quantities.motion import constraint_violation


def free_chain():
    """Two links that nothing holds, turning and folding."""
    return make_model(
        arm_links(),
        gravity=(0.0, 0.0),
        joint=[revolute("A", "link1.tip", "link2.root")],
        initial={"angles": {"link1": 0.3, "link2": 1.0}, "rates": {"link1": 3.0, "link2": -1.0}},
    )


LENGTHS = [20.0, pytest.param(1000.0, marks=pytest.mark.long)]


@pytest.mark.parametrize("end", LENGTHS)
def test_energy_of_a_pendulum(end):
    outcome = free_run(pendulum(), end=end, output_step=end / 1000, tolerance=1e-6)
    outcome.check_completed()
    assert energy_drift(outcome) < (1e-11 if end < 100 else 1e-9)  # rounding, added up
    assert constraint_violation(outcome.motion).max() < 1e-11


@pytest.mark.parametrize("end", LENGTHS)
def test_momentum_of_a_free_chain(end):
    outcome = free_run(free_chain(), end=end, output_step=end / 1000, tolerance=1e-6)
    outcome.check_completed()
    assert momentum_drift(outcome) < (1e-11 if end < 100 else 1e-7)
    assert energy_drift(outcome) < (1e-8 if end < 100 else 1e-6)  # builds that round otherwise differ by a factor of 3
