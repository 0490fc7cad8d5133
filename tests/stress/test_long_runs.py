"""Long runs: what drifts of energy, momentum and constraints, undamped and without any of them being imposed."""

import pytest
from links import arm, arm_links
from mechanisms import make_model, revolute
from robots import energy_drift, free_run, inverse, momentum_drift, pendulum
from table import at_most

GROUP = "Long runs"
CIRCLE = {"name": "tip", "point": "link2.tip", "x": "1.2+0.2*cos(t)", "y": "0.9+0.2*sin(t)"}


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
def test_energy_of_a_pendulum(end, record):
    outcome = free_run(pendulum(), end=end, output_step=end / 1000, tolerance=1e-6)
    outcome.check_completed()
    energy, constraints = energy_drift(outcome), outcome.motion.violation.max()
    assert energy < 1e-6
    record(
        GROUP,
        f"two flexible links fall and swing for {end:g} s at a tolerance of 1e-6",
        "energy at most {energy} of its kinetic part, constraints at most {constraints}",
        energy=at_most(1e-11 if end < 100 else 1e-9, energy),  # rounding, added up
        constraints=at_most(1e-11, constraints),
    )


@pytest.mark.parametrize("end", LENGTHS)
def test_momentum_of_a_free_chain(end, record):
    outcome = free_run(free_chain(), end=end, output_step=end / 1000, tolerance=1e-6)
    outcome.check_completed()
    momentum, energy = momentum_drift(outcome), energy_drift(outcome)
    assert momentum < 1e-6
    assert energy < 1e-6
    record(
        GROUP,
        f"two flexible links fly freely for {end:g} s at a tolerance of 1e-6",
        "momentum at most {momentum}, energy at most {energy} of its kinetic part",
        momentum=at_most(1e-11 if end < 100 else 1e-7, momentum),
        energy=at_most(1e-8 if end < 100 else 1e-6, energy),  # builds that round otherwise differ by a factor of 3
    )


@pytest.mark.parametrize("end", [20.0, pytest.param(300.0, marks=pytest.mark.long)])
def test_path_is_kept(end, record):
    outcome = inverse(arm(trajectory=[CIRCLE]), end=end, output_step=end / 1000, tolerance=1e-4)
    outcome.check_completed()
    constraints = outcome.motion.violation.max()
    record(
        GROUP,
        f"PCID round a circle for {end:g} s at a tolerance of 1e-4",
        "constraints at most {constraints}",
        constraints=at_most(1e-11, constraints),
    )
