"""Geometric stiffening: classical loads and speeds, energy and momentum, and runs that need it."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from links import arm, arm_links
from mechanisms import pcid
from oracle_runs import point_motion, run
from scipy.linalg import eigh

import ffrobot
from ffrobot.mbs.quantities.second_order import ModalLoads, lasting, stiffness_change


def test_tip_is_on_its_path_with_what_bending_takes_off():
    """Position as reported: foreshortening included."""
    model = arm(arm_links(stiffening=True))
    outcome = run(model, pcid(tolerance=1e-6))
    tip = point_motion(outcome, "link2.tip")
    targets = np.column_stack([row.target.sample(outcome.time)[0] for row in model.model.rows])
    assert np.abs(tip.deflection[:, 0]).max() > 1e-5
    np.testing.assert_allclose(tip.position, targets, atol=1e-10)


def test_stiffness_changes_are_those_of_the_loads():
    """At full speed: of the shape that K_omega Ω² stiffens most by its stiffness; the same whether it is on or off."""
    link = beam_link(
        1.0, rectangle(0.004, 0.02), 12, nu=None, name="beam",
        modes={"count": 3, "family": "in-plane-bending", "attachment_modes": False}
    )  # fmt: skip
    speed, found = 6.0, []
    for is_on in (True, False):
        scene = ffrobot.make_scene(
            name="spin", gravity=[0.0, 0.0], geometric_stiffening=is_on, body=[{"name": "beam", "link": link}],
            joint=[{"name": "hub", "type": "revolute", "between": ["ground", "beam.root"]}],
            trajectory=[{"name": "spin", "joint": "hub", "value": f"{speed}*t"}],
            analysis=[{"name": "spin", "kind": "fcid", "shape": "zero", "end": 1.0, "output_step": 0.1}],
        )  # fmt: skip
        found.append(ffrobot.solve(scene).attributes("spin/bodies/beam")["stiffness_change"])
    body = ffrobot.make_link(link).body
    expected = eigh(body.geometric_stiffness["omega_zz"], body.stiffness)[0].max() * speed**2
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize(("duration", "buckles"), [(1e-6, False), (0.05, False), (0.8, True), (20.0, True)])
def test_loads_shorter_than_a_vibration_buckle_no_link(duration, buckles):
    """1.5 times the load of Euler: a pulse buckles if its mean over the period, here 1 s, reaches that load."""
    time = np.unique(
        np.concatenate([np.linspace(0.0, 20.0, 2001), 5.0 + duration * np.array([0.0, 1e-9, 1 - 1e-9, 1])])
    )
    stiffness = np.array([(2 * np.pi) ** 2, (20 * np.pi) ** 2])
    pulse = 1.5 * stiffness[0] * ((time > 5.0) & (time < 5.0 + duration))
    loads = ModalLoads(pulse[:, None], -np.eye(2)[None], stiffness)
    assert stiffness_change(loads).buckling == pytest.approx(1.5)
    found = stiffness_change(lasting(loads, time)).buckling
    assert found == pytest.approx(1.5 * min(duration, 1.0), rel=0.02, abs=1e-5)
    assert (found >= 1.0) == buckles
