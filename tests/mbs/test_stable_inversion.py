"""Inverse dynamics with motors only: against closed forms, a linear inverse by FFT, and forward runs."""

from dataclasses import replace

import numpy as np
import pytest
from links import TIP, arm, arm_links, quintic, ritz_link
from mechanisms import forward, make_model, relative, revolute
from numpy.polynomial import Polynomial
from oracle_runs import run
from tree_oracle import row_values

from ffrobot.common.errors import InputError, SolveError
from ffrobot.mbs.inversion import stable_inversion
from ffrobot.mbs.inversion.motors_only import MotorsOnly, is_minimum_phase
from ffrobot.mbs.inversion.servo import make_servo
from ffrobot.mbs.inversion.zero_dynamics import (
    LinearDynamics,
    Linearisation,
    equilibrium,
    is_unstable,
    linear_dynamics,
)

C = np.sqrt(30.0)  # √(EI/ρA)/L² of `ritz_link`, 1/s


def motors_only(**keys):
    return MotorsOnly(**({"name": "inverse", "kind": "motors-only", "end": 1.0, "output_step": 0.01} | keys))


def single_link(path, modes=4, damping_ratio=0.0, **keys):
    """One link on a motor at the origin, its tip on `path`(t) along y; no gravity."""
    tables = {
        "joint": [revolute("O", "ground", "link.root")],
        "trajectory": [{"name": "tip", "point": "link.tip", "y": path}],
        "gravity": (0.0, 0.0),
    }
    link = ritz_link("link", "cantilever", modes=modes, damping_ratio=damping_ratio, extra=4)
    return make_model([link], **(tables | keys))


def at_rest(model, factor=1.0):
    """The equations of motors only with the robot at rest at t = 0: output, M, D and K."""
    servo = replace(make_servo(model.model, 1.0, lambda: True), factor=factor)
    p, rest = equilibrium(servo, 0.0), np.zeros((1, len(servo.scale)))
    return servo, linear_dynamics(servo, np.zeros(1), p[None], rest, rest)


def off_path(outcome):
    """How far (T, components) points, joints and angles themselves are from their path."""
    times = np.clip(outcome.time, 0.0, outcome.analysis.end)
    return row_values(outcome.robot.model, outcome.outcome.q, times)[0]


def exact_forward(model, outcome, **keys):
    """The motors' moments without the path."""
    analysis = forward(actuation="inverse", apply="joints", **keys)
    replayed = run(model, analysis, outcome)
    assert replayed.status == "completed"
    return replayed


def slowest_first(s):
    return s[np.argsort(np.abs(s), kind="stable")]


def test_zeros_of_a_uniform_beam():
    """sin z + sinh z = 0 for hub moment to tip: s = ±2η² √(EI/ρA)/L² with tan η = −tanh η (Kanoh 1990).

    η = 2.36502, 5.49780: the second roots are those of tan η = −1 to 1e-5.
    """
    servo, dynamics = at_rest(single_link("0*t", modes=10))
    s = slowest_first(Linearisation(dynamics, None, servo.scale).zeros[0])
    expected = 2 * np.array([2.36502037, 5.49780388]) ** 2 * C
    np.testing.assert_allclose(s.imag[:2], 0, atol=1e-6)
    np.testing.assert_allclose(np.sort(s.real[:2]), [-expected[0], expected[0]], rtol=1e-3)
    np.testing.assert_allclose(np.sort(s.real[2:4]), [-expected[1], expected[1]], rtol=2e-2)


def test_zeros_of_joint_motion_are_the_frequencies_with_the_joint_locked():
    """factor = 0 asks for a motion of the hub: what is left is the cantilever of the link itself, s = ±iω."""
    servo, dynamics = at_rest(single_link("0*t"), factor=0.0)
    s = slowest_first(Linearisation(dynamics, None, servo.scale).zeros[0])
    assert np.all(np.abs(s.real) < 1e-6 * np.abs(s))
    np.testing.assert_allclose(np.sort(s.imag)[4:], servo.scale, rtol=1e-6)


def smooth_step():
    """The polynomial from 0 at 0 to 1 at 1 with six derivatives zero at both."""
    bell = Polynomial.fromroots([0.0] * 6 + [1.0] * 6).integ()
    return bell / bell(1.0)


def tip_per_moment(body, omega):
    """G(iω) of a link on a hub, linear: from its invariants alone."""
    n, h = body.n_modes, body.spin[2]
    M = np.block([[np.atleast_2d(body.inertia[2, 2]), h[None]], [h[:, None], np.eye(n)]])
    K, D = np.zeros((2, n + 1, n + 1))
    K[1:, 1:], D[1:, 1:] = np.diag(body.stiffness), body.damping
    T = np.array([1.0, *body.points["root"].rotation[2]])
    y = np.array([body.points["tip"].position[0], *body.points["tip"].translation[1]])
    return np.array([y @ np.linalg.solve(K - w**2 * M + 1j * w * D, T) for w in omega])


def test_moment_of_a_single_link_is_the_linear_inverse_in_the_frequency_domain():
    """τ(ω) = ÿ(ω) / (−ω² G(ω)), G from moment to tip of the linear link, by FFT (Bayo 1987).

    G comes from the link's invariants alone. Tip path of 0.1 mm: the equations are linear to 1e-8.
    """
    f, size = smooth_step(), 1e-4
    path = f"{size}*(" + "+".join(f"({float(c)!r})*t**{k}" for k, c in enumerate(f.coef) if c) + ")"
    model = single_link(path, damping_ratio=0.01)
    outcome = run(model, motors_only(tolerance=1e-8, output_step=1 / 128))
    assert outcome.status == "completed"

    t = np.arange(-4 * 2048, 4 * 2048) / 2048
    acceleration = np.where((t > 0) & (t < 1), size * f.deriv(2)(t), 0.0)
    omega = 2 * np.pi * np.fft.rfftfreq(len(t), t[1] - t[0])[1:]
    moment = np.fft.rfft(acceleration)[1:] / (-(omega**2) * tip_per_moment(model.bodies[0], omega))
    tau = np.fft.irfft([0.0, *moment], len(t))  # ÿ has no mean
    expected = tau[np.round((outcome.time + 4) * 2048).astype(int)]
    assert relative(outcome.tau[:, 0], expected) < 1e-7


def test_actuation_begins_before_the_path_and_ends_after_it():
    """Pre-actuation is long enough for the slowest zero, and what is left at its start is told."""
    carried = run(arm(), motors_only())
    pre, post = carried.details.pre_actuation, carried.details.post_actuation
    assert carried.time[0] == -pre < -0.1
    assert carried.time[-1] == pytest.approx(1 + post)
    assert carried.details.inversion.off_rest < 1e-9
    before = carried.time < -1e-9
    assert np.abs(carried.tau[before] - carried.tau[0]).max() > 0.01 * np.abs(np.ptp(carried.tau, axis=0)).max()
    s = carried.details.inversion.linearisation.zeros[0]
    assert is_unstable(s).sum() == 6  # as many zeros grow as decay


def test_path_that_ends_far_from_where_it_began():
    """Newton's method goes from the initial angles to another posture; a load changes before and after the path."""
    path = {"name": "tip", "point": "link2.tip", "x": quintic(1.6, 1.0, 2.0), "y": quintic(-0.4, 1.2, 2.0)}
    load, initial = [{"point": "link2.tip", "y": "0.3*t+0.1"}], {"angles": {"link1": 0.4, "link2": -0.8}}
    model = arm(arm_links(EI=300.0), trajectory=[path], gravity=(0.0, 0.0), initial=initial, load=load)
    outcome = run(model, motors_only(end=2.0))
    assert outcome.status == "completed"
    replayed = exact_forward(model, outcome)
    assert np.abs(off_path(replayed)).max() < 1e-7


def test_redefined_output_is_minimum_phase_and_tells_what_is_left():
    """The motors alone bring the tip as near as reported, and the largest factor is taken that is minimum phase."""
    model = arm(arm_links(damping_ratio=0.01, modes=2))
    outcome = run(model, motors_only(output="redefined"))
    assert outcome.status == "completed"
    assert is_minimum_phase(outcome.details.inversion.linearisation)
    factor = outcome.details.inversion.servo.factor
    assert 0.5 < factor < 1.0
    left = np.abs(off_path(outcome))
    assert 1e-4 < left.max() < 0.05  # m, of a path of 1 m
    assert left[0].max() < 1e-6  # at rest nothing is left
    (told,) = outcome.statistics.warnings
    assert told.endswith(f" is off by up to {1e3 * left.max():.3g} mm")
    replayed = exact_forward(model, outcome)
    same = np.abs(off_path(replayed))
    np.testing.assert_allclose(same, left, atol=1e-6)
    with pytest.raises(InputError, match=r"minimum phase.*right half plane"):
        run(model, motors_only(output="redefined", factor=min(0.99, factor + 0.1)))


def test_joint_trajectories_need_no_future():
    """A specified joint angle is collocated with its motor: integrated forward from rest, without pre-actuation."""
    path = [{"name": "swing", "joint": "O", "value": quintic(0, 1)}]
    model = single_link("0*t", damping_ratio=0.02, trajectory=path)
    outcome = run(model, motors_only())
    assert outcome.status == "completed"
    assert outcome.time[0] == 0.0
    assert is_minimum_phase(outcome.details.inversion.linearisation)
    replayed = exact_forward(model, outcome)
    assert np.abs(off_path(replayed)).max() < 1e-6


RAMP = quintic(0, 0.1)
REFUSED = {
    r'trajectory "tip": y: .* at rest at t = 0 s.*found the rate 0.3': lambda: single_link("0.3*t*(1-t)**2"),
    r"at rest at t = 1 s.*found the rate 0.6": lambda: single_link("0.3*t**2"),
    r"as many motors as .* \(1\), found 0": lambda: single_link(
        RAMP, joint=[revolute("O", "ground", "link.root", motor=False)]
    ),
    r"trajectory components .* \(2\), found 1": lambda: arm(
        trajectory=[{"name": "tip", "point": "link2.tip", "y": "0.5+0*t"}]
    ),
    r"load no. 1: y: expected a finite value during the whole run, found none at t = -0\.\d+ s": lambda: single_link(
        RAMP, load=[{"point": "link.tip", "y": "0.1*sqrt(t)"}]
    ),
    r'at least one flexible body.*kind = "pcid"': lambda: single_link(RAMP, modes=0),
}


@pytest.mark.parametrize("says", REFUSED)
def test_what_motors_alone_cannot_do_is_refused(says):
    with pytest.raises(InputError, match=says):
        run(REFUSED[says](), motors_only())


def in_a_hurry(EI):
    """The arm of the other tests, softer, and its path in 0.3 s instead of one."""
    path = {"name": "tip", "point": "link2.tip", "x": quintic(TIP[0], 0.4, 0.3), "y": quintic(TIP[1], 1.5, 0.3)}
    return arm(arm_links(EI=EI), trajectory=[path])


def test_links_too_soft_for_their_path_are_named():
    with pytest.raises(SolveError, match=r"motor torques alone cannot follow the path at t = 0\.\d+ s.*too soft"):
        run(in_a_hurry(EI=3.0), motors_only(end=0.3))


def test_failed_inversion_keeps_what_it_found(monkeypatch):
    """A mesh that may not get fine enough: status, advice, and the motion as far as it was found."""
    monkeypatch.setattr(stable_inversion, "MOST_INTERVALS", 80)
    outcome = run(arm(), motors_only(tolerance=1e-9))
    assert outcome.status == "mesh too coarse"
    assert len(outcome.time) > 100
    assert np.all(np.isfinite(outcome.tau))
    with pytest.raises(SolveError, match=r"[Aa]dd damping, leave out high modes"):
        outcome.check_completed()


def along(M, D, K, scale):
    """The zero dynamics of two uncoupled modes with these diagonals (N, 2) at N times of a second."""
    times = np.linspace(0.0, 1.0, len(M))
    M, D, K = (np.einsum("ki,ij->kij", np.asarray(x, dtype=float), np.eye(2)) for x in (M, D, K))
    return Linearisation(LinearDynamics(times, M, D, K), np.zeros((len(times), 2)), np.array(scale))


@pytest.mark.parametrize(("growth", "future"), [(0.5, False), (2.0, False), (4.0, True)])
def test_light_vibrations_that_cross_the_axis_are_of_the_past_until_they_grow_too_far(growth, future):
    """Re s = −D/2M rises from −1, so that ∫ Re s dt = growth; ln(|s| T/100) is 2.3."""
    t = np.linspace(0.0, 1.0, 33)
    real = -1.0 + 2 * (growth + 1.0) * t
    M, D = np.ones((33, 2)), np.column_stack([-2 * real, 0 * t])
    linear = along(M, D, np.tile([1e6, -4e4], (33, 1)), [1e3, 2e2])
    is_vibration = np.abs(linear.zeros.imag) > 1.0
    assert is_unstable(linear.zeros[-1][is_vibration[-1]]).all()
    assert not is_unstable(linear.zeros[0][is_vibration[0]]).any()
    assert (linear.is_future[is_vibration] == future).all()
    np.testing.assert_array_equal(linear.is_future[~is_vibration], linear.zeros[~is_vibration].real > 0)


def test_conjugate_zeros_belong_to_the_same_side():
    """p̈ + 2 ζ ṗ + k p = 0, k from −100 to 100 1/s²: zeros at ±10 1/s meet and become a light vibration at ±10i 1/s."""
    times = np.linspace(0.0, 1.0, 41)
    M, D = np.ones((41, 1, 1)), np.full((41, 1, 1), 0.02)
    K = np.linspace(-100.0, 100.0, 41)[:, None, None]
    linear = Linearisation(LinearDynamics(times, M, D, K), np.zeros((41, 1)), np.array([10.0]))
    np.testing.assert_array_equal(linear.is_future[0], linear.zeros[0].real > 0)
    assert linear.is_future[0].sum() == 1
    assert not linear.is_future[-1].any()
