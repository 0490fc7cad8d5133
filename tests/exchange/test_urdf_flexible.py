"""Links of a URDF that a link file makes flexible: where they stand, where joints are on them, what is refused."""

import re
import tomllib

import gmsh
import numpy as np
import pytest

from ffrobot.mesh.gmsh_session import gmsh_session

DENSITY, SIDE = 7850.0, 0.03  # a square bar, so stiff that it is rigid
LENGTH = 0.5
MASS, J_X = DENSITY * SIDE**2 * LENGTH, DENSITY * SIDE**4 / 6 * LENGTH
BAR = f"""
material = {{ youngs_modulus = 2e14, poissons_ratio = 0.3, density = {DENSITY} }}
geometry = {{ kind = "beam", section = {{ shape = "rectangle", height = {SIDE}, width = {SIDE} }} }}
mesh = {{ elements = 10 }}
reference = {{ condition = "cantilever" }}
modes = {{ count = 6 }}
"""
# The bar lies along (0, 0.6, 0.8) of its link: its inertia in the axes of the link, its center half way.
ALONG = np.array([0.0, 0.6, 0.8])
J_BAR = J_X * np.outer(ALONG, ALONG) + MASS * LENGTH**2 / 12 * (np.eye(3) - np.outer(ALONG, ALONG))
ENTRIES = " ".join(f'i{"xyz"[k]}{"xyz"[j]}="{float(J_BAR[k, j])!r}"' for k in range(3) for j in range(k, 3))
SMALL = """<inertial><origin xyz="0.02 0.1 0.03"/><mass value="1.5"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.012" iyz="0" izz="0.008"/></inertial>"""


def joint(name, kind, parent, child, origin, axis="1 0 0"):
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}<origin {origin}/><axis xyz="{axis}"/></joint>\n'


ARM = f"""<robot name="arm">
<link name="base"/>
<link name="waist">{SMALL}</link>
<link name="upper"><inertial><origin xyz="{" ".join(map(repr, (LENGTH / 2 * ALONG).tolist()))}"/>
<mass value="{MASS!r}"/><inertia {ENTRIES}/></inertial></link>
<link name="fore">{SMALL}</link>
<link name="gripper">{SMALL}</link>
<link name="box">{SMALL}</link>
{joint("turn", "revolute", "base", "waist", 'xyz="0 0 0.2"', "0 0 1")}
{joint("shoulder", "revolute", "waist", "upper", 'xyz="0.1 0 0.1" rpy="0.3 0.2 -0.4"')}
{joint("elbow", "revolute", "upper", "fore", 'xyz="0 0.3 0.4" rpy="-0.5 0.1 0.2"', "0 1 0")}
{joint("middle", "fixed", "upper", "box", 'xyz="0 0.12 0.16" rpy="0.1 0.2 0.3"')}
{joint("flange", "fixed", "fore", "gripper", 'xyz="0.3 0 0" rpy="0 0.4 0"')}
</robot>"""


def import_with(ffrobot, folder, link=BAR, text=ARM, name="upper"):
    (folder / "arm.urdf").write_text(text)
    (folder / "bar.toml").write_text(link)
    return ffrobot("import", "arm.urdf", "-o", "out", "--flexible", f"{name}=bar.toml", cwd=folder)


@pytest.fixture(scope="module")
def out(tmp_path_factory, ffrobot):
    """The folder of the scene, and what was printed."""
    folder = tmp_path_factory.mktemp("arm")
    done = import_with(ffrobot, folder)
    assert done.returncode == 0, done.stderr
    return folder / "out", done.stdout


def test_the_link_file_gets_length_and_interfaces(out):
    folder, printed = out
    link = tomllib.loads((folder / "upper.toml").read_text())
    assert link["geometry"]["length"] == pytest.approx(0.5, rel=1e-15)
    assert link["interface"] == [{"name": "middle", "position": pytest.approx(0.2, rel=1e-15)}]
    joints = {entry["name"]: entry for entry in tomllib.loads((folder / "scene.toml").read_text())["joint"]}
    assert joints["shoulder"]["between"][1] == "upper.root"
    assert joints["elbow"]["between"] == ["upper.tip", "fore.origin"]
    assert joints["middle"]["type"] == "weld"
    assert joints["middle"]["between"] == ["upper.middle", "box.origin"]
    assert 'link "upper" is flexible: upper.toml determines its inertia, not its <inertial>' in printed
    assert 'length 0.5 m, the distance to joint "elbow"' in printed


WRONG = {
    "another length": ({"link": BAR.replace('kind = "beam"', 'kind = "beam", length = 0.4')},
                       'geometry.length: expected 0.5 m, the distance to joint "elbow", or no such key, found 0.4'),
    "unknown link": ({"name": "uper"}, 'expected a link of the URDF, found none of this name (did you mean "upper"?)'),
    "joint off the axis": ({"text": ARM.replace("0 0.12 0.16", "0.1 0.12 0.16")},
                           'joint "middle": expected a joint on the line between the ends of the beam, found it 0.1 m'),
    "wrong link file": ({"link": BAR.replace("density", "dennsity")}, "density"),
}  # fmt: skip


@pytest.mark.parametrize(("changes", "expected"), WRONG.values(), ids=WRONG)
def test_what_is_refused(changes, expected, tmp_path, ffrobot):
    done = import_with(ffrobot, tmp_path, **changes)
    assert done.returncode == 2
    assert expected in re.sub(r"\s+", " ", done.stderr)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["a\n[[load]]\nx.toml", "../outside"])
def test_links_of_any_name_get_files_of_their_own_in_the_folder(name, out, tmp_path, ffrobot):
    """Both files are what they are without such names, but for names: no line of one is read as a key."""
    text = ARM.replace('"upper"', f'"{name}"'.replace("\n", "&#10;"))
    assert import_with(ffrobot, tmp_path, text=text, name=name).returncode == 0
    assert {path.name for path in tmp_path.iterdir()} == {"arm.urdf", "bar.toml", "out"}
    plain, found = (
        {path.name: tomllib.loads(path.read_text(encoding="utf-8")) for path in folder.iterdir()}
        for folder in (out[0], tmp_path / "out")
    )
    (link,) = (value for key, value in found.items() if key != "scene.toml")
    assert {key: link[key] for key in link if key != "name"} == {
        key: value for key, value in plain["upper.toml"].items() if key != "name"
    }
    assert found["scene.toml"].keys() == plain["scene.toml"].keys()
    assert len(found["scene.toml"]["body"]) == len(plain["scene.toml"]["body"])


PLATE = """
material = { youngs_modulus = 70e9, poissons_ratio = 0.33, density = 2700.0 }
reference = { condition = "cantilever" }
modes = { count = 2 }
[geometry]
kind = "solid"
file = "plate.step"
unit = "mm"
origin = [25.0, 0.0, 0.0]
x_axis = [1, 0, 0]
y_axis = [0, 1, 0]
"""


@pytest.fixture
def plate(tmp_path, ffrobot):
    """Import a plate in mm with three bores along z, at joints of which the middle one has its `axis`."""
    with gmsh_session():
        cad = gmsh.model.occ
        bores = [(3, cad.addCylinder(x, 0, -5, 0, 0, 10, 12)) for x in (25, 150, 275)]
        cad.cut([(3, cad.addBox(0, -20, -5, 300, 40, 10))], bores)
        cad.synchronize()
        gmsh.write(str(tmp_path / "plate.step"))
    (tmp_path / "plate.toml").write_text(PLATE)

    def run(axis):
        joints = joint("hip", "revolute", "base", "plate", 'xyz="0 0 0.1"', "0 0 1")
        joints += joint("wheel", "revolute", "plate", "disk", 'xyz="0.125 0 0.004"', axis)
        joints += joint("knee", "revolute", "plate", "shin", 'xyz="0.25 0 0"', "0 0 1")
        names = "".join(f'<link name="{name}">{SMALL}</link>' for name in ("plate", "disk", "shin"))
        (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="base"/>{names}{joints}</robot>')
        return ffrobot(
            "import", tmp_path / "r.urdf", "-o", tmp_path / "out", "--flexible", f"plate={tmp_path}/plate.toml"
        )

    return run


def test_bores_are_interfaces_of_the_joints_in_them(tmp_path, plate):
    done = plate("0 0 -1")
    assert done.returncode == 0, done.stderr
    assert 'joint "hip" is in a bore of radius 12 mm\n' in done.stdout
    assert 'joint "wheel" is in a bore of radius 12 mm, whose center is 4 mm along the axis' in done.stdout
    tables = {table["name"]: table for table in tomllib.loads((tmp_path / "out/plate.toml").read_text())["interface"]}
    for name, x in (("root", 0.0), ("wheel", 0.125), ("tip", 0.25)):
        np.testing.assert_allclose(tables[name]["position"], [x, 0, 0], atol=1e-8)
        np.testing.assert_allclose(np.abs(tables[name]["normal"]), [0, 0, 1], atol=1e-6)


def test_bores_along_another_axis_than_the_joint_are_not(plate):
    done = plate("0 1 0")
    assert done.returncode == 2
    assert "interface.normal of wheel: expected the outward normal of the face at position" in done.stderr
