"""Peaks, means and references of sampled control do not depend on outputs."""

import numpy as np
import pytest
from beam_links import beam_link, tube
from loop_scenes import INERTIA, PID, T, blow, loop, wheel
from one_link import one_link

import ffrobot
from ffrobot.run.solve import solve_scene


@pytest.mark.parametrize("lasts", [1e-3, 2e-5])
def test_brief_disturbances_are_felt(lasts):
    """Without control, I γ̇ = 0.3 m · 5 N for as long as it lasts, between two of the samples."""
    push = [{"point": "w.rim", "y": f"where(t < 0.2031, 0, where(t < {0.2031 + lasts!r}, 5, 0))"}]
    run = solve_scene(wheel(loop(disturbance=push, feed_forward="none", tip="w.rim"))).outcomes["loop"]
    assert run.v[-1, 0] == pytest.approx(0.3 * 5.0 * lasts / INERTIA, rel=1e-6)


@pytest.mark.parametrize(("delay", "step"), [(0.0, T), (0.004, 0.1), (2.5 * T, 0.1)])
def test_means_are_those_of_commands_that_are_held(delay, step):
    """RMS and work of a motor, ∫ τ γ̇ by ∫ τ dγ with constant τ from change to change, by sampled commands alone."""
    held = {"controller": [PID | {"integral": {"O": 30.0}}], "delay": delay, "feed_forward": "none"}
    held |= {"disturbance": blow(until=0.1), "sensor": [{"joint": "O", "resolution": 2e-3}]}
    with ffrobot.solve(wheel(loop(output_step=step, **held))) as results:
        moment, joint, error, seen = (
            results.attributes(f"loop/{name}") for name in ("joints/O/moment", "joints/O", "tip_error", "control")
        )
        commands = results["loop/control/commands"][:, 0]
        changes = np.minimum(np.append(results["loop/control/time"] + delay, 0.5), 0.5)
    lasts = np.diff(changes) / 0.5
    assert np.ptp(commands) > 0.1
    assert moment["rms"] == pytest.approx(np.sqrt(commands**2 @ lasts), rel=1e-6)
    assert moment["mean"] == pytest.approx(commands @ lasts, rel=1e-6, abs=1e-9)
    with ffrobot.solve(wheel(loop(output_step=1e-4, **held))) as fine:
        gamma = np.interp(changes, fine.time("loop"), fine["loop/joints/O/coordinate"])
        distance = fine["loop/tip_error"]
    assert joint["mean_power"] == pytest.approx(commands @ np.diff(gamma) / 0.5, rel=1e-3)
    assert (error["peak"], error["rms"]) == (seen["tip_error_max"], seen["tip_error_rms"])
    assert error["peak"] == pytest.approx(distance.max(), rel=1e-5)


@pytest.mark.parametrize("step", [0.25, T])
def test_references_do_not_depend_on_outputs(step):
    """The path and its rate at samples; within these the tip, 0.3 m away, errs by no more than γ̈ T² of them."""
    target = "0.4*(10*(2*t)**3 - 15*(2*t)**4 + 6*(2*t)**5)"
    record = solve_scene(wheel(loop(controller=[PID], tip="w.rim"), target=target, step=step)).outcomes["loop"].details
    u = 2.0 * record.time
    path = 0.4 * u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 24.0 * u**2 * (1.0 - u) ** 2
    np.testing.assert_allclose(record.reference.T, path, atol=1e-8)
    assert record.metrics.tip_error_max < 0.3 * 16.0 / np.sqrt(3.0) * T**2
    assert record.metrics.verdict == "stable"


def test_peaks_of_what_rings_do_not_depend_on_outputs():
    """A tube that is hit rings at 100 Hz and more between samples: outputs far apart, and closer than its periods."""

    def found(step):
        link = beam_link(0.5, tube(0.03, 0.026), 10, nu=None, modes={"count": 3, "family": "in-plane-bending"})
        inverse = {"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": step}
        hit = [{"point": "arm.tip", "y": "where(t < 0.0007, 200, 0)"}]
        control = loop(sample_time=1e-3, controller=[PID], disturbance=hit)
        results = ffrobot.solve(one_link("arm", link, inverse, control, joint={"rotor_inertia": 0.05}, target="0"))
        seen = {of: results.attributes(f"loop/joints/O/{of}") for of in ("rate", "reaction", "moment")}
        rates = results["loop/joints/O/rate"]
        return [about[key] for about in seen.values() for key in ("peak", "rms")], np.abs(rates).max()

    (far, _), (near, highest) = found(0.1), found(1e-4)
    # the force has eight steps in a period of the fastest mode, between which its peak is that of a polynomial
    assert np.all(np.abs(np.array(far) / near - 1) < [1e-3, 1e-3, 6e-3, 1e-3, 1e-3, 1e-3])
    assert far[0] == pytest.approx(highest, rel=3e-3)  # a tenth of a period of the fastest mode between outputs
