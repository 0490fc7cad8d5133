"""Pinocchio in a virtual environment of its own: that of the user or of an earlier run, else made from PyPI."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PACKAGE = "pin==2.6.20"  # of the Python versions that this program runs on; with NumPy below 2
DYNAMICS = Path(__file__).with_name("pinocchio_dynamics.py")
PATIENCE = 600  # s for a download of 100 MB


def python_with_pinocchio(folder):
    """The interpreter FFROBOT_PINOCCHIO, or that of `folder`, made where it is not there and this is no CI.

    Skips the test where there is none: continuous integration does not wait a minute for a download.
    """
    if named := os.environ.get("FFROBOT_PINOCCHIO"):
        return Path(named)
    python = folder / "bin" / "python"
    if not (folder / "complete").exists():
        if os.environ.get("CI"):
            pytest.skip("no Pinocchio: in continuous integration FFROBOT_PINOCCHIO has to name a Python that has it")
        _make(folder, python)
    return python


def _make(folder, python):
    subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
    install = [python, "-m", "pip", "install", "--quiet", "--retries", "1", PACKAGE, "numpy<2"]
    try:
        done = subprocess.run(install, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        pytest.skip(f"no Pinocchio: pip install {PACKAGE} took more than {PATIENCE} s")
    if done.returncode != 0:
        pytest.skip(f"no Pinocchio: pip install {PACKAGE}: {done.stderr.strip().splitlines()[-1]}")
    (folder / "complete").touch()


def pinocchio_dynamics(python, urdf, names, **motion):
    """What `pinocchio_dynamics.py` answers for q, v, a and tau (T, n) of the joints `names`."""
    request = json.dumps({"names": names} | {key: np.asarray(values).tolist() for key, values in motion.items()})
    done = subprocess.run([python, DYNAMICS, urdf], input=request, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)
