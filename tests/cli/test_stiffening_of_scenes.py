"""The key `geometric_stiffening` of a scene, from link files to results: docs/theory.md, Geometric stiffness."""

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
