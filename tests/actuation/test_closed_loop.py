"""Sampled control: against exact discrete models of rigid arms, and what goes wrong."""

import numpy as np
import pytest
from loop_scenes import INERTIA, PID, T, blow, loop, moving_at, wheel

from ffrobot.actuation.control.sampled_model import sampled
from ffrobot.common.errors import InputError
from ffrobot.pictures.figures.standard import standard_figures
from ffrobot.results.file import Results
from ffrobot.results.write import results_image
from ffrobot.run.solve import prepare_scene, solve_scene


@pytest.mark.parametrize("delay", [0.0, 0.004, T, 2.5 * T])
@pytest.mark.parametrize("resolution", [0.0, 1e-4])
def test_a_sampled_loop_is_its_exact_discrete_model(delay, resolution):
    """x(k+1) = A x(k) + B u with the commands that are on their way as states; a start off the reference by a rate."""
    scene = wheel(
        loop(controller=[PID], delay=delay, sensor=[{"joint": "O", "resolution": resolution}]),
        initial={"rates": {"w": 0.0}},
    )
    start = 0.3
    outcome = moving_at(lambda v: np.where(np.arange(len(v))[:, None] == 0, start, 0.0), scene)
    record = outcome.details
    assert outcome.status == "completed"

    A, B = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1 / INERTIA]])
    model = sampled(A, B, T, delay)
    x = np.zeros(len(model.A))
    x[1] = start
    reference, y = record.reference, np.zeros((len(record.time), 2))
    for k in range(len(record.time)):
        y[k] = x[:2]
        if resolution:
            y[k, 0] = np.round(y[k, 0] / resolution) * resolution
        e = reference[k] - y[k]
        x = model.A @ x + model.B[:, 0] * (20.0 * e[0] + 4.0 * e[1])
    np.testing.assert_allclose(record.readings, y, atol=1e-7 * np.abs(y).max())
    assert np.abs(record.readings[:, 0]).max() > 1e-3


def test_units_of_commands_do_not_decide_on_the_discrete_model():
    A, B = np.array([[0.0, 1.0], [-2.0, -0.1]]), np.array([[0.0], [3.0]])
    plain, huge = (sampled(A, unit * B, T, 0.0) for unit in (1.0, 1e30))
    np.testing.assert_allclose(huge.A, plain.A, rtol=1e-12)
    np.testing.assert_allclose(huge.B, 1e30 * plain.B, rtol=1e-12)


def test_commands_stop_at_the_limits_of_the_motors():
    outcomes = solve_scene(wheel(loop(controller=[PID], disturbance=blow()), joint={"moment_limit": 0.5}))
    record = outcomes.outcomes["loop"].details
    assert np.abs(record.commands).max() == 0.5 == record.metrics.peak_moment
    assert outcomes.outcomes["loop"].closer.time[0] == 0.0  # peaks are none of what would act before
    assert np.abs(record.wanted).max() > 0.6
    cut = (np.abs(record.wanted) > 0.5).any(axis=1).mean()
    assert record.metrics.saturated == cut > 0


@pytest.mark.parametrize(
    "noise", [{"noise": 0.02}, {"noise_density": 0.02 * (8 * T) ** 0.5, "sample_time": 4 * T}], ids=["size", "density"]
)
def test_noise_is_that_of_the_seed(noise):
    def readings(seed):
        sensor = [{"joint": "O", "measure": "rate"} | noise, {"joint": "O"}]
        scene = wheel(loop(sensor=sensor, seed=seed))
        record = solve_scene(scene).outcomes["loop"].details
        return record.readings[:, record.outputs.index("joint/O/rate")]

    first, again, other = readings(1), readings(1), readings(2)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.01
    assert np.std(first) == pytest.approx(0.02, rel=0.3)  # 50 samples


def test_the_points_accelerometer_feels_the_blow():
    """F = 5 N at the rim, 0.3 m from O: a_y = r (F r)/I as long as the wheel has hardly turned."""
    sensor = [{"point": "w.rim", "measure": "acceleration"}]
    record = solve_scene(wheel(loop(sensor=sensor, disturbance=blow()))).outcomes["loop"].details
    column = record.outputs.index("point/w.rim/y/acceleration")
    assert record.readings[1, column] == pytest.approx(0.3 * 5.0 * 0.3 / INERTIA, rel=1e-3)
    assert record.readings[20, column] == pytest.approx(0.0, abs=0.2)


def test_unstable_gains_are_reported_and_the_results_kept():
    """Derivative gain beyond 2 I/T: every sample overshoots. The run after it is made all the same."""
    wild = {"kind": "joint-pid", "proportional": {"O": 1.0}, "derivative": {"O": 3 * INERTIA / T}}
    scene = wheel(loop("wild", controller=[wild], disturbance=blow(until=0.02)), loop("calm", controller=[PID]))
    solution = solve_scene(scene)
    wild, calm = solution.outcomes["wild"].details, solution.outcomes["calm"].details
    rate = wild.readings[:, wild.outputs.index("joint/O/rate")]
    # ω(k+1) = ω(k) (1 − 3) once the blow is over; the proportional part, T²/I of the rate, adds 2e-4.
    np.testing.assert_allclose(rate[4:] / rate[3:-1], -2.0, rtol=1e-3)
    assert calm.metrics.verdict == "stable"
    results = Results.from_image(results_image(solution), scene.path)
    assert results.has("wild/control/commands")
    assert results.attributes("calm/control")["verdict"] == "stable"
    assert results.verdict["calm"].margins.startswith("margins (linear model): gains may grow")
    assert len(results.time("calm/control/commands")) == len(results["calm/control/readings"]) == 50
    (figure,) = [figure for figure in standard_figures(results) if figure.name == "tip_error"]
    assert [curve.label for curve in figure.curves] == ["wild", "calm"]
    pytest.importorskip("xarray")
    dataset = results.to_xarray("calm")
    assert dataset["control/readings"].dims == ("control/time", "readings")
    np.testing.assert_array_equal(dataset["control/readings"], results["calm/control/readings"])


def test_slow_sampling_is_warned_of():
    stiff = {"kind": "joint-pid", "proportional": {"O": 5000.0}}
    record = solve_scene(wheel(loop(controller=[stiff]))).outcomes["loop"].details
    assert any("sampling at 100 Hz is slow" in line for line in record.warnings)
    assert not solve_scene(wheel(loop(controller=[PID]))).outcomes["loop"].details.warnings


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"delay": 0.6}, "expected a delay shorter than the run"),
        ({"sensor": [{"point": "w.rimm"}]}, 'found "w.rimm".*did you mean'),
        ({"sensor": [{"pzt": "w"}]}, "expected a layout of patches"),
        ({"sensor": [{"joint": "O", "measure": "acceleration"}]}, "measure"),
        ({"controller": [{"kind": "joint-pid", "proportional": {"B": 1.0}}]}, 'found "B"'),
        ({"controller": [{"kind": "python", "python": "nowhere.py:f"}]}, "expected an existing file"),
        ({"apply": "joints"}, 'expected the key "apply" only in kind = "forward", found kind = "closed-loop"'),
        ({"controller": [{"kind": "lqr", "time": 7.0}]}, "controller no. 1: time: expected at most .* ends, found 7.0"),
        ({"disturbance": [{"joint": "O", "moment": "1"}]}, "disturbances at points"),
        ({"disturbance": [{"point": "w.rim", "force": "x"}]}, "force"),
        ({"disturbance": [{"point": "w.rim", "y": "log(t - 1)"}]}, "disturbance no. 1: y"),
        ({"sensor": [{"modal": "w"}]}, "expected a flexible body"),
        ({"sensor": [{"joint": "O", "resolution": -1.0}]}, "resolution"),
        ({"controller": [{"kind": "modal-velocity", "bodies": ["w"], "damping_ratio": 1.0}]}, "a body with patches"),
        ({"actuation": "nothing"}, "actuation"),
    ],
)
def test_bad_keys_are_refused(keys, expected):
    with pytest.raises(InputError, match=expected):
        prepare_scene(wheel(loop(**keys)))


def test_keys_of_other_kinds_are_named_one_by_one():
    """Not those that an actuation would bring along; of a list with a wrong entry nothing else."""
    keys = {"actuation": "inverse", "times": [-1.0], "sample_time": 1.0}
    with pytest.raises(InputError) as caught:
        prepare_scene(wheel({"name": "c", "kind": "linear", "about": "inverse", **keys}))
    lines = [line.partition('analysis "c": ')[2] for line in str(caught.value).splitlines()]
    assert lines == [
        "times[0]: expected a number of at least 0, found -1.0",
        'expected the key "actuation" only in kind = "forward" or "closed-loop", found kind = "linear"',
        'expected the key "sample_time" only in kind = "closed-loop", found kind = "linear"',
    ]
