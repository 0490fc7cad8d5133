"""Scenes at random: what holds for every mechanism holds for each of them."""

import numpy as np
import tree_oracle
import zoo
from body_equations import accelerated, given_forces, required_forces
from hypothesis import example, given, settings
from hypothesis import strategies as st
from links import arm, quintic, ritz_link
from mechanisms import forward, pcid, relative
from oracle_runs import energies, evaluated, posture_of, random_tree_state, run
from patch_sets import FULL
from prescribed_oracle import residuals

from ffrobot.mbs.quantities.motion import constraint_rows

random_scenes = settings.get_profile("scenes")
T = 0.37
BOUNDS = {"residual": 1e-10, "power": 1e-5, "round_trip": 1e-6}


@st.composite
def systems(draw):
    """Any mechanism of the zoo with bodies, state and gravity of its own, and the size of its deformation."""
    name = draw(st.sampled_from(sorted(zoo.ALL)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    gravity = tuple(draw(st.lists(st.floats(-20, 20), min_size=2, max_size=2)))
    robot = zoo.ALL[name](rng, gravity=gravity)
    modal, speed = draw(st.sampled_from([1e-6, 0.01, 0.1])), draw(st.sampled_from([0.0, 1.0, 30.0]))
    q, v = random_tree_state(rng, robot, modal=modal)
    if robot.model.loop_rows.any():  # equations say nothing of open loops
        q, v = posture_of(robot, rng, modal)
    return robot, q, speed * v


@random_scenes
@given(systems())
def test_accelerations_are_those_of_the_equations(system):
    """By the equations of each body and rows in NumPy, by the residual: conditioning is the scene's."""
    robot, q, v = system
    assert max(residuals(evaluated(robot, T, q, v).motion)) < BOUNDS["residual"]


@random_scenes
@given(systems())
def test_power_is_the_rate_of_energy(system):
    """d(energy)/dt along the motion = power of loads and of what follows paths − dissipation, at any state.

    By central differences along q + v s + a s²/2 of the tree; forces and rows from the readable equations.
    """
    robot, q, v = system
    found = evaluated(robot, T, q, v)
    a = found.outcome.a[0]
    h = 1e-6 / max(1.0, np.abs(v).max(), np.abs(a).max())

    def energy(s):
        parts = np.ravel(list(energies(evaluated(robot, T, q + s * v + s**2 / 2 * a, v + s * a)).values()))
        return parts[:3].sum(), np.abs(parts[:3]).sum(), parts[3]

    rate = (energy(h)[0] - energy(-h)[0]) / (2 * h)
    motion, power = found.motion, -energy(0.0)[2]
    given = given_forces(motion.model, motion.q, tree_oracle.frames(motion.model.tree, motion.q), motion.time)[0]
    power += given @ v - motion.multipliers[0] @ constraint_rows(motion)[1][0] @ v
    terms = np.abs(v) @ np.abs(required_forces(motion.model, accelerated(motion), motion.time)[0] + given) + abs(power)
    rounding = 1e-15 * energy(0.0)[1] / h  # of the differences; allowed beside the bound on the rest
    assert abs(rate - power) / max(terms + rounding / BOUNDS["power"], 1e-300) < BOUNDS["power"]


@settings(random_scenes, max_examples=6)
@given(st.integers(0, 2**32 - 1))
@example(42986)  # an equilibrium that is found as loads grow alone: links sag by a quarter of their length
def test_forward_follows_inverse(seed):
    """PCID → forward with all of the actuation: round trip, on arms of random links and ways."""
    rng = np.random.default_rng(seed)
    links = [
        ritz_link(
            name, condition, rng.uniform(0.5, 2), rng.uniform(0.3, 3), 10 ** rng.uniform(1.5, 3), damping_ratio=0.01
        )
        for name, condition in (("link1", "simply-supported"), ("link2", "cantilever"))
    ]
    first, second = rng.uniform(-1, 1), rng.uniform(0.5, 2)
    angles = {"link1": first, "link2": first + second}
    tip = sum(link.length * np.exp(1j * angle) for link, angle in zip(links, angles.values(), strict=True))
    end = tip * (1 - 0.2 * rng.uniform(0, 1)) * np.exp(0.3j * rng.standard_normal())
    path = {"name": "tip", "point": "link2.tip", "x": quintic(tip.real, end.real), "y": quintic(tip.imag, end.imag)}
    model = arm(links, trajectory=[path], initial={"angles": angles, "state": "static"})
    inverse = run(model, pcid(tolerance=1e-6))
    replay = run(model, forward(tolerance=1e-6, actuation="inverse", apply="joints+pzt"), inverse, FULL)
    inverse.check_completed()
    replay.check_completed()
    assert relative(replay.q, inverse.q) < BOUNDS["round_trip"]
