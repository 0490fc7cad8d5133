"""DOP853 on constrained motion: its order, its dense output, and what the tolerance promises."""

import numpy as np
import pytest
from links import ANGLES, arm, arm_links
from mechanisms import always, assemble, pcid, relative

from ffrobot.mbs import _core
from ffrobot.mbs.analyses import run_pcid
from ffrobot.mbs.initial_state import undeformed_state
from ffrobot.mbs.scene_records import TIGHTEST_TOLERANCE

REPORTED = ("q", "v", "lambda_", "tau", "F_p")


def inverse(model, **keys):
    outcome = run_pcid(model, pcid(**keys), False, always)
    assert outcome.status == "completed"
    return outcome


def observed_orders(steps, errors):
    return np.diff(np.log(errors)) / -np.diff(np.log(steps))


def test_order_of_steps_and_of_dense_output_is_eight():
    """Equal steps of 4 to 17 periods a second each; both errors shrink as h^8 (Hairer, Nørsett, Wanner, II.10)."""
    assembly = assemble(arm(arm_links(EI=3.0, modes=2)))
    start = undeformed_state(assembly)

    def states(steps):
        return _core.fixed_steps(assembly.system, 0.5, steps, start.q, start.v)

    steps, finest = [40, 80, 160], 1280
    exact = states(finest)
    ends = [np.abs(states(n)[::2] - exact[:: 2 * finest // n]).max() for n in steps]
    middles = [np.abs(states(n)[1::2] - exact[finest // n :: 2 * finest // n]).max() for n in steps]
    assert ends[-1] < 1e-10
    np.testing.assert_allclose(observed_orders(steps, ends), 8.0, atol=0.25)
    np.testing.assert_allclose(observed_orders(steps, middles), 8.0, atol=0.25)


@pytest.fixture(scope="module")
def tight():
    return inverse(arm(), tolerance=TIGHTEST_TOLERANCE)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5, 1e-6, 1e-7, 1e-8])
def test_errors_of_all_reported_quantities_are_within_the_tolerance(tight, tolerance):
    """Relative to each quantity's peak; measured: λ 0.05 … 0.08 of the tolerance, q below 1e-4 of it."""
    outcome = inverse(arm(), tolerance=tolerance)
    ratios = {name: relative(getattr(outcome, name), getattr(tight, name)) / tolerance for name in REPORTED}
    assert max(ratios.values()) <= 1.0, ratios
    assert ratios["lambda_"] > 0.003, "far more work than the tolerance asks for"


def test_steps_grow_as_the_eighth_root_of_the_accuracy(tight):
    """The controller keeps the error proportional to the tolerance: steps ∝ error^(−1/8)."""
    outcomes = [inverse(arm(), tolerance=tolerance) for tolerance in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)]
    errors = [relative(outcome.lambda_, tight.lambda_) for outcome in outcomes]
    slope = np.polyfit(np.log([outcome.steps for outcome in outcomes]), np.log(errors), 1)[0]
    assert slope == pytest.approx(-8.0, abs=0.5)


def test_outputs_between_steps_are_as_good_as_outputs_at_steps(tight):
    """At t = 0.5 s the dense output of a run to 1 s, against a run whose last step ends there."""
    tolerance = 1e-6
    half = inverse(arm(), end=0.5, output_step=0.5, tolerance=tolerance)
    whole = inverse(arm(), tolerance=tolerance)
    middle = np.flatnonzero(tight.time == 0.5)[0]
    for name in ("q", "lambda_"):
        peak = np.abs(getattr(tight, name)).max()
        exact = getattr(tight, name)[middle]
        assert relative(getattr(half, name)[-1], exact, peak) < tolerance
        assert relative(getattr(whole, name)[middle], exact, peak) < tolerance


def test_output_times_do_not_steer_the_steps():
    few, many = (inverse(arm(), output_step=step, tolerance=1e-6) for step in (0.1, 0.001))
    assert few.steps == many.steps
    np.testing.assert_allclose(few.q, many.q[::100], rtol=0, atol=1e-13)  # the times differ in their last bit


def test_constraints_hold_at_every_output():
    """Position, velocity and acceleration level, relative to their terms, however coarse the steps."""
    for tolerance in (1e-3, 1e-6):
        assert inverse(arm(), output_step=0.001, tolerance=tolerance).residual.max() < 1e-11


def test_a_run_ends_at_max_steps_and_says_so():
    outcome = run_pcid(arm(), pcid(max_steps=100), False, always)
    assert outcome.status == "too many steps"
    assert outcome.steps + outcome.rejected == 100
    assert 0 < outcome.time[-1] < 1


def test_a_run_stops_when_asked_to():
    asked = []
    outcome = run_pcid(arm(), pcid(tolerance=1e-10), False, lambda t: asked.append(t) or t < 0.2)
    assert outcome.status == "interrupted"
    assert 0.2 <= asked[-1] < 1
    assert outcome.time[-1] <= asked[-1]


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8, TIGHTEST_TOLERANCE])
def test_a_start_at_rest_costs_no_more_steps_than_the_motion(tolerance):
    """Vibration starts from nothing there: its rounding once drove the step below any size."""
    initial = {"angles": ANGLES, "state": "static"}
    at_rest = run_pcid(arm(initial=initial), pcid(tolerance=tolerance, max_steps=20_000), False, always)
    assert at_rest.status == "completed"
    assert at_rest.steps < 1.2 * inverse(arm(), tolerance=tolerance).steps
