"""Geometric stiffening beyond its second-order terms: pᵀK_ω p outgrows the inertia that the modes leave."""

import numpy as np
import pytest
from links import ritz_link
from mechanisms import make_model, revolute
from robots import free_run

from ffrobot.common.errors import SolveError

GROUP = "Geometric stiffening"


def blade(modes, force, state="undeformed"):
    """Wu and Haug's beam (Int. J. Numer. Meth. Eng. 26, 1988) turning freely at 1 rad/s, pushed at its tip."""
    beam = ritz_link("beam", "cantilever", 8.0, 8 * 0.2019, 566.6, modes=modes, stiffening=True)
    joint = {"name": "hub", "type": "weld", "between": ("ground", "beam.root")}
    hub = revolute("hub", "ground", "beam.root") if state == "undeformed" else joint
    load = [{"point": "beam.tip", "y": str(force)}]
    rates = {"beam": 1.0} if state == "undeformed" else {}
    return make_model([beam], gravity=(0.0, 0.0), joint=[hub], load=load, initial={"rates": rates, "state": state})


@pytest.mark.parametrize("modes", [2, 3, 6])
def test_run_says_that_inertia_is_gone(modes, record):
    force = {2: 20, 3: 7, 6: 2}[modes]
    outcome = free_run(blade(modes, force), end=10.0, tolerance=1e-5)
    assert outcome.status in ("step underflow", "diverged")
    assert 'geometric stiffening has taken away all inertia that the modes of "beam" leave' in outcome.statistics.cause
    assert len(outcome.q) == len(outcome.time) > 3
    last = outcome.q[-1, 3:]
    bend = np.abs(last @ outcome.assembly.model.bodies[0].points["tip"].translation[1]) / 8.0
    record(
        GROUP,
        f"a cantilever of {modes} modes that turns freely, its tip pushed with {force} N",
        "ends at t = {t}, the tip bent by {bend} of the length",
        "step underflow or diverged; “geometric stiffening has taken away all inertia that the modes … leave …”",
        t=outcome.statistics.time_reached,
        bend=bend,
    )


def test_a_prescribed_turn_does_not_need_it(record):
    """Only motions that the constraints allow need inertia: welded, the same beam bends as far as it likes."""
    outcome = free_run(blade(6, 10, "static"), end=1.0, tolerance=1e-5)
    outcome.check_completed()
    record(GROUP, "the same, its root held", "passes: no motion that is left lacks inertia")


def test_start_without_inertia(record):
    """Hanging, its tip pulled aside: in equilibrium, but no motion starts from there."""
    beam = ritz_link("beam", "cantilever", 8.0, 8 * 0.2019, 566.6, modes=6, stiffening=True)
    model = make_model(
        [beam],
        gravity=(9.81, 0.0),
        joint=[revolute("hub", "ground", "beam.root")],
        load=[{"point": "beam.tip", "y": "16"}],
        initial={"state": "static", "angles": {"beam": 1.1}},
    )
    with pytest.raises(SolveError, match="at the start geometric stiffening has taken away"):
        free_run(model)
    record(GROUP, "a cantilever of 6 modes hangs, its tip pulled aside", "refused", "solve error: “at the start …”")
