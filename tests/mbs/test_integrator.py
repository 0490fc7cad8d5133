"""The integrators on constrained motion: their orders, dense output, and what the tolerance promises."""

from functools import cache

import numpy as np
import pytest
from equal_steps import states_of_equal_steps
from links import ANGLES, TIP, arm, arm_links
from mechanisms import pcid, relative
from oracle_runs import run

from ffrobot.common.errors import SolveError
from ffrobot.mbs.linear.statics import static_equilibrium
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.mbs.quantities.motion import constraint_violation
from ffrobot.mbs.scene.analysis import TIGHTEST_TOLERANCE

REPORTED = ("q", "v", "lambda_", "tau", "F_p")


def inverse(model, **keys):
    outcome = run(model, pcid(**keys))
    assert outcome.status == "completed"
    return outcome


TOLERANCES = {
    "dop853": (1e-4, 1e-6, 1e-8),
    "dopri5": (1e-3, 1e-5),
    "radau": (1e-2, 1e-5),
    "generalized-alpha": (1e-2, 3e-3),
}


@pytest.mark.parametrize("spectral_radius", [1.0, 0.8, 0.5])
def test_generalized_alpha_damps_what_steps_do_not_resolve_as_asked(spectral_radius):
    """A mode far above 1/h keeps ρ of its amplitude a step (Chung and Hulbert 1993).

    Three roots meet there, so that step n has up to n² ρⁿ left: (45/35)^0.2 = 1.05 more in the mean over ten steps.
    """
    path = {"name": "tip", "point": "link2.tip", "x": f"{TIP[0]!r}", "y": f"{TIP[1]!r}"}
    model = arm(arm_links(EI=3e7, modes=1), trajectory=[path]).model
    start = undeformed_posture(model)
    core, scene, _ = MultibodySystem(model).integrated
    states = states_of_equal_steps(
        core, scene, "generalized_alpha", start.q, start.v, np.linspace(0.0, 0.5, 101), spectral_radius
    )
    mode = model.tree.nodes[model.tree.index["link1"]].p_q.start
    ringing = np.abs(states[:, mode] - static_equilibrium(model, start).q[mode])
    late, early = ringing[40:50].max(), ringing[30:40].max()
    assert 0.99 * spectral_radius < (late / early) ** 0.1 < 1.08 * spectral_radius


@cache
def of_arm(tolerance, integrator):
    return inverse(arm(), tolerance=tolerance, integrator=integrator)


@pytest.mark.parametrize(
    ("integrator", "tolerance"), [(name, tol) for name, all_ in TOLERANCES.items() for tol in all_]
)
def test_errors_of_all_reported_quantities_are_within_the_tolerance(integrator, tolerance):
    """Relative to each quantity's peak; measured for λ: DOP853 0.05 … 0.08 of the tolerance, Radau 0.2 … 0.6."""
    outcome, tight = of_arm(tolerance, integrator), of_arm(TIGHTEST_TOLERANCE, "dop853")
    ratios = {name: relative(getattr(outcome, name), getattr(tight, name)) / tolerance for name in REPORTED}
    assert max(ratios.values()) <= 1.0, ratios
    assert ratios["lambda_"] > 0.003, "far more work than the tolerance requires"


@pytest.mark.parametrize("integrator", ["radau", "generalized-alpha"])
def test_stiff_links_at_rest_do_not_hold_implicit_steps(integrator):
    """Twelve modes a link, up to 34 krad/s, none of which is felt at a percent.

    A method of order 2 takes more steps for the rest; each of them is 1.5 radians of the highest mode.
    """
    model = arm(arm_links(modes=12, extra=2), initial={"angles": ANGLES, "state": "static"})
    outcome = inverse(model, tolerance=1e-2, integrator=integrator)
    assert outcome.statistics.steps < (25_000 if integrator == "generalized-alpha" else 600)


def test_radau_damps_away_what_rings_below_the_tolerance():
    """A path whose jerk jumps at the start: vibrations up to 85 krad/s, those above 2 krad/s below the tolerance.

    2 418 steps; resolved at their frequency they would be 250 000.
    """
    model = arm(arm_links(EI=300.0, modes=12, extra=2), initial={"angles": ANGLES, "state": "static"})
    exact = inverse(model, tolerance=1e-6, integrator="dop853")
    outcome = inverse(model, tolerance=1e-4, integrator="radau")
    assert outcome.statistics.steps < 2800
    assert relative(outcome.lambda_, exact.lambda_) < 1e-4


@pytest.mark.parametrize("integrator", TOLERANCES)
def test_constraints_hold_at_every_output(integrator):
    """Position, velocity and acceleration level, relative to 1 + coordinates, rates, accelerations; however coarse."""
    outcome = inverse(arm(), output_step=0.001, tolerance=TOLERANCES[integrator][0], integrator=integrator)
    assert constraint_violation(outcome.motion).max() < 1e-11


def test_a_run_ends_at_max_steps_and_says_so():
    outcome = run(arm(), pcid(max_steps=100))
    assert outcome.status == "too many steps"
    assert outcome.statistics.steps + outcome.statistics.rejected == 100
    assert 0 < outcome.time[-1] < 1


def test_generalized_alpha_says_that_a_tolerance_is_beyond_it():
    """Fast from the start, forces small at first: steps of order 2 would have to be shorter than rounding lets them."""
    path = {"name": "tip", "point": "link2.tip", "x": f"{TIP[0]!r}-0.12*sin(100*t)", "y": f"{TIP[1]!r}"}
    model = arm(gravity=(0.0, 0.0), trajectory=[path])
    analysis = pcid(end=0.2, tolerance=1e-8, integrator="generalized-alpha")
    with pytest.raises(SolveError, match=r"1e-08 is below what generalized-alpha reaches here.*loosen the tolerance"):
        run(model, analysis).check_completed()


@pytest.mark.parametrize("tolerance", [1e-6, TIGHTEST_TOLERANCE])
def test_a_start_at_rest_costs_no_more_steps_than_the_motion(tolerance):
    """Vibration starts from nothing there: its rounding once drove the step below any size."""
    initial = {"angles": ANGLES, "state": "static"}
    at_rest = inverse(arm(initial=initial), tolerance=tolerance, integrator="dop853", max_steps=20_000)
    assert at_rest.statistics.steps < 1.2 * of_arm(tolerance, "dop853").statistics.steps
