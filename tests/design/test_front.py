"""`ffrobot optimise … --against`: the curve of mass and deflection of a cantilever, which is a power law."""

import numpy as np
import pytest
import tomli_w
from small_robots import BEAM, CANTILEVER, FORCE, RHO, E, L

import ffrobot

WIDTH = BEAM["geometry"]["section"]["width"]
HEIGHT = "links.beam.geometry.section.height=0.01:0.04:log"
TIP = "peak points.beam.tip.deflection"


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(tomli_w.dumps(CANTILEVER), encoding="utf-8")
    return path


def deflection(height):
    return 4.0 * FORCE * L**3 / (E * WIDTH * height**3)


def test_mass_against_deflection_is_a_power_law(scene):
    """m = ρ L w (4 F L³/(E w δ))^⅓ from one bound of the height to the other, δ in equal ratios; ∂m/∂δ = −m/(3 δ)."""
    found = ffrobot.trade_off(scene, [HEIGHT], minimise="mass", against=TIP, points=3)
    mass, tip = found.values.T
    np.testing.assert_allclose(tip, np.geomspace(deflection(0.01), deflection(0.04), 3), rtol=1e-6)
    np.testing.assert_allclose(mass, RHO * L * WIDTH * (4.0 * FORCE * L**3 / (E * WIDTH * tip)) ** (1 / 3), rtol=1e-6)
    for one in found.points[1:-1]:
        assert one.price == pytest.approx(-one.response / (3.0 * one.against), rel=1e-4)
    assert all(one.converged and one.feasible for one in found.points)
    assert found.units == ("kg", "m")
    curve, designs = found.study().diagrams
    np.testing.assert_allclose([curve.x, curve.y], [tip, mass], rtol=1e-14)
    axes = {axis.label: axis.values for axis in designs.axes}
    assert list(axes) == [HEIGHT.partition("=")[0], "mass (kg)", f"{TIP} (m)"]
    np.testing.assert_allclose(axes[f"{TIP} (m)"], [deflection(h) for h in axes[HEIGHT.partition("=")[0]]], rtol=1e-6)
    best = [value for value, state in zip(axes["mass (kg)"], designs.states, strict=True) if state == "best"]
    np.testing.assert_allclose(sorted(best), sorted(mass), rtol=1e-14)


def test_responses_that_go_together(scene):
    with pytest.raises(ffrobot.InputError, match="expected responses with different optima"):
        ffrobot.trade_off(scene, [HEIGHT], minimise="mass", against="mass beam", points=3)
