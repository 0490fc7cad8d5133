"""Stresses from the link file to the results: a cantilever that sags under its own weight."""

import h5py
import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, rectangle

STATIONS = {"root_top": [0.0, 0.02, 0.0], "middle": [1.0, -0.02, 0.0], "axis": [0.0, 0.0, 0.0]}
LINK = beam_link(
    2.0, rectangle(0.04, 0.02), 30, E=2.0e11, nu=0.3, rho=7800.0, name="arm", stress={"points": STATIONS},
    modes={"count": 3, "family": "in-plane-bending", "attachment_modes": False},
    interface=[{"name": "tip", "mass": 3.0}],
)  # fmt: skip
SCENE = {
    "name": "sag",
    "gravity": [0.0, -9.81],
    "body": [{"name": "arm", "link": LINK}],
    "joint": [{"name": "wall", "type": "weld", "between": ["ground", "arm.root"]}],
    "analysis": [{"name": "rest", "kind": "static"}],
}


def test_a_cantilever_under_its_weight_and_a_mass(tmp_path, ffrobot):
    """M(x) = ρA g (L − x)²/2 + m g (L − x), pulling the upper side; V(0) = ρA g L + m g, in three modes."""
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(SCENE))
    done = ffrobot.ok("solve", tmp_path / "scene.toml", "--verbose")
    weight, load, resistance = 7800.0 * 0.04 * 0.02 * 9.81, 3.0 * 9.81, 0.02 * 0.04**2 / 6
    moments = [weight * (2.0 - x) ** 2 / 2 + load * (2.0 - x) for x in (0.0, 1.0)]
    with h5py.File(tmp_path / "scene.results.h5") as file:
        points = file["rest/stress/arm/points"]
        assert points["root_top/stress"].shape == (1, 6)
        assert points["root_top/stress"][0, 0] == pytest.approx(moments[0] / resistance, rel=1e-6)
        assert points["middle/stress"][0, 0] == pytest.approx(-moments[1] / resistance, rel=1e-6)
        assert points["middle/von_mises"][0] == pytest.approx(moments[1] / resistance, rel=1e-6)
        tau = 1.5 * (weight * 2.0 + load) / (0.04 * 0.02)
        np.testing.assert_allclose(points["axis/stress"][0], [0, 0, 0, 0, 0, -tau], rtol=1e-6, atol=1.0)
        assert "surface" not in file["rest/stress/arm"]
    table = done.stdout[done.stdout.index("stress in") :].splitlines()
    assert table[1].split()[:2] == ["rest", "arm"]
    assert float(table[1].split()[2]) == pytest.approx(moments[0] / resistance / 1e6, rel=2e-3)
    assert "root_top" in table[1]
