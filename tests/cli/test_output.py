"""Help texts, summaries, what `info` tells, and what is loaded to say it."""

import subprocess
import sys

import pytest

FORBIDDEN = ("dolfinx", "gmsh", "petsc4py", "slepc4py", "mpi4py", "matplotlib")


def test_summary(two_link):
    """Every number a reader asks for first, in whole words."""
    out = two_link.stdout
    lines = {line.split()[0]: line.split() for line in out.splitlines() if line.strip()}
    for name, kind in (("forward", "forward"), ("joints_only", "forward")):
        assert lines[name][1] == kind
        assert "dop853" in lines[name][2:5]
    assert "…" not in out
    assert "\x1b" not in out
    for text in ("steps", "tolerance", "violation", "wall (s)", "largest (V)", "required /", "condition"):
        assert text in out
    for text in (
        "accuracy",
        "time integration: 1e-07 of peaks, requested tolerance",
        "modes: not estimated",
        "wall time",
        "writing",
        "omitted",
        "damping, which is zero",
    ):
        assert text in " ".join(out.split())  # may go over two lines
    flat = " ".join(out.split())
    assert "no realistic patch can supply the voltages of link1, link2" in flat
    assert "V is sufficient" not in flat  # a limit of 97 kV
    required = two_link.file["inverse/pzt/link1/required_voltage"].attrs["peak"].max()
    assert f"{required:.5g}" in out
    assert f"{required / 200:.3g}" in out
    assert out.rstrip().endswith("scene.results.h5")


@pytest.fixture
def short_scene(two_link_copy, two_link):
    """The folder of a short two-link scene; its modal bodies are in the cache since `two_link`."""
    return two_link_copy({"scene.toml": {"end = 1.0": "end = 0.01"}})


def test_stage_2_works_where_stage_1_is_not_installed(short_scene, ffrobot, tmp_path):
    """The finite element libraries cannot be imported: the command line, and a solve from modal files, do not mind."""
    program = f"""
import sys
for name in {FORBIDDEN!r}:
    sys.modules[name] = None  # import raises ModuleNotFoundError
sys.argv = ["ffrobot", "solve", "scene.toml", "-o", {str(tmp_path / "r.h5")!r}]
from ffrobot.cli import main
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=short_scene, env=ffrobot.environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "r.h5").exists()
