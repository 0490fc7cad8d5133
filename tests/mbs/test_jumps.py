"""Loads and accelerations of paths that jump or come and go: steps end before a jump, and none goes over a pulse."""

import numpy as np
import pytest
from links import arm
from mechanisms import forward, make_model, pcid, relative, revolute
from oracle_runs import joint_forces, run
from rods import rod

MASS, LENGTH, MOMENT = 2.0, 0.7, 3.0
INERTIA = MASS * LENGTH**2 / 3
METHODS = ("dop853", "dopri5", "radau")


def driven_rod(moment):
    """A rod hinged at its root, without gravity: φ̈ = M / I, which every method integrates without error."""
    joint = revolute("O", "ground", "a.root")
    load = {"joint": "O", "moment": moment}
    return make_model([rod("a", LENGTH, MASS)], joint=[joint], load=[load], gravity=(0.0, 0.0))


def free_run(model, **keys):
    outcome = run(model, forward(**keys))
    outcome.check_completed()
    return outcome


def angle_behind(jumps, time):
    """Angle after moments of MOMENT × size from each jump's time on."""
    return sum(size * MOMENT / INERTIA * np.maximum(time - t, 0) ** 2 / 2 for t, size in jumps)


@pytest.mark.parametrize("integrator", METHODS)
@pytest.mark.parametrize(
    "jumps",
    [
        [(0.50003, 1)],
        [(0.5, 1)],  # an output time
        [(0.5 - 2**-53, 1)],  # the last number before one
        [(1 / 3, 1), (0.75, -1)],
    ],
)
def test_moments_that_jump(jumps, integrator):
    """Closed form, to rounding at a loose tolerance."""
    moment = "+".join(f"({size * MOMENT})*where(t > {t!r}, 1, 0)" for t, size in jumps)
    outcome = free_run(driven_rod(moment), tolerance=1e-3, integrator=integrator)
    angle = angle_behind(jumps, outcome.time)
    assert relative(outcome.q[:, 2], angle) < 1e-12


def test_a_jump_beside_an_output():
    """Behind 0.35 and at 35 · 0.01, the next number: no step goes from one to the other."""
    outcome = free_run(driven_rod(f"where(t > 0.35, {MOMENT}, 0)"), tolerance=1e-8, integrator="radau")
    assert relative(outcome.q[:, 2], angle_behind([(0.35, 1)], outcome.time)) < 1e-12


def test_a_jump_costs_a_search():
    """Some fifty evaluations, not a walk towards it: DOP853 takes eleven a step."""
    free = free_run(driven_rod(f"{MOMENT}"), tolerance=1e-6, integrator="dop853")
    jumps = free_run(driven_rod(f"{MOMENT}*where(t > 0.50003, 2, 1)"), tolerance=1e-6, integrator="dop853")
    assert jumps.statistics.evaluations < free.statistics.evaluations + 250


@pytest.mark.parametrize("integrator", METHODS)
def test_flexible_arm_that_is_switched_on(integrator):
    """All forces at every output, at jumps in several places between outputs."""
    for t in np.random.default_rng(13).uniform(0.2, 0.8, 2):
        model = arm(trajectory=[], load=[{"joint": "O", "moment": f"where(t > {float(t)!r}, 20, 0)"}])
        exact = free_run(model, tolerance=1e-10, integrator="dop853")
        outcome = free_run(model, tolerance=1e-7, integrator=integrator)
        for joint in "OA":
            forces = [joint_forces(each, joint).reaction for each in (outcome, exact)]
            assert relative(*forces) < 1e-7


def test_acceleration_of_a_path_that_jumps():
    """Between two integrators of different order."""
    path = {"name": "tip", "point": "link2.tip", "x": "1.2+where(t > 0.50003, (t-0.50003)**2, 0)", "y": "0.9"}
    model = arm(trajectory=[path], initial={"angles": {"link1": -0.2, "link2": 1.4}})
    one, other = (run(model, pcid(tolerance=1e-7, integrator=name)) for name in ("dop853", "radau"))
    assert relative(one.lambda_, other.lambda_) < 2e-7


# Parts of the run; the shortest spans two of the thousand samples by which steps are limited.
@pytest.mark.parametrize("width", [0.002, 0.02, 0.1])
@pytest.mark.parametrize("integrator", [*METHODS, "generalized-alpha"])
def test_moments_that_come_and_go_while_nothing_moves(integrator, width):
    """The error estimate of a step over a pulse sees nothing: its stages stand beside it.

    Nor over a hump M sin², as smooth as loads get; the speed behind it is M/I times half its width.
    """
    close = 1e-3 if integrator == "generalized-alpha" else 1e-12
    for begin in np.random.default_rng(8).uniform(0.2, 0.8, 3):
        begin, end = float(begin), float(begin + width)
        within = f"where(t > {begin!r}, where(t <= {end!r}, {MOMENT}*{{}}, 0), 0)"
        pulse = free_run(driven_rod(within.format("1")), tolerance=1e-3, integrator=integrator)
        assert relative(pulse.q[:, 2], angle_behind([(begin, 1), (end, -1)], pulse.time)) < close
        if width > 0.002:
            of_hump = within.format(f"sin(pi*(t-{begin!r})/{width!r})**2")
            hump = free_run(driven_rod(of_hump), tolerance=1e-3, integrator=integrator)
            assert hump.v[-1, 2] == pytest.approx(MOMENT / INERTIA * width / 2, rel=1e-3)


@pytest.mark.parametrize("integrator", ["dop853", "radau"])
def test_a_train_of_pulses(integrator):
    """Of a moment that the sine of a kilohertz switches, a third of the time: all pulses count, no sample sees them."""
    outcome = free_run(driven_rod(f"where(sin(2000*pi*t) > 0.5, {MOMENT}, 0)"), tolerance=1e-3, integrator=integrator)
    assert outcome.v[-1, 2] == pytest.approx(outcome.time[-1] / 3 * MOMENT / INERTIA, rel=1e-8)


def test_steep_load_is_no_jump():
    """Steps go through it; its integral is that of a jump."""
    outcome = free_run(driven_rod(f"{MOMENT}*(1+tanh((t-0.5)/1e-5))/2"), tolerance=1e-8, integrator="dop853")
    assert outcome.v[-1, 2] == pytest.approx(0.5 * MOMENT / INERTIA, rel=1e-8)
