"""Growth of small deviations under open-loop torques: exponents of inverted pendulums."""

import numpy as np
import pytest
from mechanisms import make_model, pcid, revolute
from oracle_runs import run
from rods import rod
from scipy.integrate import trapezoid
from scipy.linalg import eigh

from ffrobot.mbs.analysis.operating_points import INSTANTS, open_loop_growth

L, M, G = 0.7, 2.0, 9.81
J, WEIGHT = M * L**2 / 3, M * G * L / 2


def pendulum(trajectory, initial=np.pi / 2, **keys):
    return make_model(
        [rod("a", L, M)], joint=[revolute("O", "ground", "a.root", **keys)], initial={"joints": {"O": initial}},
        trajectory=trajectory, gravity=(0.0, -G),
    )  # fmt: skip


def along(value):
    return [{"name": "path", "joint": "O", "value": value}]


def growth(robot, **keys):
    return open_loop_growth(run(robot, pcid(**keys)).outcome)


@pytest.mark.parametrize(("c", "rotor", "N"), [(0.0, 0.0, 1.0), (1.5, 3e-4, 50.0)])
def test_an_inverted_pendulum_that_friction_and_a_rotor_slow(c, rotor, N):
    """λ² (J + J_m N²) + λ c = m g l, l = L/2 and J = m L²/3."""
    total = J + rotor * N**2
    expected = (-c + np.sqrt(c**2 + 4 * total * WEIGHT)) / (2 * total)
    keys = {"viscous_friction": c, "rotor_inertia": rotor, "gear_ratio": N}
    assert growth(pendulum(along("pi/2"), **keys)) == pytest.approx(expected, rel=1e-9)


def test_the_mean_over_a_swing():
    """√(m g l sin θ/J) at nine instants, by the trapezoidal rule; no growth below the level of the pivot."""
    start, turn = 2.5, 1.5
    found = growth(pendulum(along(f"{start} + {turn}*t**2"), initial=start), output_step=0.0125)
    theta = start + turn * np.linspace(0.0, 1.0, INSTANTS) ** 2
    rates = np.sqrt(np.maximum(np.sin(theta) * WEIGHT / J, 0.0))
    assert np.count_nonzero(rates == 0.0) in range(1, INSTANTS)
    assert found == pytest.approx(trapezoid(rates, dx=1 / (INSTANTS - 1)), rel=1e-8)


def test_two_inverted_rods():
    """The faster of two exponents, by mass matrix and slope of the weights of upright rods in absolute angles."""
    a, b, m, n = 0.7, 0.5, 2.0, 1.2
    robot = make_model(
        [rod("a", a, m), rod("b", b, n)],
        joint=[revolute("O", "ground", "a.root"), revolute("A", "a.tip", "b.root")],
        initial={"joints": {"O": np.pi / 2, "A": 0.0}}, gravity=(0.0, -G),
        trajectory=[{"name": "one", "joint": "O", "value": "pi/2"}, {"name": "two", "joint": "A", "value": "0"}],
    )  # fmt: skip
    mass = np.array([[m * a**2 / 3 + n * a**2, n * a * b / 2], [n * a * b / 2, n * b**2 / 3]])
    slope = np.diag([m * G * a / 2 + n * G * a, n * G * b / 2])
    assert growth(robot) == pytest.approx(np.sqrt(eigh(slope, mass, eigvals_only=True)[-1]), rel=1e-9)
