"""Beams of scenes: geometric stiffening (docs/theory.md), and stresses of a cantilever that sags."""

import h5py
import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, rectangle

# E A = 5.03e6 N, E I = 566.6 N·m², ρ A = 0.2019 kg/m
LINK = beam_link(
    8.0, rectangle(0.036766, 0.001984), 20, E=6.895e10, nu=0.3, rho=2767.67, name="beam", damping={"ratio": 0.0},
    modes={"count": 6, "family": "in-plane-bending"},
)  # fmt: skip
SPIN = "where(t < 15, 4/15*(t**2/2 + (15/(2*pi))**2*(cos(2*pi*t/15) - 1)), 4*(t - 7.5))"
SCENE = {
    "name": "spin_up",
    "gravity": [0.0, 0.0],
    "body": [{"name": "beam", "link": LINK}],
    "joint": [{"name": "hub", "type": "revolute", "between": ["ground", "beam.root"]}],
    "trajectory": [{"name": "spin", "joint": "hub", "value": SPIN}],
    "analysis": [{"name": "inverse", "kind": "pcid", "end": 20.0, "output_step": 0.01, "tolerance": 1e-5}],
}


@pytest.fixture
def spin_up(tmp_path, ffrobot):
    """Run the scene with keys of its own; returns the finished process and the results file."""

    def run(**keys):
        scene = tmp_path / "scene.toml"
        scene.write_text(tomli_w.dumps(SCENE | keys), encoding="utf-8")
        done = ffrobot("solve", scene, "--verbose")
        return done, h5py.File(scene.with_suffix(".results.h5"))

    return run


def test_spin_up_with_it(spin_up):
    """The tip lags by at most 0.535 m, at 6.77 s, and settles."""
    done, file = spin_up(geometric_stiffening="auto")
    assert done.returncode == 0, done.stderr
    assert "with geometric stiffening" in " ".join(done.stdout.split())
    time, lag = file["inverse/time"][()], -file["inverse/points/beam.tip/deflection"][:, 1]
    assert lag.max() == pytest.approx(0.535, rel=0.01)
    assert time[lag.argmax()] == pytest.approx(6.77, abs=0.05)
    assert np.abs(lag[time > 15]).max() < 0.02
    assert file.attrs["geometric_stiffening"]
    assert file["inverse"].attrs["stiffening_effect"] > 1


def test_spin_up_without_it(spin_up):
    done, file = spin_up()
    assert done.returncode == 1
    assert "diverged" in done.stderr
    assert "geometric_stiffening = true" in done.stderr
    assert "warning" in done.stdout
    assert file["inverse"].attrs["status"] == "diverged"
    assert 7 < file["inverse/time"][-1] < 15


STATIONS = {"root_top": [0.0, 0.02, 0.0], "middle": [1.0, -0.02, 0.0], "axis": [0.0, 0.0, 0.0]}
CANTILEVER = beam_link(
    2.0, rectangle(0.04, 0.02), 30, E=2.0e11, nu=0.3, rho=7800.0, name="arm", stress={"points": STATIONS},
    modes={"count": 3, "family": "in-plane-bending", "attachment_modes": False},
    interface=[{"name": "tip", "mass": 3.0}],
)  # fmt: skip
SAG = {
    "name": "sag",
    "gravity": [0.0, -9.81],
    "body": [{"name": "arm", "link": CANTILEVER}],
    "joint": [{"name": "wall", "type": "weld", "between": ["ground", "arm.root"]}],
    "analysis": [{"name": "rest", "kind": "static"}],
}


def test_a_cantilever_under_its_weight_and_a_mass(tmp_path, ffrobot):
    """M(x) = ρA g (L − x)²/2 + m g (L − x), pulling the upper side; V(0) = ρA g L + m g, in three modes."""
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(SAG))
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
