"""Static equilibria by Newton's method with exact derivatives: against differences, closed forms and turned robots."""

import time

import numpy as np
import pytest
import zoo
from beam_links import beam_link, rectangle
from moving_trees import differences
from scipy.optimize import brentq
from tables_3d import pin

from ffrobot import make_scene, solve
from ffrobot.mbs.linear.statics import Statics

REST = {"name": "rest", "kind": "static"}


def rigid(mass, length, inertia=1e-3):
    points = {"root": [0.0, 0.0], "tip": [length, 0.0]}
    return {"mass": mass, "inertia": inertia, "center": [length / 2, 0.0], "points": points}


def at_rest(**keys):
    """Equilibrium of a planar scene."""
    return solve(make_scene(**{"name": "s", "gravity": [0.0, -9.81], "analysis": [REST]} | keys))


@pytest.mark.parametrize("name", ["mixed", "four-bar", "slider-crank", "loaded", "stiffened", "free-flying"])
def test_stiffness_is_the_derivative_of_forces(name):
    """Of C_vᵀλ − Q at fixed λ, by differences of fourth order in random postures."""
    statics, rng = Statics(zoo.build(name).model), np.random.default_rng(1)
    tree = statics.model.tree
    q = rng.uniform(-0.3, 0.3, tree.n_q)
    for node in tree.nodes:
        if node.joint.q_count > node.joint.freedoms:
            q[node.q][-4:] /= np.linalg.norm(q[node.q][-4:])
    at = statics.balance(q, np.arange(tree.n_v))

    def left(dv):
        forces, gradient = statics._at_rest(tree.integrate(q, dv * statics.sizes))
        return at.multipliers @ gradient - forces.Q * statics.sizes

    expected = differences(left, tree.n_v, 1e-5)
    np.testing.assert_allclose(statics.stiffness(q, at), expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize(("gravity", "load"), [([0.0, -9.81], None), ([0.0, 0.0], "-40.0")])
def test_a_flexible_arm_hangs_straight_down(gravity, load):
    """Nothing bends it there: all generalized forces vanish with what is left of them."""
    arm = beam_link(0.5, rectangle(0.01, 0.02), 8, modes={"count": 2, "family": "in-plane-bending"})
    with at_rest(
        gravity=gravity, body=[{"name": "a", "link": arm}], joint=[pin("j", "ground", "a.root")],
        initial={"joints": {"j": -1.4}}, load=[{"point": "a.tip", "y": load}] if load else [],
    ) as results:  # fmt: skip
        assert results["rest/joints/j/coordinate"][0] == pytest.approx(-np.pi / 2, abs=1e-12)


@pytest.mark.parametrize("angle", [1e-6, 0.3, 2.0])
def test_a_slider_crank_may_be_turned_with_its_gravity(angle):
    """Its guide is then along no axis: rows of what cannot move are round-off there, or small shares of others."""

    def moment(turn):
        c, s = np.cos(turn), np.sin(turn)
        rod = beam_link(0.3, rectangle(0.006, 0.01), 8, modes={"count": 2, "family": "in-plane-bending"})
        block = {"mass": 0.3, "inertia": 1e-4, "center": [0.0, 0.0], "points": {"pin": [0.0, 0.0]}}
        with at_rest(
            gravity=[9.81 * s, -9.81 * c],
            body=[{"name": "c", "rigid": rigid(0.4, 0.1)}, {"name": "r", "link": rod}, {"name": "b", "rigid": block}],
            joint=[
                pin("O", "ground", "c.root", motor=True), pin("A", "c.tip", "r.root"), pin("B", "r.tip", "b.pin"),
                {"name": "C", "type": "prismatic", "between": ["ground", "b.pin"], "axis": [c, s]},
            ],
            initial={"angles": {"c": 0.5 + turn, "r": -0.16 + turn, "b": turn}},
            trajectory=[{"name": "t", "joint": "O", "value": str(0.5 + turn)}],
        ) as results:  # fmt: skip
            return float(results["rest/joints/O/moment"][0])

    assert moment(angle) == pytest.approx(moment(0.0), rel=1e-9)


@pytest.mark.parametrize("values", [[50.0, 1e7], [5.0, 1e9]])
def test_a_gear_in_steps_of_stiffness_winds_under_the_weight(values):
    """M(γ) = m g l/2 cos(θ_m − γ), with a moment that is linear in pieces."""
    knee, mass, length, motor = 1.0, 2.0, 0.6, 0.4
    gear = {"gear_ratio": 50.0, "rotor_inertia": 2e-5, "stiffness": {"values": values, "torques": [knee]}}

    def left(twist):
        moment = values[0] * min(twist, knee / values[0]) + values[1] * max(twist - knee / values[0], 0.0)
        return moment - mass * 9.81 * length / 2 * np.cos(motor - twist)

    expected = motor - brentq(left, 0.0, 0.5, xtol=1e-15)
    with at_rest(
        body=[{"name": "a", "rigid": rigid(mass, length)}], joint=[pin("j", "ground", "a.root", **gear)],
        initial={"joints": {"j": motor}}, trajectory=[{"name": "t", "motor": "j", "value": str(motor)}],
    ) as results:  # fmt: skip
        assert results["rest/joints/j/coordinate"][0] == pytest.approx(expected, abs=1e-9)


def test_a_chain_of_a_hundred_links_hangs_in_seconds():
    """Under its weight and a pull H at its end each link points along the forces on it: tan θ = −(weight below)/H."""
    count, mass, length, pull = 100, 0.1, 0.1, 30.0
    names = [f"b{k}" for k in range(count)]
    below = 9.81 * mass * (count - 0.5 - np.arange(count))
    angles = -np.arctan(below / pull)
    guess = dict(zip((f"j{k}" for k in range(count)), np.diff(angles, prepend=0.0) * 0.9, strict=True))
    began = time.process_time()
    with at_rest(
        body=[{"name": name, "rigid": rigid(mass, length)} for name in names],
        joint=[pin(f"j{k}", f"b{k - 1}.tip" if k else "ground", f"b{k}.root", motor=False) for k in range(count)],
        load=[{"point": f"{names[-1]}.tip", "x": str(pull)}], initial={"joints": guess},
    ) as results:  # fmt: skip
        found = np.cumsum([results[f"rest/joints/j{k}/coordinate"][0] for k in range(count)])
    assert time.process_time() - began < 15.0  # 1 s on a quiet machine
    np.testing.assert_allclose(found, angles, atol=1e-10)
