"""No file of data runs as a program: meshes, CAD, what lies beside them and where the user works."""

import pytest

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
SUFFIXES = ["msh", "MSH", "step", "inp", "bdf", "vtk", "med", "geo", "opt", "stl"]


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
