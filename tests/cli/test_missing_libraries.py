"""Libraries that are not there, or cannot be loaded: one line that names them, and what to do."""

import os
import subprocess
import sys

import pytest
import tomli_w
from beam_links import beam_link, link_keys, rectangle, tube

WITHOUT = """
import sys
sys.modules["gmsh"] = None
sys.argv = ["ffrobot", *sys.argv[1:]]
from ffrobot.__main__ import main
main()
"""
OTHER_MPI = "libmpi.so.12: cannot open shared object file: No such file or directory"


PART = link_keys("solid", 0.1, rectangle(0.01, 0.02), {"cell": "hexahedron"}, name="part", modes={"count": 2})
FILE = PART | {"geometry": {"kind": "solid", "length": 0.1, "file": "part.step", "unit": "mm"}, "mesh": {}}


@pytest.mark.parametrize("words", [("part.step", "--inspect"), ("part.msh", "--inspect"), ("part.toml",)])
def test_without_gmsh(words, tmp_path):
    """What is sound and what is not alike: the library is missed before the file is read."""
    (tmp_path / "part.step").write_text("ISO-10303-21;\nSI_UNIT(.MILLI.,.METRE.)")
    (tmp_path / "part.msh").write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")
    (tmp_path / "part.toml").write_text(tomli_w.dumps(FILE))
    command = [sys.executable, "-c", WITHOUT, "link", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, len(done.stderr.splitlines())) == (1, 1), done.stderr
    assert "gmsh" in done.stderr


@pytest.mark.parametrize(
    ("package", "error", "told"),
    [
        ("dolfinx", f"ImportError({OTHER_MPI!r})", OTHER_MPI),
        ("petsc4py", "ModuleNotFoundError(name='petsc4py')", "petsc4py is not installed"),
    ],
)
def test_finite_elements_that_cannot_be_loaded(tmp_path, package, error, told):
    (tmp_path / package).mkdir()
    (tmp_path / package / "__init__.py").write_text(f"raise {error}")
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(PART))
    command = [sys.executable, "-m", "ffrobot", "link", "arm.toml"]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert (done.returncode, len(done.stderr.splitlines())) == (1, 1), done.stderr
    assert f"arm.toml: computing this link needs the finite element libraries, and {told}" in done.stderr


def test_figures_with_the_backend_of_a_notebook(tmp_path):
    """Kernels of Jupyter name a module that other environments do not have."""
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(beam_link(0.6, tube(0.02, 0.016), 10, name="arm")))
    environment = os.environ | {"MPLBACKEND": "module://of.no.environment"}
    for words in (("link", "arm.toml"), ("plot", "arm.h5", "--format", "svg")):
        command = [sys.executable, "-m", "ffrobot", *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
        assert done.returncode == 0, done.stderr
