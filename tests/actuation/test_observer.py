"""Observers and their sensors: closed forms, python-control, exact discrete models, statistics, what does not fit."""

import re
from dataclasses import replace

import numpy as np
import pytest
from beam_links import paper_link
from scipy.linalg import expm, solve_discrete_are
from scipy.stats import chi2

import ffrobot
from ffrobot.actuation.control.linear_model import LinearModel
from ffrobot.actuation.control.lqr import gains
from ffrobot.actuation.control.margins import Feedback, loop_eigenvalues
from ffrobot.actuation.control.observer import Schedule, hidden, kalman
from ffrobot.actuation.control.observer_records import KalmanObserver
from ffrobot.actuation.control.sampling import by_doubling, riccati, sampled, zero_order_hold
from ffrobot.actuation.control.sensor_records import Sensor
from ffrobot.actuation.control.signals import Filter, Signal
from ffrobot.common.errors import InputError, SolveError
from ffrobot.exchange.export import export_file
from ffrobot.exchange.fmu.forward_model import joint_units, linear_variables
from ffrobot.scene.load import make_scene

T, INERTIA = 0.01, 0.5
K_SPRING, PUSH, NOISE = 40.0, (0.7, 0.3), (2e-3, 5e-3)
PID = {"kind": "joint-pid", "proportional": {"O": 20.0}, "derivative": {"O": 4.0}}
ENCODER = {"joint": "O", "noise": 1e-4}
GAINS = {"kind": "gains", "inputs": ["joint/O"], "outputs": ["joint/O"]}
GAINS |= {"A": [[0.5]], "B": [[1.0]], "C": [[1.0]], "gain": [[0.1]]}
KALMAN = {"kind": "kalman", "process": {"joint/O": 0.5}}


def two_masses(damping=0.0):
    """Masses of 1 kg with a spring between; forces on both, and apart, push them; their sum and difference are read."""
    f, spring, both = 2, np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[1.0, 1.0], [1.0, -1.0]])
    A = np.block([[np.zeros((f, f)), np.eye(f)], [-K_SPRING * spring, -damping * spring]])
    B = np.vstack([np.zeros((f, f)), both])
    C = np.vstack([np.hstack([both, 0 * both]), np.eye(4)])
    outputs = ("sum", "difference", "joint/a", "joint/b", "joint/a/rate", "joint/b/rate")
    states = ("joint/a", "joint/b", "rate of joint/a", "rate of joint/b")
    return LinearModel(
        A, B, C, np.zeros((6, 2)), states, ("joint/a", "joint/b"), outputs, 0.0, np.eye(f), np.eye(f)
    )  # fmt: skip


def filter_of(model, **sampling):
    record = KalmanObserver(kind="kalman", process=dict(zip(model.input_names, PUSH, strict=True)))
    read = [Signal(name, Sensor(joint="a", noise=s)) for name, s in zip(("sum", "difference"), NOISE, strict=True)]
    return kalman(record, model, read, model.output_names[2:], (model.input_names, T, sampling.get("delay", 0.0)))


def test_samples_do_not_depend_on_the_units_of_states():
    """Modes of 0, 60 and 2200 Hz in closed form, told by one angle (rad) and two m√kg of a robot of 10 µm."""
    shapes, T, unit = np.array([[1.0, 1, 1], [1, -2, 1], [1, 0.5, -3]]), 2e-3, np.array([1.0, 1e-12, 1e-12] * 2)
    A, expected = np.zeros((6, 6)), np.zeros((6, 6))
    for k, omega in enumerate([0.0, 375.0, 14e3]):
        along, rate = np.outer(shapes[:, k], np.linalg.inv(shapes)[k]), omega * np.sqrt(1 - 0.01**2)
        c, s = np.cos(rate * T) + 0.01 * omega * T * np.sinc(rate * T / np.pi), T * np.sinc(rate * T / np.pi)
        moved = np.exp(-0.01 * omega * T) * np.array([[c, s], [-(omega**2) * s, c - 0.02 * omega * s]])
        A += np.kron([[0.0, 1.0], [-(omega**2), -0.02 * omega]], along)
        expected += np.kron(moved, along)
    Phi, _ = zero_order_hold(unit[:, None] * A / unit, unit[:, None], T)
    for row, right in zip(Phi * unit / unit[:, None], expected, strict=True):
        np.testing.assert_allclose(row, right, rtol=0.0, atol=1e-12 * np.abs(right).max())


def test_riccati_of_one_state_in_closed_form():
    a, q, r = 1.1, 0.3, 0.02
    half = ((a * a - 1) * r + q) / 2
    found = riccati(np.array([[a]]), np.eye(1), np.array([[q]]), np.array([[r]]))
    assert found[0, 0] == pytest.approx(half + np.sqrt(half**2 + q * r), rel=1e-12)


def test_riccati_by_doubling():
    """As by eigenvalues, whose reordering may fail; none of an integrator unseen, and of noise below round-off."""
    rng = np.random.default_rng(0)
    A, B = np.eye(4) + np.diag([0.1, 0.1, 0.0], 1) + 1e-2 * rng.standard_normal((4, 4)), rng.standard_normal((4, 2))
    found = by_doubling(A, B, np.eye(4))
    np.testing.assert_allclose(found, solve_discrete_are(A, B, np.eye(4), np.eye(2)), rtol=1e-9)
    assert by_doubling(np.eye(2), np.array([[1.0], [0.0]]), np.eye(2)) is None
    assert by_doubling(A, 1e10 * B, np.eye(4)) is None


def test_motions_that_sensors_see_in_any_units():
    """An angle shows its rate, also beside stiff modes; a motion that nothing reads is named."""
    A = np.array([[1.0, 1e-3, 0.0], [0.0, 1.0, 1e5], [0.0, 0.0, 0.5]])
    assert hidden(A, np.array([[1.0, 0.0, 0.0]]), ("angle", "rate", "mode")) == []
    assert hidden(A, np.array([[0.0, 1.0, 0.0]]), ("angle", "rate", "mode")) == ["angle"]


def test_two_masses_by_spectral_factorization():
    """They move as one, and against each other: two filters of two states.

    With x = Φ x + γ w and y = c x + v, S p(z) p(1/z) = r a(z) a(1/z) + q b(z) b(1/z), quadratic in z + 1/z.
    """
    model, observer = two_masses(), filter_of(two_masses())
    Phi, Gamma = zero_order_hold(model.A, model.B, T)
    for k, (stiffness, push, noise) in enumerate(zip((0.0, 2 * K_SPRING), PUSH, NOISE, strict=True)):
        one = expm(np.array([[0.0, 1.0], [-stiffness, 0.0]]) * T)
        a0, a1 = 1.0, -np.trace(one)
        gamma = np.array([model.C[k] @ Gamma[:, k], model.C[k, :2] @ Gamma[2:, k]])  # of the sum and its rate
        b1, b0 = gamma[0], one[0, 1] * gamma[1] - one[1, 1] * gamma[0]
        r, q = noise**2, push**2
        w = np.roots([
            r * a0,
            r * a1 * (1 + a0) + q * b1 * b0,
            r * (1 + a1**2 + a0**2 - 2 * a0) + q * (b1**2 + b0**2),
        ]).astype(complex)  # fmt: skip
        z = (w - np.sqrt(w - 2) * np.sqrt(w + 2)) / 2
        z = np.where(np.abs(z) > 1, 1 / z, z)
        S = r * a0 / np.prod(z).real
        # L = P cᵀ/S and c P⁺ cᵀ = r (S − r)/S
        c = model.C[k]
        assert c @ observer.covariance @ c == pytest.approx(r * (S - r) / S, rel=1e-12)
        assert c @ observer.L[:, k] == pytest.approx((S - r) / S, rel=1e-12)
    assert np.allclose(observer.A, Phi, atol=1e-14)


def test_gains_are_those_of_python_control():
    """Of models that are exported to it: dlqe, and dlqr with the identity as weights."""
    control = pytest.importorskip("control")
    model = two_masses(damping=0.3)
    system = model.to_control().sample(T)
    G = zero_order_hold(model.A, model.B, T)[1]
    L, _, _ = control.dlqe(system.A, G, system.C[:2], np.diag(np.square(PUSH)), np.diag(np.square(NOISE)))
    observer = filter_of(model)
    np.testing.assert_allclose(observer.A @ observer.L, L, atol=1e-10 * np.abs(L).max())
    K, _, _ = control.dlqr(system.A, system.B, np.eye(4), np.eye(2))
    np.testing.assert_allclose(gains(sampled(model.A, model.B, T, 0.0), np.eye(4), np.eye(2)), K, atol=1e-10)


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.023])
def test_poles_of_the_loop_are_those_of_controller_and_observer(delay):
    model, observer = two_masses(damping=0.3), filter_of(two_masses(damping=0.3), delay=delay)
    plain = sampled(model.A, model.B, T, 0.0)
    K = gains(plain, np.eye(4), np.eye(2))
    D = np.hstack([np.zeros((2, 2)), -K])  # readings, then estimates of all states
    inner = Feedback(np.zeros((0, 0)), np.zeros((0, 6)), np.zeros((2, 0)), D, model.input_names, model.output_names)
    found = loop_eigenvalues(model, observer.closed(inner), T, delay)
    late = sampled(model.A, model.B, T, delay)
    by_state = late.A - late.B @ np.hstack([K, np.zeros((2, len(late.A) - 4))])
    expected = np.concatenate([np.linalg.eigvals(by_state), np.linalg.eigvals(observer.error)])
    assert len(found) == len(expected)
    large = expected[np.abs(expected) > 1e-3]  # commands on their way are defective zeros
    assert np.abs(large[:, None] - found).min(axis=1).max() < 1e-9


def test_errors_are_as_large_as_their_covariance_says():
    """NEES of 500 runs: chi-square, by the state after 300 samples; with every bound that one in 500 misses."""
    model, observer, rng, runs = two_masses(0.3), filter_of(two_masses(0.3)), np.random.default_rng(5), 500
    Phi, Gamma = zero_order_hold(model.A, model.B, T)
    x = ahead = np.zeros((runs, 4))
    for _ in range(300):
        y = x @ model.C[:2].T + rng.standard_normal((runs, 2)) * NOISE
        estimate = ahead + (y - ahead @ observer.C.T) @ observer.L.T
        error, ahead = x - estimate, estimate @ observer.A.T
        x = x @ Phi.T + rng.standard_normal((runs, 2)) * PUSH @ Gamma.T
    nees = np.einsum("ri,ij,rj->", error, np.linalg.inv(observer.covariance), error)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 4 * runs)
    assert low < nees < high


def test_accelerometers_feel_the_loads_that_push_the_robot():
    """NEES as above: a reading D w + noise and the next state have the load w in common."""
    plain, rng, runs = two_masses(0.3), np.random.default_rng(6), 500
    rows = {"a/acceleration": 2, "b/acceleration": 3}
    model = replace(
        plain, C=np.vstack([plain.C, plain.A[2:]]), D=np.vstack([plain.D, plain.B[2:]]),
        output_names=(*plain.output_names, *rows),
    )  # fmt: skip
    read = [
        Signal(name, Sensor(joint="a", noise=s)) for name, s in zip(("sum", *rows), (NOISE[0], 0.1, 0.1), strict=True)
    ]
    record = KalmanObserver(kind="kalman", process=dict(zip(model.input_names, PUSH, strict=True)))
    observer = kalman(record, model, read, model.output_names[2:6], ((), T, 0.0))
    Phi, Gamma = zero_order_hold(model.A, model.B, T)
    seen = [0, 6, 7]
    x, last, ahead = np.zeros((runs, 4)), np.zeros((runs, 2)), np.zeros((runs, len(observer.A)))
    for _ in range(300):
        y = x @ model.C[seen].T + last @ model.D[seen].T + rng.standard_normal((runs, 3)) * (NOISE[0], 0.1, 0.1)
        estimate = ahead + (y - ahead @ observer.C.T) @ observer.L.T
        error, ahead = x - estimate[:, :4], estimate @ observer.A.T
        last = rng.standard_normal((runs, 2)) * PUSH
        x = x @ Phi.T + last @ Gamma.T
    nees = np.einsum("ri,ij,rj->", error, np.linalg.inv(observer.covariance[:4, :4]), error)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 4 * runs)
    assert low < nees < high


def test_between_two_instants_gains_are_straight_lines():
    one, other = filter_of(two_masses(0.3)), filter_of(two_masses(3.0))
    schedule = Schedule(np.array([0.0, 2.0]), (one, other))
    np.testing.assert_allclose(schedule.at(0.5).L, 0.75 * one.L + 0.25 * other.L, atol=1e-15)
    assert pytest.approx(other.L) == schedule.at(9.0).L
    assert max(one.radius, other.radius) <= schedule.radius < 1.0


def test_high_pass_and_delay_of_a_sensor():
    """A ramp c t behind a corner 1/τ gives c τ (1 − e^{−t/τ}), three samples late; before the first sample it rests."""
    tau, c, t = 0.05, 3.0, T * np.arange(100)
    read = [
        Signal("a", Sensor(joint="a", high_pass=1 / (2 * np.pi * tau), delay=3 * T)),
        Signal("b", Sensor(joint="b")),
    ]
    through = Filter(read, T)
    found = np.array([through(np.array([7.0 + c * now, now])) for now in t])
    expected = c * tau * -np.expm1(-(t - 3 * T).clip(min=0.0) / tau)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-13)
    np.testing.assert_array_equal(found[:, 1], t)


def wheel(joint=None, analysis=None, **keys):
    """A wheel about O that is to stand still, I γ̈ = u, under a closed loop."""
    body = {"mass": 1.0, "inertia": INERTIA, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0], "rim": [0.3, 0.0]}}
    loop = {"name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": T, "tip": "w.rim"} | keys
    return make_scene(
        name="wheel", gravity=[0.0, 0.0], body=[{"name": "w", "rigid": body}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "w.root"]} | (joint or {})],
        trajectory=[{"name": "stand", "joint": "O", "value": "0"}],
        analysis=analysis or [{"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": T}, loop],
    )  # fmt: skip


def test_a_loop_with_an_observer_is_its_exact_discrete_model():
    """Angle by encoder, rate and a constant moment estimated, which is rejected; a command acts 4 ms late."""
    moment, drift, delay, seed = 0.3, 2.0, 0.004, 7
    push = [{"point": "w.rim", "y": f"{moment / 0.3!r}"}]  # at r = 0.3 m
    observer = KALMAN | {"disturbance": {"joint/O": drift}, "reject": True}
    results = ffrobot.solve(
        wheel(sensor=[ENCODER], controller=[PID], observer=observer, disturbance=push, delay=delay, seed=seed)
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
        wheel(sensor=[ENCODER | {"delay": late}], controller=[PID], observer=KALMAN, disturbance=push),
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
    export_file(tmp_path / "w.results.h5", "c", "loop", tmp_path / "c.h")
    text = (tmp_path / "c.h").read_text()
    assert f"#define N_X {len(system.A)}" in text
    numbers = re.search(r"double A\[\] = \{(.*?)\}", text, re.DOTALL)[1].split(",")
    np.testing.assert_array_equal(np.array(numbers, dtype=float), system.A.ravel())
    with pytest.raises(
        InputError, match=r'found none; the name of closed-loop control \("loop"\) selects its controllers'
    ):
        results.export_linear(None, tmp_path / "c.npz")
    with pytest.raises(InputError, match=r'expected a closed loop of linear controllers .*"loop".*found "inverse"'):
        results.controller("inverse")
    switched = [{"kind": "python", "python": lambda setup: lambda k, y: -0.01 * np.sign(y[:1])}]
    other = ffrobot.solve(wheel(sensor=[ENCODER], controller=[PID, *switched], disturbance=push))
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
    found = [ffrobot.solve(wheel(controller=of, **keys)) for of in ([stiff, python], [PID])]
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
    export_file(tmp_path / "3.h5", "c", "loop", tmp_path / "c.h")
    text = (tmp_path / "c.h").read_text()
    assert "#define N_TIME 3" in text
    numbers = re.search(r"double A\[\] = \{(.*?)\}", text, re.DOTALL)[1].split(",")
    controllers = ffrobot.Results(tmp_path / "3.h5").controllers("loop")
    np.testing.assert_array_equal(np.array(numbers, dtype=float), np.ravel([of.A for of in controllers]))


def test_sensors_are_outputs_of_linear_models():
    """A wheel: γ̇ = u/(I s), which a gyro reads, too; r u/I along y at r = 0.3 m, and u/(I s²) of an encoder."""
    sensors = [{"joint": "O", "measure": "rate"}, {"point": "w.rim", "measure": "accelerometer"},
               {"point": "w.rim", "measure": "gyro"}, {"joint": "O", "noise": 1.0}]  # fmt: skip
    results = ffrobot.solve(wheel(analysis=[{"name": "at_rest", "kind": "linear", "sensor": sensors}]))
    model, omega = results.linear("at_rest")[0], np.array([0.5, 3.0, 20.0])
    s = 1j * omega
    names = [
        "joint/O/rate",
        "point/w.rim/y/accelerometer",
        "point/w.rim/z/gyro",
        "joint/O",
        "point/w.rim/x/accelerometer",
    ]
    expected = np.array([1 / (INERTIA * s), 0.3 / INERTIA + 0 * s, 1 / (INERTIA * s), 1 / (INERTIA * s**2), 0 * s])
    found = model.frequency_response(omega, "joint/O", names)[:, :, 0]
    np.testing.assert_allclose(found.T, expected, rtol=1e-9, atol=1e-12)
    control = pytest.importorskip("control")
    system = model.to_control("joint/O", names)
    np.testing.assert_allclose(control.frequency_response(system, omega).frdata[:, 0], expected, rtol=1e-9, atol=1e-12)
    _, _, outputs = linear_variables(model, joint_units(results.scene))
    units = {each.name: each.unit for each in outputs}
    assert [units[name] for name in names[:4]] == ["rad/s", "m/s2", "rad/s", "rad"]


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
        ({"sensor": [ENCODER], "observer": KALMAN | {"process": {"joint/P": 1.0}}}, 'expected an input .*"joint/P"'),
        ({"sensor": [ENCODER | {"delay": 0.4 * T}]}, "expected a multiple of the loop's sample_time"),
        ({"sensor": [ENCODER | {"sample_time": 2 * T}], "observer": KALMAN}, "read at every sample"),
        ({"observer": {"kind": "gains", "inputs": [], "outputs": ["joint/O"], "A": [[0.5]]}}, "B.*missing"),
        ({"sensor": [ENCODER], "observer": GAINS | {"B": [[1.0, 2.0]]}}, "expected B with 1 × 1"),
        ({"sensor": [ENCODER], "observer": GAINS | {"A": [[1.5]]}}, "below 1 in size, found 1.4"),
        ({"sensor": [ENCODER | {"noise": 1e-30}], "observer": KALMAN}, "far more exact than `process` moves the robot"),
        ({"controller": [{"kind": "lqr", "inputs": "patches"}]}, "expected motors or patches as inputs"),
    ],
)  # fmt: skip
def test_what_an_observer_cannot_be_made_of(keys, said):
    with pytest.raises(InputError, match=said):
        ffrobot.solve(wheel(**{"controller": [{"kind": "lqr"}] if "sensor" in keys else []} | keys))


def test_a_slower_sensor_keeps_its_reading_and_an_observer_takes_it():
    """Read every third sample; x̂⁺ = x̂/2 + u + (y − x̂)/10 of a published predictor, u = −x̂ of its state."""
    slow = ENCODER | {"sample_time": 3 * T, "delay": T}
    feedback = {"kind": "state-feedback", "inputs": ["joint/O"], "gain": [[1.0]]}
    push = [{"point": "w.rim", "y": "1"}]
    results = ffrobot.solve(wheel(sensor=[slow], controller=[feedback], observer=GAINS, disturbance=push, seed=3))
    y, x, expected = results["loop/control/readings"][:, 0], 0.0, []
    for k, now in enumerate(y):
        assert now == y[k - k % 3]
        expected.append(x)
        x = 0.5 * x - x + 0.1 * (now - x)
    assert np.ptp(y) > 1e-3
    np.testing.assert_allclose(results["loop/control/estimate/state/1"][()], expected, atol=1e-12)
    np.testing.assert_allclose(results["loop/control/wanted"][:, 0], -np.array(expected), atol=1e-12)


def test_an_estimate_that_diverges_ends_the_run_with_its_cause():
    """A user's function pushes the observer's model away, which a filter for small signals cannot follow."""

    def pushing(setup):
        return lambda k, y: np.full(len(setup.inputs), 1e12 * (-30.0) ** k)

    sensor = ENCODER | {"range": 1e-3}  # which hides from it what the wheel does
    with pytest.raises(SolveError, match=r"observer: the estimate diverges at t = .*does not fit the motion"):
        ffrobot.solve(wheel(sensor=[sensor], observer=KALMAN, controller=[{"kind": "python", "python": pushing}]))


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_accelerometer_and_gyro_against_differences_of_the_motion(space):
    """A rod that swings about O under gravity: in its axes, r̈ − g by differences of its tip's place, and γ̇."""
    rod = {"mass": 2.0, "points": {"root": [0.0] * 3, "tip": [1.0, 0.0, 0.0]}, "center": [0.5, 0.0, 0.0]}
    rod |= {"inertia": [0.01, 2.0 / 12, 2.0 / 12]}
    gravity, axis = [0.0, -9.81, 0.0], {"axis": [0.0, 0.0, 1.0]}
    if space == "planar":
        rod |= {"inertia": 2.0 / 12, "center": [0.5, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
        gravity, axis = gravity[:2], {}
    sensors = [{"point": "rod.tip", "measure": measure} for measure in ("accelerometer", "gyro")]
    results = ffrobot.solve(make_scene(
        name="swing", space=space, gravity=gravity, body=[{"name": "rod", "rigid": rod}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "rod.root"]} | axis],
        trajectory=[{"name": "swing", "joint": "O", "value": "0.9*sin(2*t)"}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": T, "tolerance": 1e-9},
                  {"name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": T, "sensor": sensors}],
    ))  # fmt: skip
    t, h = results["loop/control/time"][()], 1e-3
    angle = lambda t: 0.9 * np.sin(2 * t)  # noqa: E731
    place = lambda t: np.exp(1j * angle(t))  # noqa: E731
    second = sum(c * place(t + k * h) for k, c in zip(range(-2, 3), (-1, 16, -30, 16, -1), strict=True)) / (12 * h * h)
    force = (second + 9.81j) / place(t)
    names = list(results.attributes("loop/control")["outputs"])
    read = {name: results["loop/control/reference"][:, k] for k, name in enumerate(names)}
    np.testing.assert_allclose(read["point/rod.tip/x/accelerometer"], force.real, atol=1e-6)
    np.testing.assert_allclose(read["point/rod.tip/y/accelerometer"], force.imag, atol=1e-6)
    np.testing.assert_allclose(read["point/rod.tip/z/gyro"], 1.8 * np.cos(2 * t), atol=1e-6)


def test_strain_is_stress_over_modulus():
    """On the lower side of a beam under a force at its tip, which its attachment modes carry exactly."""
    link = paper_link(attachment_modes=True, count=3, stress={"points": {"gauge": [0.2, -0.0075, 0.0]}})
    results = ffrobot.solve(make_scene(
        name="held", gravity=[0.0, 0.0], body=[{"name": "link", "link": link}],
        joint=[{"name": "O", "type": "weld", "between": ["ground", "link.root"]}],
        load=[{"point": "link.tip", "y": "10"}], initial={"state": "static"},
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.02, "output_step": 0.01},
                  {"name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.01,
                   "sensor": [{"strain": "link.gauge"}]}],
    ))  # fmt: skip
    stress = results["loop/stress/link/points/gauge/stress"][0, 0]
    by_hand = 10.0 * (1.0 - 0.2) * 0.0075 / (0.025 * 0.015**3 / 12)
    assert abs(stress) == pytest.approx(by_hand, rel=1e-6)
    assert results["loop/control/readings"][0, 0] == pytest.approx(stress / 2.068427e11, rel=1e-6)
