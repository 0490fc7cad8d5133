"""Margins of sampled joint loops against closed forms and simulated boundaries; suggested gains on random arms."""

from dataclasses import replace

import numpy as np
import pytest
from beam_links import beam_link, tube
from loop_scenes import INERTIA, T, loop, wheel
from scipy.linalg import expm

from ffrobot.actuation.control.linear_model import LinearModel, locked_frequencies
from ffrobot.actuation.control.margins import (
    FRACTION,
    joint_gains,
    joint_inertia,
    light_roots,
    loop_eigenvalues,
    lowest_frequency,
    margins,
    spectral_radius,
    suggested_gains,
)
from ffrobot.actuation.control.records import JointPid
from ffrobot.actuation.control.sampled_model import sampled
from ffrobot.results.file import Results
from ffrobot.results.write import results_image
from ffrobot.run.solve import solve_scene
from ffrobot.scene.load import make_scene

LINEAR = {"name": "linear", "kind": "linear"}


def models(scene):
    """The linear models of the analysis "linear"."""
    return solve_scene(scene).outcomes["linear"].details.models


def pid(P=0.0, D=0.0, integral=0.0, joint="O", rate="measured"):
    gains = {"proportional": {joint: P}, "derivative": {joint: D}, "integral": {joint: integral}}
    return JointPid(kind="joint-pid", rate=rate, **gains)


def links(rng, count, payload, rotors, analysis, modes=3, **keys):
    """An arm of `count` tubes of random sizes and directions, geared motors with `rotors` (kg·m², at the joint)."""
    bodies, joints, before = [], [], "ground"
    for k in range(count):
        outer, length = rng.uniform(0.015, 0.04), rng.uniform(0.3, 0.8)
        kept = {"count": modes, "family": "in-plane-bending"}
        link = beam_link(length, tube(outer, 0.85 * outer), 10, nu=None, modes=kept, damping={"ratio": 0.01})
        bodies.append({"name": f"a{k}", "link": link})
        rotor = {"rotor_inertia": rotors[k]} if rotors[k] else {}
        joints.append({"name": f"J{k}", "type": "revolute", "between": [before, f"a{k}.root"]} | rotor)
        before = f"a{k}.tip"
    angles = {f"a{k}": float(rng.uniform(-2.0, 2.0)) for k in range(count)}
    return make_scene(
        name="arm", gravity=[0.0, 0.0], body=bodies, joint=joints, initial={"angles": angles},
        payload=[{"point": before, "mass": payload}], analysis=analysis, **keys,
    )  # fmt: skip


def test_margins_of_an_inertia_are_those_of_the_closed_form():
    """det(z I − F) of the sampled double integrator: stable for D > P T/2 and D < 2 I/T (Jury)."""
    plants = models(wheel(LINEAR))
    for P, D in ((20.0, 4.0), (300.0, 10.0)):
        found = margins([(plants[0], joint_gains(plants[0], [pid(P, D)], T))], T, 0.0)
        assert found.is_stable
        assert found.gain == pytest.approx(2 * INERTIA / (D * T), rel=2e-3)
    slack = margins([(plants[0], joint_gains(plants[0], [pid(400.0, 1.9)], T))], T, 0.0)
    assert not slack.is_stable
    assert (slack.gain, slack.delay) == (0.0, 0.0)  # no factor helps: D < P T/2


def test_vibrations_that_samples_miss_are_not_taken_for_slow_ones():
    """A wheel on P and D, ω² = P/I, beside what vibrates unmoved by motors: at 0.3 Hz above the sampling frequency."""
    P, omega = 20.0, 2 * np.pi * (1 / T + 0.3)
    A, B, C = np.zeros((4, 4)), np.zeros((4, 1)), np.zeros((1, 4))
    A[:2, 2:], A[3, 1], A[3, 3], B[2, 0], C[0, 0] = np.eye(2), -(omega**2), -1e-4 * omega, 1 / INERTIA, 1.0
    names = ("joint/O", "modal/a/1")
    states = (*names, *(f"rate of {name}" for name in names))
    D, mass = np.zeros((1, 1)), np.diag([INERTIA, 1.0])
    model = LinearModel(A, B, C, D, states, ("joint/O",), ("joint/O",), 0.0, mass, np.eye(2))
    found = lowest_frequency([model], [pid(P, 0.2)], T, 0.0)
    assert found == pytest.approx(np.sqrt(P / INERTIA) / (2 * np.pi), rel=0.01)


def test_delay_margin_of_a_fast_sampled_loop_is_that_of_the_continuous_one():
    """L = (P + D s) e^{−s d}/(I s²): the delay that takes the phase margin, less half a sample that holding costs."""
    plants, fast, P, D = models(wheel(LINEAR)), 0.004, 20.0, 4.0
    omega = np.sqrt((D**2 + np.sqrt(D**4 + 4 * P**2 * INERTIA**2)) / (2 * INERTIA**2))  # |L| = 1
    phase = np.arctan2(D * omega, P)
    found = margins([(plants[0], joint_gains(plants[0], [pid(P, D)], fast))], fast, 0.0)
    assert found.delay == pytest.approx(phase / omega - fast / 2, rel=5e-3)  # holding is T/2 to (ωT)²/12 = 1e-4


def test_of_a_delay_of_many_samples_stability_alone_is_known():
    """The slowest root of I s² + (P + D s) e^{−s (d + T/2)} = 0, by Newton's method: holding is a delay of T/2."""
    P, D, delay, fast = 0.5, 1.0, 0.3, 1e-3
    s, late = -0.3 + 0.3j, delay + fast / 2
    for _ in range(20):
        value = INERTIA * s**2 + (P + D * s) * np.exp(-s * late)
        s -= value / (2 * INERTIA * s + (D - late * (P + D * s)) * np.exp(-s * late))
    plant = models(wheel(LINEAR))[0]
    found = margins([(plant, joint_gains(plant, [pid(P, D)], fast))], fast, delay)
    assert np.log(found.radius) / fast == pytest.approx(s.real, rel=1e-4)
    assert found.is_stable
    assert np.isnan([found.gain, found.delay]).all()


def test_amplifiers_are_in_the_loop():
    """A lag is a state, V' = (u − V)/τ, a delay of the amplifier one more of the loop; of two inputs each its own."""
    plant, tau = models(wheel(LINEAR))[0], 0.7 * T
    gains = joint_gains(plant, [pid(20.0, 4.0)], T)
    slow = np.block([[plant.A, plant.B], [np.zeros((1, 2)), -np.ones((1, 1)) / tau]])
    both = np.block([[slow, np.array([[0.0], [0.0], [1 / tau]])], [np.zeros((1, 4))]])
    step = expm(both * T)
    expected = step[:3, :3] + step[:3, 3:] @ np.array([[-20.0, -4.0, 0.0]])
    found = loop_eigenvalues(plant, replace(gains, late=np.array([[tau], [0.0]])), T, 0.0)
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(np.linalg.eigvals(expected)), atol=1e-10)
    late = loop_eigenvalues(plant, replace(gains, late=np.array([[0.0], [1.3 * T]])), T, 0.5 * T)
    np.testing.assert_allclose(np.abs(late).max(), spectral_radius(plant, gains, T, 1.8 * T), rtol=1e-10)
    two = np.hstack([plant.B, 3.0 * plant.B])
    model, (single, waiting) = (
        sampled(plant.A, two, T, np.array([0.0, T])),
        (sampled(plant.A, column, T, delay) for column, delay in ((two[:, :1], 0.0), (two[:, 1:], T))),
    )
    x = np.random.default_rng(0).standard_normal(4)  # the state, and both inputs a sample ago
    u = np.array([1.0, -2.0])
    alone = single.A @ x[:2] + single.B[:, 0] * u[0] + (waiting.A @ np.append(0.0 * x[:2], x[3]))[:2]
    np.testing.assert_allclose((model.A @ x + model.B @ u)[:2], alone, rtol=1e-12)


def blown(gains, rotor, kick, *analyses, end, modes, **keys):
    """Solution of the nonlinear loop of an arm about rest, from a small blow on the tip."""
    disturbance = [{"point": "a0.tip", "y": f"where(t <= 0.01, {kick}, 0)"}]
    control = loop(actuation="rest", controller=[{"kind": "joint-pid"} | gains], disturbance=disturbance, **keys)
    rest = {"name": "rest", "kind": "pcid", "end": end, "output_step": 0.01}
    path = [{"name": "still", "joint": "J0", "value": "0.3"}]
    of_arm = np.random.default_rng(3), 1, 0.2, [rotor], [rest, *analyses, control], modes
    return solve_scene(links(*of_arm, trajectory=path))


@pytest.mark.parametrize("seed", range(24))
def test_suggested_gains_are_stable_on_random_arms(seed):
    """Of one to three links, with and without rotors: by the linear model, twice the gains too."""
    rng = np.random.default_rng(seed)
    count, sample_time = int(rng.integers(1, 4)), float(rng.choice([5e-4, 1e-3, 2e-3]))
    delay = float(rng.choice([0.0, 0.5, 1.0]) * sample_time)
    rotors = [float(rng.choice([0.0, 0.01, 0.1])) if seed % 2 else 0.03 for _ in range(count)]
    plants = models(links(rng, count, float(rng.uniform(0.1, 2.0)), rotors, [LINEAR]))
    suggestion = suggested_gains(plants, sample_time, delay)
    if suggestion is None:
        assert 0.0 in rotors  # roots without inertia leave no gain that is stable
        return
    record = JointPid(kind="joint-pid", proportional=suggestion.proportional, derivative=suggestion.derivative)
    for factor in (1.0, 2.0):
        gains = joint_gains(plants[0], [record], sample_time).times(factor)
        assert max(spectral_radius(plant, gains, sample_time, delay) for plant in plants) < 1.0


def test_suggested_gains_hold_the_simulated_arm():
    """Those of the linear analysis, at the sample time that it names; its bandwidth is the third that it says."""
    rng = np.random.default_rng(5)
    (plant,) = models(links(rng, 1, 0.2, [0.05], [LINEAR]))
    solution = solve_scene(links(np.random.default_rng(5), 1, 0.2, [0.05], [LINEAR]))
    details = solution.outcomes["linear"].details
    suggestion, sample_time = details.suggested
    J = joint_inertia(plant)[0, 0]
    omega = 2 * np.pi * suggestion.bandwidth
    assert suggestion.proportional["J0"] == pytest.approx(J * omega**2, rel=0.05)  # two digits
    assert suggestion.derivative["J0"] == pytest.approx(2 * J * omega, rel=0.05)
    text = Results.from_image(results_image(solution), solution.scene.path).verdict["linear"].advice[0]
    assert f"sampled every {1e3 * sample_time:g} ms or faster" in text
    assert f"proportional = {{ J0 = {suggestion.proportional['J0']:.2g} }}" in text
    (lowest, *_) = locked_frequencies(plant)
    assert suggestion.bandwidth == pytest.approx(FRACTION * lowest, rel=1e-9)


def test_a_loop_that_diverges_says_why_and_what_to_start_with():
    """No rotor, gains for the rigid arm: the root of the link turns at once. With the gains it names it is stable."""

    def arm(P, D):
        gains, linear = {"proportional": {"J0": P}, "derivative": {"J0": D}}, LINEAR | {"about": "rest", "times": [0.0]}
        return blown(gains, 0.0, 0.01, linear, end=3.0, modes=3, sample_time=0.001)

    solution = arm(500.0, 50.0)
    record = solution.outcomes["loop"].details
    assert record.metrics.verdict == "diverges"
    assert record.margins.radius > 1.0 > record.margins.gain
    advice = Results.from_image(results_image(solution), solution.scene.path).verdict["loop"].advice
    assert any("J0: negligible rotor_inertia" in text for text in advice)
    assert light_roots(solution.outcomes["linear"].details.models) == ["J0"]
    (start,) = [text for text in advice if text.startswith("start with ")]
    P, D = (float(start.split(f"{what} = {{ J0 = ")[1].split(" }")[0]) for what in ("proportional", "derivative"))
    assert arm(P, D).outcomes["loop"].details.metrics.verdict == "stable"
