"""No file of data runs as a program: meshes, CAD, what lies beside them and where the user works."""

import sys
from pathlib import Path

import pytest

from ffrobot import read_modal_body

sys.path.append(str(Path(__file__).parents[1] / "mesh"))
from decks import bar, elements, nodes

LINK = """
name = "part"
material = { youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }
geometry = { kind = "solid", length = 0.3, file = "FILE" }
reference = { condition = "cantilever" }
modes = { count = 2 }
"""
SCENE = """
name = "arm"
space = "spatial"
gravity = [0.0, 0.0, -9.81]
body = [{ name = "arm", link = "link.toml" }]
joint = [{ name = "j", type = "revolute", between = ["ground", "arm.root"], axis = [0.0, 0.0, 1.0] }]
trajectory = [{ name = "p", joint = "j", value = "0.1*t" }]
analysis = [{ name = "a", kind = "pcid", end = 0.1, output_step = 0.05 }]
"""
SUFFIXES = ["msh", "step", "inp", "vtk", "geo"]
SUFFIXES += [pytest.param(suffix, marks=pytest.mark.nightly) for suffix in ("MSH", "bdf", "med", "opt", "stl")]


@pytest.fixture
def hostile(tmp_path):
    """A folder with a link whose part is a script of gmsh, and where modules of known names run code; what has run."""
    ran = tmp_path / "ran"
    script = f'SystemCall "touch {ran}";\nPrintf("x") > "{ran}";\n'
    for name in ("gmsh", "meshio", "numpy", "ffrobot", "pickle", "trimesh"):
        (tmp_path / f"{name}.py").write_text(f"open({str(ran)!r}, 'w')\n")

    def write(suffix):
        (tmp_path / f"part.{suffix}").write_text(script)
        (tmp_path / f"part.{suffix}.opt").write_text(script)
        (tmp_path / "link.toml").write_text(LINK.replace("FILE", f"part.{suffix}"))
        (tmp_path / "scene.toml").write_text(SCENE)
        return tmp_path

    return write, ran


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_parts_that_are_scripts(hostile, refused, suffix):
    write, ran = hostile
    assert f"part.{suffix}" in refused(write(suffix), "link", "link.toml")
    assert not ran.exists()


@pytest.mark.parametrize(
    "command", [("solve", "scene.toml"), ("export", "scene.toml", "--format", "urdf"), ("info", "part.msh")]
)
def test_by_way_of_other_commands(hostile, refused, command):
    write, ran = hostile
    assert "msh" in refused(write("msh"), *command)
    assert not ran.exists()


def test_what_a_link_leaves_out_is_told_by_all_who_show_it(tmp_path, ffrobot):
    """A mass of 5 kg on a bar, in a deck that includes its cells: by link, info and solve; anew when these change."""
    points, cells = bar()
    points = points * [0.3, 1, 1]
    (tmp_path / "cells.txt").write_text(elements(cells))
    mass = "*ELEMENT, TYPE=MASS, ELSET=M\n99, 1\n*MASS, ELSET=M\n5.\n"
    (tmp_path / "part.inp").write_text(nodes(points) + "*INCLUDE, INPUT=cells.txt\n" + mass)
    (tmp_path / "link.toml").write_text(LINK.replace("FILE", "part.inp"))
    (tmp_path / "scene.toml").write_text(SCENE)
    for command in (("link", "link.toml"), ("link", "link.toml"), ("info", "link.h5"), ("solve", "scene.toml")):
        done = ffrobot.ok(*command, cwd=tmp_path)
        assert "1 MASS" in done.stdout + done.stderr, command
    assert abs(read_modal_body(tmp_path / "link.h5").mass / (2700 * 0.3 * 0.2 * 0.1) - 1) < 1e-9
    (tmp_path / "cells.txt").write_text(elements(cells[[0, 1, 2, 4, 5]]))  # less one element
    assert "computed" in ffrobot("link", "link.toml", cwd=tmp_path).stdout
    assert abs(read_modal_body(tmp_path / "link.h5").mass / (2700 * 0.3 * 0.2 * 0.1 * 5 / 6) - 1) < 1e-9
