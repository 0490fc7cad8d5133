"""Motors behind compliant gears and patches on a path: against an independent planar prototype, and closed forms.

The numbers are those of ../shared/tracking_gears_notes.md, section 6: the soft strip of `test_tracking` with a gear.
"""

from dataclasses import replace

import numpy as np
import pytest
from patch_sets import amplifiers
from test_tracking import strip_scene
from tracked_arms import random_arm

import ffrobot
from ffrobot.mbs.inversion.motors_only import outcome_along
from ffrobot.mbs.inversion.servo import make_servo
from ffrobot.mbs.inversion.zero_dynamics import equilibrium, linearise
from ffrobot.mbs.model.gears import with_compliance
from ffrobot.mbs.model.known_motion import required_forces
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.quantities.supply import motor_moments
from ffrobot.mbs.run.gears import with_motor_coordinates
from ffrobot.mbs.tracking.advice import singular_times
from ffrobot.mbs.tracking.gear_motion import behind_gears
from ffrobot.mbs.tracking.geared import Gears, with_gears
from ffrobot.mbs.tracking.problem import graded, track
from ffrobot.mbs.tracking.tracking import _pose
from ffrobot.mbs.tracking.transition import Limits, Transition, Weights
from ffrobot.run.solve import prepare_scene, solve_scene
from ffrobot.run.watcher import Watcher

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")

INERTIA, ZETA = 0.05, 0.02  # kg·m², of the strip's rotor and the damping ratio of its gear


def gear(f):
    """Keys of a joint, for a gear with the frequency f (Hz) of its rotor."""
    K = INERTIA * (2 * np.pi * f) ** 2
    return {"rotor_inertia": INERTIA, "stiffness": K, "damping": 2 * ZETA * K / (2 * np.pi * f)}


class OneMode:
    """m p̈ + d ṗ + k p = f ÿ + b V, τ_s = A ÿ + β p̈, φ̈ = ÿ + γ p̈ for y = 1e-5 σ(t/0.1), σ of seventh degree."""

    m, d, k, f, b = -0.137651546149, 0.206722272026, 427.340977517, 0.264366315876, -0.00123900364914
    A, beta, gamma = 0.072, 0.0454723678125, 4.30331505123
    scale, mode_sizes, where, doubt = np.array([np.sqrt(k / -m)]), np.ones(1), "", ""

    def residuals(self, times, p, v, a):
        return self.m * a + self.d * v + self.k * p - self.f * self.acceleration(times)

    def acceleration(self, times):
        s = np.asarray(times)[:, None] / 0.1
        return 1e-5 / 0.1**2 * (420 * s**2 - 1680 * s**3 + 2100 * s**4 - 840 * s**5)

    def forces(self, times, p, v, a):
        y = self.acceleration(times)
        tau_s = self.A * y + self.beta * a
        return self.residuals(times, p, v, a), np.hstack([tau_s + INERTIA * (y + self.gamma * a), tau_s])

    def slopes(self, times, p, v, a):
        columns = [self.m, self.beta + INERTIA * self.gamma, self.beta], [self.d, 0.0, 0.0], [self.k, 0.0, 0.0]
        return tuple(np.broadcast_to(np.array(x)[None, :, None], (len(times), 3, 1)) for x in columns)

    def quasi_static(self, times, p):
        return 0 * p


@pytest.mark.parametrize(
    ("f", "J", "V"),
    [(10, 0.600174, (0.735006, 1.441963, -0.005720, -1.442344)),
     (20, 0.448077, (1.030954, 0.856156, -0.001961, -0.867326)),
     (50, 0.408954, (0.659630, 0.973251, -0.001201, -0.982756))],
)  # fmt: skip
def test_closed_form_of_one_mode(f, J, V):
    """Checkpoint 1: least ∫τ²/τ_ref² + V² without damping, by the matrix exponential of the Hamiltonian."""
    gears = Gears(("O",), np.array([0]), np.array([INERTIA * (2 * np.pi * f) ** 2]), np.zeros(1), np.array([INERTIA]))
    limits, rest = Limits(amplifiers(np.full(1, np.inf)), np.full(1, np.inf)), (np.zeros(1), np.zeros(1))
    asked = Transition(
        OneMode(), np.array([[OneMode.b]]), limits, Weights(1e-3, 1.0, 0.0), rest, is_free=True, gears=gears
    )
    found = track(asked, np.linspace(0.0, 0.1, 129))
    assert found.converged
    assert found.cost == pytest.approx(J, rel=1e-4)
    assert np.abs(found.voltage([0.01, 0.02, 0.05, 0.08])[:, 0] - V).max() < 2e-4 * np.abs(V).max()


def strip(modes, T, f):
    solution = prepare_scene(strip_scene(modes, T, of_hub=gear(f)), Watcher())
    servo = with_gears(make_servo(solution.model, T, lambda: True))
    return servo, servo.model.modal_directions(solution.patches["arm"].per_volt)[:, servo.of_modes].T


def asked(servo, Phi_V, span, V_max, tau_max=np.inf, tau_ref=1.0):
    limits = Limits(amplifiers(np.full(Phi_V.shape[1], V_max)), np.full(len(servo.model.motors), tau_max))
    rest = tuple(equilibrium(servo, t) for t in span)
    return Transition(servo, Phi_V, limits, Weights(tau_ref, 100.0, 0.002), rest, is_free=True, gears=servo.gears)


AT = np.array([0.1, 0.2, 0.35, 0.5])
FOUR = {
    "tau_s": (0.812573, 1.028428, -0.617160, -0.809785), "tau": (1.229580, 1.505355, -0.900783, -1.217956),
    "twist": (1.025673e-3, 1.304556e-3, -7.77239e-4, -1.029077e-3), "V": (86.22, 182.63, 199.99, 145.91),
}  # fmt: skip


def test_soft_strip():
    """Checkpoint 2, four modes, at its 128 intervals: costs, torques, twists."""
    tau_ref = 1.999503
    servo, Phi_V = strip(4, 0.6, 20)
    problem = asked(servo, Phi_V, (0.0, 0.6), 200.0, 1.2 * tau_ref, tau_ref)
    breaks = 0.3 * (1 + np.tanh(1.5 * np.linspace(-1, 1, 129)) / np.tanh(1.5))
    tracked = track(problem, breaks)
    assert tracked.converged
    assert tracked.cost == pytest.approx(0.8352893, rel=1e-2)
    moved = behind_gears(problem, tracked, 0.001)
    of_gear = moved.gears["O"]
    tau_s = servo.forces(AT, *(moved.curve(AT, k) for k in range(3)))[1][:, 1]
    for found, name in ((tau_s, "tau_s"), (of_gear.torque(AT), "tau"), (of_gear.twist(AT), "twist")):
        assert np.abs(found - FOUR[name]).max() < 1e-4 * np.abs(FOUR[name]).max(), name
    assert np.abs(moved.voltage(0.03) - FOUR["V"]).max() < 0.01 * 200


def test_stiff_gears_are_rigid():
    """At 1e5 Hz costs and voltages are those of a rigid gear with the same rotor, and torques but for 1e-6."""
    servo, Phi_V = strip(3, 0.6, 1e5)
    problem, breaks = asked(servo, Phi_V, (0.0, 0.6), 200.0), graded(0.0, 0.6, 64)
    rigid = replace(servo.gears, stiffness=np.array([np.inf]))
    stiff, stiffest = (track(replace(problem, gears=of), breaks) for of in (servo.gears, rigid))
    assert stiff.cost == pytest.approx(stiffest.cost, rel=1e-6)
    assert np.abs(stiff.voltage(breaks) - stiffest.voltage(breaks)).max() < 1e-3
    moved = behind_gears(problem, stiff, 0.001)
    tau = servo.forces(AT, *(moved.curve(AT, k) for k in range(3)))[1][:, 0]
    assert np.abs(moved.gears["O"].torque(AT) - tau).max() < 1e-6


def test_without_voltage_motors_alone_carry():
    """Checkpoint 5: V → 0 with 0.34 s before and after is stable inversion, then the gear: of `motors-only`, too."""
    before, at = 0.34, np.array([0.0, 0.03, 0.1, 0.2, 0.5])
    expected = np.array([0.287258, 0.561637, 1.250342, 1.505511, -1.245614])
    alone = {"kind": "motors-only", "output_step": 5e-4, "tolerance": 1e-7, "pre_actuation": before}
    scene = strip_scene(3, 0.6, of_hub=gear(20), post_actuation=before, **alone)
    run = solve_scene(scene, Watcher()).analyses["carried"].run
    moments = motor_moments(run)["O"][np.abs(run.time[:, None] - at).argmin(axis=0), 0]
    assert np.abs(moments - expected).max() < 2e-4  # a spline through outputs
    servo, Phi_V = strip(3, 0.6, 20)
    problem = replace(asked(servo, Phi_V, (-before, 0.6 + before), 1e-3), weights=Weights(1.0, 1e-3, 0.002))
    breaks = np.unique(np.concatenate([graded(-before, 0.0, 40), np.linspace(0, 0.6, 97), graded(0.6, 0.94, 40)]))
    tracked = track(problem, breaks)
    assert np.abs(tracked.voltage(breaks)).max() < 1e-5
    moved = behind_gears(problem, tracked, 0.001)
    off = moved.gears["O"].torque(at) - expected
    assert np.abs(off[1:]).max() < 1e-5
    assert abs(off[0]) < 2e-2  # where the fourth derivative of the path jumps, and that of p, a spline, does not


def test_twisting_rotors_push_the_links_that_carry_them():
    """The arm of 15 Hz whose replay was 0.5 µm off for J N δ̈: forces that links with gears need, in their equations.

    Also behind the path's end, where dampers bring gears to rest.
    """
    scene = ffrobot.make_scene(**random_arm(np.random.default_rng([62, 11]), 0.0)[1])
    solution = prepare_scene(scene, Watcher())
    posed = _pose(solution.model, solution.patches, scene.analysis[0], lambda: True)
    problem = replace(posed.asked, objective="effort")
    found = behind_gears(problem, track(problem, posed.coarse, within=1e-5), 0.001)
    lag = (problem.gears.damping / problem.gears.stiffness).max()
    at = np.append(0.5 * (posed.coarse[1:] + posed.coarse[:-1]), posed.coarse[-1] + lag * np.array([0.1, 0.5, 2, 9]))
    around_end, along = posed.coarse[-1] + np.array([-1e-9, 1e-9]), np.linspace(0.0, posed.coarse[-1], 999)
    for of in found.gears.values():  # a rate that jumps would take an impulse
        assert np.ptp(of.twist(around_end, 1)) < 1e-6 * np.abs(of.twist(along, 1)).max()
    run = outcome_along(found.curve, posed.asked.driven, scene.analysis[0], solution.model, None, at)
    moved = with_motor_coordinates(replace(run, twists=found.gears), with_compliance(solution.model))
    needed = required_forces(MultibodySystem(with_compliance(solution.model)), moved, at)
    modes, torques = posed.asked.driven.of_modes, [found.gears[name].torque(at) for name in problem.gears.joints]
    off = np.abs(needed[:, modes] - found.voltage(at) @ problem.Phi_V.T).max(axis=0)
    assert np.all(off < 1e-5 * np.abs(needed[:, modes]).max())
    assert np.abs(needed[:, -2:] - np.column_stack(torques)).max() < 1e-9 * np.abs(torques).max()


@pytest.mark.nightly
def test_finer_intervals_that_have_no_solution():
    """Two links, six modes and six patches each, whose det M changes its sign twice: 64 intervals have none.

    A smooth motion through the breaks of 32 is exact, since there are as many patches as modes.
    """
    tables = random_arm(np.random.default_rng([62, 2]), 0.0)[1]
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        wanted, found = (results[f"{name}/points/fore.tip/position"] for name in ("carried", "replay"))
        assert results.attributes("carried/tracking")["unmet"] < 1e-12
    assert np.abs(found - wanted).max() < 1e-7


@pytest.mark.parametrize(("tolerance", "expected"), [(0.0, [0.184, 0.878]), (1e-4, [])])
def test_zeros_that_a_rotor_takes_to_infinity(tolerance, expected):
    """det M_i of two links changes its sign by the rotor on the first one alone; times by masses along exact modes."""
    _, tables = random_arm(np.random.default_rng([62, 7]), tolerance)
    solution = prepare_scene(ffrobot.make_scene(**tables), Watcher())
    end = solution.scene.analysis[0].end
    servo = with_gears(make_servo(solution.model, end, lambda: True))
    linear = linearise(servo, end)
    np.testing.assert_allclose(linear.times[list(linear.singular_after)], expected, atol=linear.times[1])
    assert ["Reduce rotor_inertia of to_fore, or" in text for text in singular_times(servo, linear)] == [True][
        : len(expected)
    ]
