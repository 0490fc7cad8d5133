"""A wheel in a virtual environment that sees none of Debian's packages: stage 2, and nothing of stage 1.

Building takes about a minute of processor time: only where FFROBOT_TEST_WHEEL is set.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not os.environ.get("FFROBOT_TEST_WHEEL"), reason="FFROBOT_TEST_WHEEL is not set"),
]


def run(*command, **options):
    return subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=600, **options)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    built = run(ROOT / "scripts" / "build_wheel.sh", folder, env=os.environ | {"PYTHON": sys.executable})
    assert built.returncode == 0, built.stdout + built.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """The folder of programs of an environment with the wheel, and what a report needs."""
    folder = tmp_path_factory.mktemp("venv")
    assert run("/usr/bin/python3", "-I", "-m", "venv", folder).returncode == 0
    installed = run(folder / "bin" / "python", "-m", "pip", "install", f"{wheel}[report]", cwd=folder)
    assert installed.returncode == 0, installed.stderr
    return folder / "bin"


@pytest.fixture(scope="module")
def scene(two_link, tmp_path_factory):
    """The two-link scene with its modal bodies in place of its links, its inverse analysis only."""
    folder = tmp_path_factory.mktemp("scene")
    text = (two_link.folder / "scene.toml").read_text(encoding="utf-8")
    for name in ("link1", "link2"):
        modal = two_link.folder.parent / f"{name}.h5"
        run(Path(sys.executable).with_name("ffrobot"), "link", two_link.folder / f"{name}.toml", "-o", modal)
        shutil.move(modal, folder)
        text = text.replace(f'link = "{name}.toml"', f'modal = "{name}.h5"')
    (folder / "scene.toml").write_text(text[: text.index("# The same moments")], encoding="utf-8")
    return folder / "scene.toml"


def test_wheel_is_small(wheel):
    assert wheel.stat().st_size < 2e6  # two compiled cores, for any x86-64 processor and for those with AVX2


def test_nothing_of_stage_1_is_there(environment):
    listed = run(environment / "pip", "list").stdout.lower()
    assert "ffrobot" in listed
    assert not [name for name in ("dolfinx", "petsc", "gmsh", "mpi4py", "matplotlib") if name in listed]


def test_scene_is_solved_as_here(environment, scene, two_link):
    """NumPy 2 and a portable build there, Debian's NumPy and a tuned build here."""
    done = run(environment / "ffrobot", "solve", "scene.toml", cwd=scene.parent)
    assert done.returncode == 0, done.stderr
    with h5py.File(scene.with_suffix(".results.h5")) as file:
        for name in ("joints/O/moment", "joints/A/moment", "points/link2.tip/deflection"):
            here, there = two_link.file[f"inverse/{name}"][()], file[f"inverse/{name}"][()]
            np.testing.assert_allclose(there, here, rtol=0, atol=1e-6 * np.abs(here).max())  # tolerance = 1e-7 each
    report = run(environment / "ffrobot", "report", "scene.results.h5", cwd=scene.parent)
    assert report.returncode == 0, report.stderr
    assert scene.with_suffix(".results.html").exists()


def test_links_say_what_they_need(environment, two_link):
    for link in (two_link.folder / "link1.toml", ROOT / "cases" / "two_link_solid" / "link1.toml"):
        done = run(environment / "ffrobot", "link", link, "--force", "-o", "x.h5", cwd=environment)
        assert done.returncode == 1
        assert "computing this link needs the finite element libraries" in done.stderr
