"""Geometric stiffening: classical loads and speeds, energy and momentum, and runs that need it."""

from dataclasses import replace

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from links import arm, arm_links, ritz_link
from mechanisms import make_model, pcid, revolute
from oracle_runs import point_motion, run
from scipy.linalg import eigh

import ffrobot

# Wu and Haug's spin-up (Int. J. Numer. Meth. Eng. 26, 1988)
LENGTH, MASS, EI, SPEED = 8.0, 8.0 * 0.2019, 566.6, 4.0
SPIN = f"where(t < 15, {SPEED}/15*(t**2/2 + (15/(2*pi))**2*(cos(2*pi*t/15) - 1)), {SPEED}*(t - 7.5))"


def spinning(stiffening, modes=3):
    beam = ritz_link("beam", "cantilever", LENGTH, MASS, EI, modes=modes, stiffening=stiffening)
    return make_model(
        [beam],
        gravity=(0.0, 0.0),
        joint=[revolute("hub", "ground", "beam.root")],
        trajectory=[{"name": "spin", "joint": "hub", "value": SPIN}],
    )


@pytest.mark.parametrize("integrator", ["radau", "generalized-alpha"])
def test_implicit_integrators_stiffen_as_well(integrator):
    keys = {"end": 3.0, "output_step": 0.01, "tolerance": 1e-3}
    exact, outcome = (run(spinning(True), pcid(integrator=name, **keys)) for name in ("dop853", integrator))
    tips = [point_motion(o, "beam.tip").deflection for o in (exact, outcome)]
    assert np.abs(tips[1] - tips[0]).max() < 2e-3 * np.abs(tips[0]).max()


def test_tip_is_on_its_path_with_what_bending_takes_off():
    """Position as reported: foreshortening included."""
    model = arm(arm_links(stiffening=True))
    outcome = run(model, pcid(tolerance=1e-6))
    tip = point_motion(outcome, "link2.tip")
    targets = np.column_stack([c.target.sample(outcome.time)[0] for c in model.trajectories])
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


def test_it_is_left_out_where_the_body_has_none():
    """Bodies without it are those of an arm that never heard of it, to the last bit."""
    with_none = arm([replace(link, stiffening=None) for link in arm_links(stiffening=True)])
    one, other = (run(model, pcid(end=0.1)) for model in (arm(), with_none))
    assert np.array_equal(one.q, other.q)
