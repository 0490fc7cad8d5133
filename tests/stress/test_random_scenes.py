"""Scenes at random: what holds for every mechanism holds for each of them."""

import numpy as np
import tree_oracle
import zoo
from body_equations import accelerated, given_forces, required_forces
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle_runs import energies, evaluated, posture_of, random_tree_state

from ffrobot.mbs.quantities.motion import constraint_rows

random_scenes = settings.get_profile("scenes")
T = 0.37
POWER = 1e-5


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
    assert abs(rate - power) / max(terms + rounding / POWER, 1e-300) < POWER
