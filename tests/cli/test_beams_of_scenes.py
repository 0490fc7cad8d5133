"""Beams of scenes: geometric stiffening (docs/theory.md), and the table of their stresses."""

import h5py
import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, rectangle
from tables_3d import joint, pin, planar

# E A = 5.03e6 N, E I = 566.6 N·m², ρ A = 0.2019 kg/m
LINK = beam_link(
    8.0, rectangle(0.036766, 0.001984), 20, E=6.895e10, nu=0.3, rho=2767.67, name="beam", damping={"ratio": 0.0},
    modes={"count": 6, "family": "in-plane-bending"},
)  # fmt: skip
SPIN = "where(t < 15, 4/15*(t**2/2 + (15/(2*pi))**2*(cos(2*pi*t/15) - 1)), 4*(t - 7.5))"
RUN = {"name": "inverse", "kind": "pcid", "end": 20.0, "output_step": 0.01, "tolerance": 1e-5}
KEYS = {"gravity": [0.0, 0.0], "trajectory": [{"name": "spin", "joint": "hub", "value": SPIN}]}
SCENE = planar([{"name": "beam", "link": LINK}], [pin("hub", "ground", "beam.root")], RUN, **KEYS)


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


def test_the_table_of_stresses(tmp_path, ffrobot):
    """The largest of a cantilever under its weight, ρAgL²/2 over the section modulus, and where it is."""
    modes, stress = {"count": 3, "family": "in-plane-bending"}, {"points": {"root_top": [0.0, 0.02, 0.0]}}
    link = beam_link(2.0, rectangle(0.04, 0.02), 30, name="arm", modes=modes, stress=stress)
    wall = joint("wall", "weld", "ground", "arm.root")
    scene = planar([{"name": "arm", "link": link}], [wall], {"name": "rest", "kind": "static"})
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(scene))
    out = ffrobot.ok("solve", tmp_path / "scene.toml", "--verbose").stdout
    analysis, body, largest, place, *_ = out[out.index("stress in") :].splitlines()[1].split()
    assert (analysis, body, place) == ("rest", "arm", "root_top")
    expected = 2700.0 * 0.04 * 0.02 * 9.81 * 2.0**2 / 2 / (0.02 * 0.04**2 / 6)
    assert float(largest) == pytest.approx(expected / 1e6, rel=2e-3)
