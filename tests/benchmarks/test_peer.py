"""EXUDYN on our modal bodies (peers/exudyn_two_link.py), where it is installed: pip install '.[peers]'."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("exudyn")

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "tools" / "bench" / "peers" / "exudyn_two_link.py"


@pytest.fixture(scope="module")
def links(ffrobot, case_copy_of_module):
    folder = case_copy_of_module("two_link").parent
    for k in (1, 2):
        assert ffrobot("link", folder / f"link{k}.toml").returncode == 0
    return [folder / "link1.h5", folder / "link2.h5"]


@pytest.mark.parametrize(("gravity", "within"), [("full", 0.02), ("native", 0.08)])
def test_peer_computes_the_same_motion(links, tmp_path, gravity, within):
    """At coarse steps 1.6 % of the peak with the whole of gravity, 7 % with what EXUDYN takes into account of it.

    The force is the peer's acceleration of the tip, of second order in steps of 1e-4 s that resolve its highest
    vibration (39 000 rad/s) by 1.6 points a period: a tenth of the peak is what that leaves.
    """
    path = tmp_path / "run.csv"
    command = [sys.executable, SCRIPT, *links, "--step", "1e-4", "--gravity", gravity, "-o", path]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.splitlines()[-1])["completed"]
    t, force, deflection = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 2, 4)).T
    checkpoints = ROOT / "cases" / "two_link" / "reference.csv"
    at, expected_deflection, expected_force = np.loadtxt(checkpoints, delimiter=",", skiprows=4, usecols=(0, 4, 6)).T
    rows = np.abs(t[:, None] - at).argmin(axis=0)
    np.testing.assert_allclose(deflection[rows], expected_deflection, atol=within * np.abs(deflection).max())
    np.testing.assert_allclose(force[rows], expected_force, atol=0.1 * np.abs(force).max())
