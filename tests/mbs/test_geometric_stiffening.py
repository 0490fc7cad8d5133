"""Geometric stiffening: classical loads and speeds, energy and momentum, and runs that need it."""

from dataclasses import replace

import numpy as np
import pytest
from links import arm, arm_links, ritz_link
from mechanisms import forward, make_model, oracle_of, pcid, revolute
from oracle_runs import energies, point_motion, run
from scipy.linalg import eigh

import ffrobot
from ffrobot.common.errors import SolveError

# Wu and Haug's spin-up (Int. J. Numer. Meth. Eng. 26, 1988)
LENGTH, MASS, EI, SPEED, RISE = 8.0, 8.0 * 0.2019, 566.6, 4.0, 15.0
SPIN = f"where(t < 15, {SPEED}/15*(t**2/2 + (15/(2*pi))**2*(cos(2*pi*t/15) - 1)), {SPEED}*(t - 7.5))"


def spinning(stiffening, modes=3):
    beam = ritz_link("beam", "cantilever", LENGTH, MASS, EI, modes=modes, stiffening=stiffening)
    return make_model(
        [beam],
        gravity=(0.0, 0.0),
        joint=[revolute("hub", "ground", "beam.root")],
        trajectory=[{"name": "spin", "joint": "hub", "value": SPIN}],
    )


def lowest_critical(K, K_load):
    """The smallest load factor at which K − factor · K_load turns singular."""
    L_inverse = np.linalg.inv(np.linalg.cholesky(K_load))
    return np.linalg.eigvalsh(L_inverse @ K @ L_inverse.T)[0]


def test_buckling_loads_of_a_cantilever():
    """Euler: P = π² EI / 4 L² at the tip; own weight: q = 7.837 EI / L³ (Timoshenko and Gere)."""
    link = ritz_link("link", "cantilever", length=2.0, mass=3.0, EI=5.0, modes=6, stiffening=True)
    K = np.diag(link.stiffness)
    tip, own = link.stiffening.K_points["tip"][0], link.stiffening.K_s[0]
    assert lowest_critical(K, tip) == pytest.approx(np.pi**2 * 5.0 / (4 * 2.0**2), rel=1e-3)
    assert 3.0 / 2.0 * lowest_critical(K, own) == pytest.approx(7.8373 * 5.0 / 2.0**3, rel=1e-3)


def test_frequency_of_a_spinning_cantilever():
    """ω² = ω0² + S Ω² in the plane of rotation, S = 1.193 − 1 (Southwell) for small Ω."""
    link = ritz_link("link", "cantilever", modes=6, stiffening=True)
    assert link.stiffening.K_omega[0, 0] == pytest.approx(1.193, abs=1e-3)


def test_spin_up_lags_as_it_should_and_settles():
    """The tip lags by at most 0.535 m, at 6.77 s (Wu and Haug 1988)."""
    outcome = run(spinning(True), pcid(end=30.0, output_step=0.01))
    assert outcome.status == "completed"
    lag = -point_motion(outcome, "beam.tip").deflection[:, 1]
    assert lag.max() == pytest.approx(0.535, rel=0.01)
    assert outcome.time[lag.argmax()] == pytest.approx(6.77, abs=0.05)
    assert np.abs(lag[outcome.time > RISE]).max() < 0.02


def test_spin_up_without_it_diverges_and_says_so():
    """The first bending frequency, 2.91 rad/s, is below the speed of 4 rad/s."""
    outcome = run(spinning(False), pcid(end=30.0, output_step=0.01))
    assert outcome.status == "diverged"
    assert 7 < outcome.time[-1] < 15
    assert len(outcome.q) == len(outcome.time) > 700  # what there is up to then
    with pytest.raises(SolveError, match=r"diverged.*geometric_stiffening = true"):
        outcome.check_completed()


@pytest.mark.parametrize("integrator", ["radau", "generalized-alpha"])
def test_implicit_integrators_stiffen_as_well(integrator):
    keys = {"end": 3.0, "output_step": 0.01, "tolerance": 1e-3}
    exact, outcome = (run(spinning(True), pcid(integrator=name, **keys)) for name in ("dop853", integrator))
    tips = [point_motion(o, "beam.tip").deflection for o in (exact, outcome)]
    assert np.abs(tips[1] - tips[0]).max() < 2e-3 * np.abs(tips[0]).max()


def test_energy_of_an_undamped_pendulum_stays():
    tolerance = 1e-8
    initial = {"angles": {"link1": 0.3, "link2": 1.0}, "rates": {"link1": 2.0}}
    model = arm(arm_links(stiffening=True), trajectory=[], initial=initial)
    outcome = run(model, forward(end=2.0, tolerance=tolerance))
    parts = energies(outcome)
    total = parts["kinetic"] + parts["strain"] + parts["gravitational"]
    assert np.ptp(parts["kinetic"]) > 1
    assert np.ptp(total) < tolerance * np.ptp(parts["kinetic"])


def test_momentum_of_a_free_chain_stays():
    tolerance = 1e-8
    model = make_model(
        arm_links(stiffening=True),
        gravity=(0.0, 0.0),
        joint=[revolute("A", "link1.tip", "link2.root")],
        load=[{"joint": "A", "moment": "3*sin(8*t)"}],
        initial={"angles": {"link1": 0.3, "link2": 1.0}, "rates": {"link1": 3.0, "link2": -1.0}},
    )
    outcome = run(model, forward(end=2.0, tolerance=tolerance))
    assert outcome.status == "completed"
    mechanism = oracle_of(outcome.assembly)
    momentum = np.array([mechanism.momentum(q, v) for q, v in zip(outcome.q, outcome.v, strict=True)])
    assert np.abs(momentum - momentum[0]).max() < 10 * tolerance * np.abs(momentum).max()


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
    link = {
        "name": "beam", "material": {"youngs_modulus": 7e10, "density": 2700.0},
        "geometry": {"kind": "beam", "length": 1.0, "section": {"shape": "rectangle", "height": 0.004, "width": 0.02}},
        "mesh": {"elements": 12}, "reference": {"condition": "cantilever"},
        "modes": {"count": 3, "family": "in-plane-bending", "attachment_modes": False},
    }  # fmt: skip
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
