"""Scenes at random: what holds for every mechanism holds for each of them."""

import numpy as np
import zoo
from hypothesis import given, settings
from hypothesis import strategies as st
from links import arm, quintic, ritz_link
from mechanisms import forward, oracle_of, pcid, relative
from oracle_runs import energies, evaluated, posture_of, random_tree_state, run
from patch_sets import FULL

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
    """Against the augmented system M q̈ + C_qᵀ λ = Q, C_q q̈ = γ, by its residual: conditioning is the scene's."""
    robot, q, v = system
    found = evaluated(robot, T, q, v)
    oracle, q, v, a = oracle_of(found.assembly), found.q[0], found.v[0], found.a[0]
    rows, is_path = oracle.rows(q, v), np.array(found.assembly.is_trajectory, dtype=bool)
    C_q = np.array([row.gradient for row in rows]).reshape(-1, len(q))
    gamma = np.array([target(T)[2] - row.bias for row, (_, target) in zip(rows, oracle.constraints, strict=True)])
    M, Q = oracle.mass_matrix(q), oracle.forces(T, q, v)
    left = M @ a - Q
    if is_path.any():
        left += C_q[is_path].T @ found.lambda_[0]
    of_joints = C_q[~is_path]
    carried = np.linalg.lstsq(of_joints.T, -left, rcond=None)[0] if len(of_joints) else np.zeros(0)
    size = max(np.abs(M @ a).max(), np.abs(of_joints.T @ carried).max(initial=0.0), np.abs(Q).max())
    assert np.abs(left + of_joints.T @ carried).max() / size < BOUNDS["residual"]
    size = max(np.abs(a).max(), np.abs(v).max() ** 2, 1.0)
    assert np.abs(C_q @ a - gamma).max(initial=0.0) / size < BOUNDS["residual"]


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
    oracle, Q, V, A = oracle_of(found.assembly), found.q[0], found.v[0], found.a[0]
    power = -energy(0.0)[2]
    if robot.trajectories:
        power -= found.lambda_[0] @ [oracle.row(path.measure, Q, V).rate for path in robot.trajectories]
    power += sum(oracle.row(row, Q, V).rate * size(T)[0] for row, size in robot.loads)
    power += sum(V[oracle.columns[m.body]][3:] @ m.vector * m.magnitude(T)[0] for m in robot.modal_loads)
    terms = np.abs(V) @ np.abs(oracle.mass_matrix(Q) @ A) + abs(power)
    rounding = 1e-15 * energy(0.0)[1] / h  # of the differences; allowed beside the bound on the rest
    assert abs(rate - power) / max(terms + rounding / BOUNDS["power"], 1e-300) < BOUNDS["power"]


@settings(random_scenes, max_examples=6)
@given(st.integers(0, 2**32 - 1))
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
