"""`ffrobot import` of URDFs: what is kept, merged, left out, and what wrong files are told."""

import re
import tomllib

import numpy as np
import pytest
from rigid_robots import of_rpy

from ffrobot import InputError
from ffrobot.common.rotations import of_quaternion, rpy_of
from ffrobot.common.rotations import of_rpy as of_rpy_here
from ffrobot.common.validation import validate
from ffrobot.exchange.urdf.import_urdf import import_urdf
from ffrobot.mbs.scene.mechanism import MechanismKeys

INERTIAL = '<inertial><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>'


def link(name, inside=INERTIAL):
    return f'<link name="{name}">{inside}</link>'


def joint(name, parent, child, inside="", kind="revolute", at="0 0 0.3"):
    limit = '<limit lower="-1" upper="2" effort="30" velocity="4"/>' if kind in ("revolute", "prismatic") else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/><axis xyz="0 1 0"/>{limit}{inside}</joint>'
    )


def robot(*parts):
    return f'<?xml version="1.0"?>\n<robot name="r">{"".join(parts)}</robot>\n'


@pytest.fixture
def imported(tmp_path, ffrobot):
    """Import a text: keys of the scene, checked as `solve` checks them, and what was printed."""

    def run(text, *arguments):
        urdf = tmp_path / "robot.urdf"
        urdf.write_text(text)
        done = ffrobot.ok("import", urdf, "-o", tmp_path / "scene", *arguments)
        scene = tmp_path / "scene" / "scene.toml"
        keys = tomllib.loads(scene.read_text())
        validate(MechanismKeys, keys, scene)
        return keys, done.stdout

    return run


def test_the_tool_frame_of_the_last_body(imported, tmp_path, ffrobot):
    """A link without mass on a fixed joint with axes of its own is a tool: where and how it stands, there and back."""
    turned = '<joint name="flange" type="fixed"><parent link="arm"/><child link="tool0"/>'
    turned += '<origin xyz="0.1 0 0.4" rpy="0.2 -0.3 0.4"/></joint>'
    plain = '<joint name="camera" type="fixed"><parent link="arm"/><child link="lens"/><origin xyz="0 0.1 0"/></joint>'
    parts = (link("base"), link("arm"), link("tool0", ""), link("lens", ""), joint("shoulder", "base", "arm"))
    keys, _ = imported(robot(*parts, turned, plain))
    (found,) = keys["tool"]
    assert found["name"] == "tool0"
    assert found["point"] == "arm.origin"
    np.testing.assert_allclose([*found["at"], *found["rpy"]], [0.1, 0.0, 0.4, 0.2, -0.3, 0.4], atol=1e-15)
    assert keys["body"][0]["rigid"]["points"] == {"origin": [0.0, 0.0, 0.0], "lens": [0.0, 0.1, 0.0]}
    scene = tmp_path / "scene" / "scene.toml"  # without an analysis yet
    assert "shoulder" in ffrobot.ok("pose", scene).stdout
    ffrobot.ok("export", scene, "--format", "urdf", "-o", tmp_path / "back.urdf")
    again, _ = imported((tmp_path / "back.urdf").read_text(), "--force")
    np.testing.assert_allclose([*again["tool"][0]["at"], *again["tool"][0]["rpy"]], [*found["at"], *found["rpy"]])


def test_keys_of_a_joint(imported):
    dynamics = '<dynamics damping="0" friction="0"/>'
    keys, _ = imported(robot(link("base"), link("arm"), joint("shoulder", "base", "arm", dynamics)))
    assert keys["joint"] == [
        {
            "name": "shoulder", "type": "revolute", "between": ["ground", "arm.origin"], "at": [0.0, 0.0, 0.3],
            "axis": [0.0, 1.0, 0.0], "position_limit": [-1.0, 2.0], "moment_limit": 30.0, "speed_limit": 4.0,
        }
    ]  # fmt: skip
    assert keys["gravity"] == [0.0, 0.0, -9.81]
    assert "trajectory" not in keys
    assert "analysis" not in keys


def test_welds_are_merged_and_their_frames_stay_as_points(imported):
    """Two masses of 2 kg, 0.4 m apart along z: parallel axes."""
    keys, out = imported(
        robot(
            link("base"), link("arm"), link("tool"), link("tip", ""),
            joint("shoulder", "base", "arm"),
            joint("flange", "arm", "tool", kind="fixed", at="0 0 0.4"),
            joint("end", "tool", "tip", kind="fixed", at="0.1 0 0"),
        )
    )  # fmt: skip
    (body,) = keys["body"]
    assert body["rigid"]["mass"] == 4.0
    np.testing.assert_allclose(body["rigid"]["center"], [0, 0, 0.2])
    np.testing.assert_allclose(body["rigid"]["inertia"], [0.04 + 4 * 0.2**2, 0.04 + 4 * 0.2**2, 0.02])
    np.testing.assert_allclose(body["rigid"]["points"]["tip"], [0.1, 0, 0.4])
    assert '"base" (mass 2 kg) is fixed to the ground' in out


def test_quaternions_turn_as_angles_do(tmp_path):
    """URDF 1.1: `quat_xyzw`, scalar last, of joints and of inertias; by any length that digits leave."""
    e = np.array([0.3, -0.2, 0.5, 0.7]) / np.linalg.norm([0.3, -0.2, 0.5, 0.7])
    rpy = " ".join(map(repr, rpy_of(of_quaternion(e[[3, 0, 1, 2]]))))
    found, urdf = [], tmp_path / "robot.urdf"
    for turn in (f'rpy="{rpy}"', f'quat_xyzw="{" ".join(f"{0.99 * x:.17g}" for x in e)}"'):
        arm = link("arm", INERTIAL.replace("<mass", f'<origin xyz="0.1 0 0" {turn}/><mass'))
        text = robot(BASE, arm, joint("j", "base", "arm").replace('xyz="0 0 0.3"', f'xyz="0 0 0.3" {turn}'))
        urdf.write_text(text)
        keys = import_urdf(urdf, tmp_path / "scene", {}, force=True).scene
        found.append([keys["body"][0]["rigid"]["inertia"], keys["joint"][0]["axis"], keys["joint"][0]["rpy"]])
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-14)


LEFT = {
    '<limit lower="-1" upper="2" acceleration="5" jerk="9"/>': '<limit acceleration="5" jerk="9"> of joint "j" left',
    '<dynamics damping="0.1" spring_stiffness="50"/>': '<dynamics spring_stiffness="50"> of joint "j" left out',
    "<safety_controller/>": '<safety_controller> of joint "j" left out; likewise of "k"',
    '<limit effort="1"/>': 'joint "j": no <limit> with a range: it moves without end',
    "": 'joint "j": no <limit> with a range: it moves without end',
}


@pytest.mark.parametrize("inside", LEFT)
def test_all_that_is_left_out_is_told(inside, tmp_path):
    limit = '<limit lower="-1" upper="2" effort="30" velocity="4"/>'
    joints = (joint(*ends).replace(limit, inside) for ends in (("j", "base", "arm"), ("k", "arm", "hand")))
    bent = link("hand", INERTIAL.replace('ixy="0"', 'ixy="0" iyx="0.001" izx="0"'))
    ball = link("arm", INERTIAL + "<collision><geometry><ellipsoid/></geometry></collision>")
    transmission = '<transmission><joint name="k"/></transmission>'
    (tmp_path / "robot.urdf").write_text(robot(BASE, ball, bent, *joints, transmission, "<material/>"))
    remarks = import_urdf(tmp_path / "robot.urdf", tmp_path / "scene", {}).remarks
    told = (LEFT[inside], '<inertia iyx="0.001"> of link "hand" left out', '<ellipsoid> in <collision> of link "arm"',
            '1 <transmission> left out, of "k"')  # fmt: skip
    for text in told:
        assert sum(remark.startswith(text) for remark in remarks) == 1, text
    assert not any("material" in remark for remark in remarks)


def test_mimic_limits_of_zero_and_masses_of_zero_are_told(imported):
    keys, out = imported(
        robot(
            link("base"), link("a"), link("b"), link("camera", ""),
            joint("j", "base", "a"),
            joint("k", "a", "b", '<mimic joint="j" multiplier="-2" offset="0.1"/>'),
            joint("pan", "b", "camera", kind="continuous"),
        ).replace('effort="30"', 'effort="0"', 1)
    )  # fmt: skip
    assert [entry["name"] for entry in keys["joint"]] == ["j", "k"]
    assert 'joint "pan" and link "camera" left out: nothing there has mass' in out
    assert 'joint "k" follows "j": give it a separate trajectory, -2 times that one plus 0.1' in out
    assert 'joint "j": effort limit 0 left out' in out
    assert "moment_limit" not in keys["joint"][0]


def test_names_follow_the_rules_of_scenes(imported):
    text = robot(link("ns/base"), link("ns/arm.v2"), link("ground"), joint("a/b", "ns/base", "ns/arm.v2"),
                 joint("a.b", "ns/arm.v2", "ground"))  # fmt: skip
    keys, out = imported(text)
    assert [body["name"] for body in keys["body"]] == ["ns_arm_v2", "ground_2"]
    assert [entry["name"] for entry in keys["joint"]] == ["a_b", "a_b_2"]
    assert '"ns/arm.v2" is called "ns_arm_v2" in the scene' in out


def test_prefixes_that_are_not_declared(imported):
    """As published files have them: drake:, gazebo:; a namespace of all elements, too."""
    text = robot(link("base"), link("arm"), joint("j", "base", "arm", '<drake:gear ratio="2"/>'))
    text = text.replace("<limit ", '<limit drake:jerk="2" ')
    keys, _ = imported(text.replace("<robot ", '<robot xmlns="http://drake.mit.edu" ', 1))
    assert keys["joint"][0]["moment_limit"] == 30


def test_all_types_of_joints(imported):
    kinds = ("revolute", "continuous", "prismatic", "planar", "floating")
    names = [f"l{k}" for k in range(len(kinds))]
    joints = [joint(f"j{k}", "base", name, kind=kind) for k, (kind, name) in enumerate(zip(kinds, names, strict=True))]
    keys, _ = imported(robot(link("base"), *map(link, names), *joints))
    assert [entry["type"] for entry in keys["joint"]] == ["revolute", "revolute", "prismatic", "planar", "free"]


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, -np.pi / 2, 1.5708, np.pi / 2 - 1e-8])
def test_orientations_of_merged_joints(pitch):
    C = of_rpy([0.4, pitch, -2.5])
    np.testing.assert_allclose(of_rpy_here(*rpy_of(C)), C, atol=1e-15 * 8)


# Refusals of values and elements: tests/exchange/test_hostile_urdfs.py.
BASE, ARM = link("base"), link("arm")
WRONG = {
    "not well-formed": (robot(BASE)[:-8], "found XML that is not well-formed"),
    "xacro": (
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="a"/></robot>',
        "found <xacro:include>: run `xacro FILE.xacro > ROBOT.urdf` first",
    ),
    "two roots": (robot(BASE, ARM), 'expected one link that no joint carries, found 2: "base", "arm"'),
    "circle with a tree": (
        robot(BASE, link("a"), link("b"), joint("j", "a", "b"), joint("k", "b", "a")),
        'found a circle of "a", "b"',
    ),
    "two parents": (
        robot(BASE, ARM, link("c"), joint("j", "base", "arm"), joint("k", "base", "c"), joint("m", "c", "arm")),
        'joint "m": expected one joint that carries link "arm", found a second one',
    ),
    "circle of mimics": (
        robot(BASE, ARM, link("c"), joint("j", "base", "arm", '<mimic joint="k"/>'),
              joint("k", "arm", "c", '<mimic joint="j"/>')),
        "found a circle: j → k → j",
    ),
    "mimic of nothing": (
        robot(BASE, ARM, joint("shoulder", "base", "arm", '<mimic joint="sholder"/>')),
        'expected a joint of the file, found "sholder" (did you mean "shoulder"?)',
    ),
    "unknown link": (
        robot(BASE, ARM, joint("j", "base", "amr")),
        'joint "j": <child>: expected a link of the file, found "amr" (did you mean "arm"?)',
    ),
    "impossible inertia": (
        robot(BASE, link("arm", INERTIAL.replace("0.01", "0.5")), joint("j", "base", "arm")),
        'link "arm": <inertia>: expected no principal moment of inertia larger than the sum of the others',
    ),
    "no mass in between": (
        robot(BASE, link("arm", ""), link("c"), joint("j", "base", "arm"), joint("k", "arm", "c")),
        'link "arm": expected a mass of a body that moves and carries others, found none',
    ),
    "axis without direction": (
        robot(BASE, ARM, joint("j", "base", "arm").replace("0 1 0", "0 0 0")),
        "<axis>: expected a direction, found 0 0 0",
    ),
    "two orientations": (robot(BASE, ARM, joint("j", "base", "arm", at='0 0 1" rpy="0 0 0" quat_xyzw="0 0 0 1')),
                         "expected rpy or quat_xyzw, found both"),
    "a quaternion of length 0": (robot(BASE, ARM, joint("j", "base", "arm", at='0 0 1" quat_xyzw="0 0 0 0')),
                                 "expected a quaternion of length 1, found length 0"),
    "the same name twice": (robot(BASE, BASE), 'found several of the name "base"'),
}  # fmt: skip


def test_a_scene_is_in_a_folder(tmp_path):
    (tmp_path / "robot.urdf").write_text(robot(BASE, ARM, joint("j", "base", "arm")))
    with pytest.raises(InputError, match=r"expected a folder for scene\.toml, found the name of a file: -o .*arm$"):
        import_urdf(tmp_path / "robot.urdf", tmp_path / "arm.toml", {})
    assert not (tmp_path / "arm.toml").exists()


@pytest.mark.parametrize(("text", "expected"), WRONG.values(), ids=WRONG)
def test_wrong_files(text, expected, tmp_path):
    (tmp_path / "robot.urdf").write_text(text)
    with pytest.raises(InputError) as error:
        import_urdf(tmp_path / "robot.urdf", tmp_path / "scene", {})
    assert expected in str(error.value)
    assert all("robot.urdf: " in line for line in str(error.value).splitlines())
    assert not (tmp_path / "scene").exists()


OTHERS = {
    "a.usda": "another program has to convert it", "a.mnf": "Adams", "a.mat": "MATLAB",
    "a.xml": "found <mujoco> of another program", "a.urdf": "found a file that is no XML", "a.mcap": "damaged",
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
def test_files_of_other_kinds(name, tmp_path, refused):
    (tmp_path / name).write_bytes(b'<mujoco model="m"/>' if name == "a.xml" else b"\x89MCAP0\r\n")
    told = refused(tmp_path, "import", name, "-o", "out")
    assert OTHERS[name] in told
    assert len(told.splitlines()) == 1


def test_units_in_a_wrong_scale_are_told(imported):
    """Millimetres in place of metres, kg·mm² in place of kg·m²."""
    _, out = imported(robot(BASE, ARM, joint("j", "base", "arm", at="0 0 425")))
    assert 'joint "j" is 425 m from that of its parent: URDF is in meters; is this file in millimeters?' in out
    heavy = INERTIAL.replace("0.02", "20000").replace("0.01", "10000")
    _, out = imported(robot(BASE, link("arm", heavy), joint("j", "base", "arm")), "--force")
    assert 'link "arm": radius of gyration 100 m, in a robot whose joints span 0.3 m' in out
    base_axes = INERTIAL.replace("<mass", '<origin xyz="0.9 0 1.2"/><mass')
    _, out = imported(robot(BASE, link("arm", base_axes), joint("j", "base", "arm")), "--force")
    assert 'link "arm": its center of mass is 1.5 m from its frame, its inertia within 0.1 m' in out


def test_masses_of_meshes(tmp_path, imported):
    """A cube of 0.1 m as a mesh in mm: 1e-3 m³, so 2000 kg/m³; its inertia of 2 kg is m a²/6 about each axis."""
    cube = pytest.importorskip("trimesh").creation.box((100.0, 100.0, 100.0))
    cube.apply_translation((50.0, 50.0, 50.0)).export(tmp_path / "cube.stl")
    visual = '<visual><geometry><mesh filename="package://{}/cube.stl" scale="1e-3 1e-3 1e-3"/></geometry></visual>'
    arm = link("arm", INERTIAL + visual.format(tmp_path.name))
    _, out = imported(robot(BASE, arm, joint("j", "base", "arm")))
    (row,) = re.findall(r"^arm +closed .*$", out, flags=re.MULTILINE)
    _, _, mass, volume, density, ratio, apart = row.split()
    assert (mass, volume, density) == ("2", "0.001", "2000")
    assert float(ratio) == pytest.approx(3 * 2 * 0.01 / 6 / 0.05, rel=1e-3)
    assert float(apart) == pytest.approx(0.05 * np.sqrt(3), abs=1e-3)
    assert "meshes are skins" in out


def test_an_edited_scene_is_not_replaced(imported, tmp_path, ffrobot, refused):
    """One that is there as the command would write it, as after a kill at its end, is no reason to stop."""
    imported(robot(BASE, ARM, joint("j", "base", "arm")))
    ffrobot.ok("import", tmp_path / "robot.urdf", "-o", tmp_path / "scene")
    with (tmp_path / "scene" / "scene.toml").open("a") as file:
        file.write("# mine\n")
    told = refused(tmp_path, "import", "robot.urdf", "-o", "scene")
    assert "expected a new name, found a file, which may have been edited since" in told
