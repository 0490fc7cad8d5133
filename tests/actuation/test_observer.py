"""Loops with observers: exact discrete models, systems of python-control, tables, what does not fit."""

import re

import numpy as np
import pytest
from loop_scenes import ENCODER, GAINS, INERTIA, KALMAN, PID, T, observed
from scipy.linalg import solve_discrete_are

import ffrobot
from ffrobot.actuation.control.sampled_model import sampled, zero_order_hold
from ffrobot.common.errors import InputError, SolveError
from ffrobot.exchange.export import export_file
from ffrobot.scene.load import make_scene


def table_in_c(results, folder):
    """The text of an exported controller, and its numbers A."""
    export_file(results, "c", "loop", folder / "c.h")
    text = (folder / "c.h").read_text()
    return text, np.array(re.search(r"double A\[\] = \{(.*?)\}", text, re.DOTALL)[1].split(","), dtype=float)


def test_a_loop_with_an_observer_is_its_exact_discrete_model():
    """Angle by encoder, rate and a constant moment estimated, which is rejected; a command acts 4 ms late."""
    moment, drift, delay, seed = 0.3, 2.0, 0.004, 7
    push = [{"point": "w.rim", "y": f"{moment / 0.3!r}"}]  # at r = 0.3 m
    observer = KALMAN | {"disturbance": {"joint/O": drift}, "reject": True}
    results = ffrobot.solve(
        observed(sensor=[ENCODER], controller=[PID], observer=observer, disturbance=push, delay=delay, seed=seed)
    )
    A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1 / INERTIA], [0.0, 0.0, 0.0]])
    B = np.array([[0.0], [1 / INERTIA], [0.0]])
    plant, c = sampled(A, B, T, delay), np.array([[1.0, 0.0, 0.0, 0.0]])
    Phi, Gamma = zero_order_hold(A, B, T)
    Q = 0.25 * Gamma @ Gamma.T + np.diag([0.0, 0.0, drift**2 * T])
    P = solve_discrete_are(Phi.T, c[:, :3].T, Q, np.array([[ENCODER["noise"] ** 2]]))
    L = np.append(P[:, 0] / (P[0, 0] + ENCODER["noise"] ** 2), 0.0)
    noise = ENCODER["noise"] * np.random.default_rng(seed).standard_normal(50)
    x, ahead, found = np.array([0.0, 0.0, moment, 0.0]), np.zeros(4), []
    for k in range(50):
        y = x[0] + noise[k]
        estimate = ahead + L * (y - ahead[0])
        found.append([y, *estimate[:3]])
        u = -20.0 * y - 4.0 * estimate[1] - estimate[2]  # measured where it is measured
        x, ahead = plant.A @ x + plant.B[:, 0] * u, plant.A @ estimate + plant.B[:, 0] * u
    group = "loop/control"
    seen = [results[f"{group}/readings"][:, 0]]
    seen += [results[f"{group}/estimate/{name}"][()] for name in ("joint/O", "rate/joint/O", "disturbance/joint/O")]
    np.testing.assert_allclose(np.transpose(seen), found, atol=1e-5)  # the rim turns by 8 mrad
    assert results.attributes(group)["verdict"] == "stable"


@pytest.mark.parametrize("late", [0.0, 3 * T])
def test_controller_and_observer_are_one_system_in_discrete_time(tmp_path, late):
    """From (late) readings off the reference to commands; dt of python-control, matrices of a file, a table in C."""
    control = pytest.importorskip("control")
    push = [{"point": "w.rim", "y": "1"}]
    results = ffrobot.solve(
        observed(sensor=[ENCODER | {"delay": late}], controller=[PID], observer=KALMAN, disturbance=push),
        output=tmp_path / "w.results.h5",
    )
    system = results.controller("loop").to_control()
    assert system.dt == pytest.approx(T)
    read = results["loop/control/readings"][()] - results["loop/control/reference"][()]
    found = control.forced_response(system, U=read.T).outputs
    np.testing.assert_allclose(np.reshape(found, (-1, 1)), results["loop/control/wanted"][()], atol=1e-9)
    results.export_linear("loop", tmp_path / "c.npz")
    saved = np.load(tmp_path / "c.npz")
    np.testing.assert_array_equal(saved["A"], system.A)
    assert saved["sample_time"] == pytest.approx(T)
    text, numbers = table_in_c(tmp_path / "w.results.h5", tmp_path)
    assert f"#define N_X {len(system.A)}" in text
    np.testing.assert_array_equal(numbers, system.A.ravel())
    with pytest.raises(
        InputError, match=r'found none; the name of closed-loop control \("loop"\) selects its controllers'
    ):
        results.export_linear(None, tmp_path / "c.npz")
    with pytest.raises(InputError, match=r'expected a closed loop of linear controllers .*"loop".*found "inverse"'):
        results.controller("inverse")
    switched = [{"kind": "python", "python": lambda setup: lambda k, y: -0.01 * np.sign(y[:1])}]
    other = ffrobot.solve(observed(sensor=[ENCODER], controller=[PID, *switched], disturbance=push))
    with pytest.raises(InputError, match=r'expected a closed loop of linear controllers \(none\), found "loop"'):
        other.state_spaces("loop")


def test_a_function_beside_an_observer_is_asked_in_order_for_margins():
    def damped(setup):
        expected, rate = iter(range(1000)), setup.columns("joint/O/rate")

        def at_sample(k, y):
            assert k == next(expected)
            return -4.0 * y[rate]

        return at_sample

    python = {"kind": "python", "python": damped}
    stiff = PID | {"derivative": {}}
    keys = {"sensor": [ENCODER], "observer": KALMAN, "sample_time": T / 5}
    keys |= {"disturbance": [{"point": "w.rim", "y": "1"}]}
    found = [ffrobot.solve(observed(controller=of, **keys)) for of in ([stiff, python], [PID])]
    margins = [results.attributes("loop/control")["gain_margin"] for results in found]
    assert margins[0] == pytest.approx(margins[1], rel=1e-2)


def scheduled_arm(count):
    rod = {"mass": 1.0, "inertia": 0.02, "center": [0.25, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.5, 0.0]}}
    observer = {"kind": "scheduled", "count": count, "process": {"joint/a": 0.5, "joint/b": 0.3}}
    pid = PID | {"proportional": {"a": 100.0, "b": 40.0}, "derivative": {"a": 10.0, "b": 3.0}}
    loop = {"kind": "closed-loop", "actuation": "inverse", "sample_time": T, "observer": observer, "controller": [pid]}
    loop |= {"sensor": [{"joint": name, "noise": 1e-4} for name in "ab"]}
    loop |= {"disturbance": [{"point": "B.tip", "y": "-2"}]}
    return make_scene(
        name="arm", gravity=[0.0, -9.81], body=[{"name": name, "rigid": rod} for name in "AB"],
        joint=[{"name": "a", "type": "revolute", "between": ["ground", "A.root"]},
               {"name": "b", "type": "revolute", "between": ["A.tip", "B.root"]}],
        trajectory=[{"name": "a", "joint": "a", "value": "t**2"},
                    {"name": "b", "joint": "b", "value": "0.5 + 1.5*t**2"}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": T / 2}, {"name": "loop"} | loop],
    )  # fmt: skip


def test_a_scheduled_controller_is_a_table_of_systems(tmp_path):
    """Straight lines between them are off the run, whose observer alone has them, by the square of their distance."""
    off = []
    for count in (3, 9):
        results = ffrobot.solve(scheduled_arm(count), output=tmp_path / f"{count}.h5")
        results.export_linear("loop", tmp_path / "c.npz")
        saved, group = np.load(tmp_path / "c.npz"), "loop/control"
        y = results[f"{group}/readings"][()] - results[f"{group}/reference"][()]
        times, x, found = results[f"{group}/time"][()], np.zeros(saved["A"].shape[1]), []
        for t, read in zip(times, y, strict=True):
            k = min(int((count - 1) * t), count - 2)
            part = (t - saved["time"][k]) * (count - 1)
            A, B, C, D = ((1 - part) * saved[key][k] + part * saved[key][k + 1] for key in "ABCD")
            found.append(C @ x + D @ read)
            x = A @ x + B @ read
        moments = [results[f"inverse/joints/{name}/moment"][1::2].ravel()[: len(times)] for name in "ab"]
        commanded = results[f"{group}/wanted"][()] - np.transpose(moments)
        off.append(np.abs(commanded - found).max() / np.abs(found).max())
    assert off[0] < 5e-3
    assert off[1] < off[0] / 10
    text, numbers = table_in_c(tmp_path / "3.h5", tmp_path)
    assert "#define N_TIME 3" in text
    controllers = ffrobot.Results(tmp_path / "3.h5").controllers("loop")
    np.testing.assert_array_equal(numbers, np.ravel([of.A for of in controllers]))


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"sensor": [{"joint": "O"}], "observer": KALMAN}, "expected sensors with noise.*joint/O"),
        ({"observer": KALMAN}, "expected sensors with noise.*no sensor"),
        ({"sensor": [ENCODER | {"measure": "rate"}], "observer": KALMAN}, "they cannot see joint/O"),
        ({"sensor": [ENCODER | {"high_pass": 1.0}], "observer": KALMAN}, "they cannot see joint/O"),
        (
            {"sensor": [ENCODER], "observer": KALMAN | {"disturbance": {"joint/O": 1.0, "force/w.rim/y": 1.0}}},
            "they cannot see disturbance/joint/O, disturbance/force/w.rim/y",
        ),
        ({"sensor": [ENCODER], "observer": GAINS | {"outputs": ["joint/P"]}}, "observer: expected readings"),
        ({"sensor": [ENCODER], "observer": KALMAN | {"process": {"joint/O 1": 1.0}}}, 'process: expected .*joint/O 1'),
        ({"sensor": [ENCODER], "observer": KALMAN | {"process": {"force/w.rim/r": 1.0}}}, 'process: expected .*rim/r"'),
        ({"sensor": [ENCODER], "observer": GAINS | {"inputs": ["pzt/O/1"]}}, "observer: inputs: expected mot.*pzt/O/1"),
        ({"sensor": [ENCODER | {"delay": 0.4 * T}]}, "expected a multiple of the loop's sample_time"),
        ({"sensor": [ENCODER, ENCODER | {"noise": 1.0}]}, "expected each sensor once, found no. 2 again"),
        ({"sensor": [ENCODER | {"sample_time": 2 * T}], "observer": KALMAN}, "read at every sample"),
        ({"observer": {"kind": "gains", "inputs": [], "outputs": ["joint/O"], "A": [[0.5]]}}, "B.*missing"),
        ({"sensor": [ENCODER], "observer": GAINS | {"B": [[1.0, 2.0]]}}, "expected B with 1 × 1"),
        ({"sensor": [ENCODER], "observer": GAINS | {"A": [[1.5]]}}, "below 1 in size, found 1.4"),
        ({"sensor": [ENCODER], "observer": GAINS | {"inputs": ["joint/O", "joint/O"]}}, "expected each name once"),
        ({"sensor": [ENCODER], "observer": GAINS | {"scale": [0.0]}}, "1 numbers other than 0 as scale"),
        ({"sensor": [ENCODER], "observer": GAINS | {"A": [[0.5], [0.0, 0.5]]}}, "lists of equal length"),
        ({"sensor": [ENCODER | {"noise": 1e-30}], "observer": KALMAN}, "far more exact than `process` moves the robot"),
        ({"controller": [{"kind": "lqr", "inputs": "patches"}]}, "expected motors or patches as inputs"),
    ],
)  # fmt: skip
def test_what_an_observer_cannot_be_made_of(keys, said):
    with pytest.raises(InputError, match=said):
        ffrobot.solve(observed(**{"controller": [{"kind": "lqr"}] if "sensor" in keys else []} | keys))


def test_a_slower_sensor_keeps_its_reading_and_an_observer_takes_it():
    """Read every third sample; x̂⁺ = x̂/2 + u + (y − x̂)/10 of a published predictor, u = −x̂ of its state."""
    slow = ENCODER | {"sample_time": 3 * T, "delay": T}
    feedback = {"kind": "state-feedback", "inputs": ["joint/O"], "gain": [[1.0]]}
    push = [{"point": "w.rim", "y": "1"}]
    results = ffrobot.solve(observed(sensor=[slow], controller=[feedback], observer=GAINS, disturbance=push, seed=3))
    y, x, expected = results["loop/control/readings"][:, 0], 0.0, []
    for k, now in enumerate(y):
        assert now == y[k - k % 3]
        expected.append(x)
        x = 0.5 * x - x + 0.1 * (now - x)
    assert np.ptp(y) > 1e-3
    assert "gain_margin" not in results.attributes("loop/control")  # of readings at every sample
    np.testing.assert_allclose(results["loop/control/estimate/state/1"][()], expected, atol=1e-12)
    np.testing.assert_allclose(results["loop/control/wanted"][:, 0], -np.array(expected), atol=1e-12)


def test_an_estimate_that_diverges_ends_the_run_with_its_cause():
    """A user's function pushes the observer's model away, which a filter for small signals cannot follow."""

    def pushing(setup):
        return lambda k, y: np.full(len(setup.inputs), 1e12 * (-30.0) ** k)

    sensor = ENCODER | {"range": 1e-3}  # which hides from it what the wheel does
    with pytest.raises(SolveError, match=r"observer: the estimate diverges at t = .*does not fit the motion"):
        ffrobot.solve(observed(sensor=[sensor], observer=KALMAN, controller=[{"kind": "python", "python": pushing}]))
