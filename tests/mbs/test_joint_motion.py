"""Coordinates and rates of joints: what paths prescribe, closed forms, and the rates that motors have."""

import numpy as np
from links import ANGLES, arm
from mechanisms import make_model, oracle_of, pcid, revolute
from oracle_runs import run
from rods import rod, slider_crank


def test_turns_are_counted():
    """Two rods on given joint angles, the second for three turns and a half."""
    model = make_model(
        [rod("a", 0.8, 3.0), rod("b", 0.6, 2.0)],
        joint=[revolute("O", "ground", "a.root"), revolute("A", "a.tip", "b.root")],
        trajectory=[
            {"name": "first", "joint": "O", "value": "0.4+0.9*sin(2*t)"},
            {"name": "second", "joint": "A", "value": "-1.1+22*t"},
        ],
        initial={"angles": {"a": 0.4, "b": -0.7}},
    )
    outcome = run(model, pcid(tolerance=1e-9))
    t, (first, second) = outcome.time, (outcome.motion.joint(joint) for joint in "OA")
    np.testing.assert_allclose(first[0][:, 0], 0.4 + 0.9 * np.sin(2 * t), atol=1e-10)
    np.testing.assert_allclose(second[0][:, 0], -1.1 + 22 * t, atol=1e-10)
    np.testing.assert_allclose(second[1][:, 0], 22.0, rtol=1e-9)


def test_way_of_a_slider():
    """x = r cos φ + √(l² − r² sin² φ) along the guide, φ of the crank."""
    r, length = 0.2, 0.5
    outcome = run(slider_crank({"name": "crank", "joint": "O", "value": "0.9+8*t"}), pcid(tolerance=1e-9))
    phi = 0.9 + 8 * outcome.time
    guide = outcome.motion.joint("rail")[0][:, 0]
    way = r * np.cos(phi) + np.sqrt(length**2 - (r * np.sin(phi)) ** 2)
    np.testing.assert_allclose(guide - guide[0], way - way[0], atol=1e-9)
    np.testing.assert_allclose(outcome.motion.joint("O")[1], 8.0, rtol=1e-9)


def test_flexible_links_turn_with_their_sections_or_frames():
    """Rates are those that the gradients of the motors' rows give; the two ways differ where links bend."""
    found = {}
    for motors in ("section", "frame"):
        model = arm(motors=motors, initial={"state": "static", "angles": ANGLES})
        outcome = run(model, pcid(tolerance=1e-6, end=0.1))
        mechanism = oracle_of(outcome.assembly)
        for name, row in model.motors.items():
            rates = [mechanism.row(row, q, v).rate for q, v in zip(outcome.q, outcome.v, strict=True)]
            np.testing.assert_allclose(outcome.motion.joint(name)[1][:, 0], rates, atol=1e-12)
        found[motors] = outcome.motion.joint("A")[0]
    assert np.abs(found["section"] - found["frame"]).max() > 1e-4
