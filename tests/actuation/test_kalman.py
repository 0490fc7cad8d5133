"""Gains of observers: closed forms, python-control, statistics."""

from dataclasses import replace

import numpy as np
import pytest
from loop_scenes import T
from scipy.linalg import expm, solve_discrete_are
from scipy.stats import chi2

from ffrobot.actuation.control.controllers import gains
from ffrobot.actuation.control.linear_model import LinearModel
from ffrobot.actuation.control.margins import Feedback, loop_eigenvalues
from ffrobot.actuation.control.observer import Schedule, hidden, kalman
from ffrobot.actuation.control.records import KalmanObserver, Sensor
from ffrobot.actuation.control.sampled_model import by_doubling, sampled, zero_order_hold
from ffrobot.actuation.control.signals import Signal

K_SPRING, PUSH, NOISE = 40.0, (0.7, 0.3), (2e-3, 5e-3)


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


def test_accelerometers_feel_the_loads_that_push_the_robot():
    """NEES of 500 runs: a reading D w + noise and the next state have the load w in common.

    Chi-square, by the state after 300 samples; with every bound that one in 500 misses.
    """
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
