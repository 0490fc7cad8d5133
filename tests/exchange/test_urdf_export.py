"""Scenes in 3D as URDF: motor moments there and back, and where links stand by another reader of URDF (yourdfpy)."""

from xml.etree import ElementTree

import numpy as np
import pytest
import tables_3d
import tomli_w
import yourdfpy
from beam_links import beam_link, tube
from rigid_robots import moments, with_motion
from scipy.spatial.transform import Rotation

from ffrobot import InputError, Results
from ffrobot.exchange.export import export_file

TENSOR = [[0.03, 0.002, -0.001], [0.002, 0.02, 0.003], [-0.001, 0.003, 0.015]]
ARM = tomli_w.dumps({
    "name": "anyhow", "space": "spatial", "gravity": tables_3d.DOWN,
    "body": [
        tables_3d.rigid("turret", 4.0, TENSOR, [0.02, -0.03, 0.1], foot=[0.01, 0.02, -0.1], top=[0.0, 0.05, 0.2]),
        tables_3d.rigid("slide", 2.0, [0.004, 0.02, 0.02], [0.1, 0.0, 0.0], back=[-0.1, 0.02, 0.0],
                        front=[0.3, 0.0, 0.04]),
        tables_3d.rigid("cover", 0.5, [0.001, 0.002, 0.002], [0.0, 0.01, 0.0], rim=[0.05, 0.0, 0.0]),
        tables_3d.rigid("hand", 1.0, [0.002, 0.003, 0.001], [0.0, 0.0, 0.06], wrist=[0.02, -0.01, 0.0],
                        tool=[0.0, 0.03, 0.15]),
    ],
    "payload": [{"point": "hand.tool", "mass": 0.7, "center": [0.0, 0.01, 0.04], "inertia": [0.001, 0.001, 0.0005]}],
    "joint": [
        tables_3d.revolute("waist", "ground", "turret.foot", [0.1, -0.2, 2.0], at=[0.3, -0.2, 0.5],
                           rpy=[0.3, -0.4, 1.1], position_limit=[-2.0, 2.5], moment_limit=90.0),
        # the second side carries the first, twice
        tables_3d.joint("lift", "prismatic", "slide.back", "turret.top", axis=[1.0, 0.5, -0.2], rpy=[1.2, 0.2, -0.7]),
        tables_3d.revolute("wrist", "hand.wrist", "slide.front", [0.0, 1.0, 0.3], rpy=[-0.6, 0.1, 0.2],
                           viscous_friction=0.2),
        tables_3d.joint("lid", "weld", "turret.top", "cover.rim", rpy=[0.0, np.pi / 2, 0.5]),
    ],
})  # fmt: skip
NAMES = ("waist", "lift", "wrist")
MOTION = [dict(zip(NAMES, row, strict=True)) for row in ((0.4, 0.15, -0.8), (1.1, -0.6, 2.0), (-3.0, 2.0, 5.0))]


@pytest.fixture(scope="module")
def solved(tmp_path_factory, ffrobot):
    """The URDF of the arm, and results of the scene and of the scene that comes back."""
    folder = tmp_path_factory.mktemp("anyhow")
    scene, urdf = folder / "scene.toml", folder / "arm.urdf"
    scene.write_text(with_motion(ARM, *MOTION))
    for command in (("export", scene, "--format", "urdf", "-o", urdf), ("import", urdf, "-o", folder / "back")):
        ffrobot.ok(*command)
    back = folder / "back" / "scene.toml"
    back.write_text(with_motion(back.read_text(), *MOTION))
    for file in (scene, back):
        ffrobot.ok("solve", file)
    return urdf, *(Results(file.with_suffix(".results.h5")) for file in (scene, back))


def test_moments_there_and_back(solved):
    """Moments of the scene, of the scene that comes back, and by Newton and Euler from the URDF, without friction."""
    urdf, here, back = solved
    of_urdf = moments(urdf.read_text(), *MOTION)
    scale = max(map(abs, of_urdf.values()))
    for name in NAMES:
        first, again = (results[f"inverse/joints/{name}/moment"] for results in (here, back))
        np.testing.assert_allclose(again, first, rtol=0, atol=1e-10 * scale)
        friction = 0.2 * MOTION[1][name] if name == "wrist" else 0.0
        assert first[0] - friction == pytest.approx(of_urdf[name], abs=1e-10 * scale)


def test_places_by_yourdfpy(solved):
    """Points of bodies and their axes over the motion."""
    urdf, here, _ = solved
    robot = yourdfpy.URDF.load(str(urdf))
    for k in range(2):
        robot.update_cfg({name: float(here[f"inverse/joints/{name}/coordinate"][k]) for name in NAMES})
        for link, point in (("hand_tool", "hand.tool"), ("turret", "turret.foot"), ("cover", "cover.rim")):
            T = robot.get_transform(link, "ground")
            np.testing.assert_allclose(T[:3, 3], here[f"inverse/points/{point}/position"][k], rtol=0, atol=1e-12)
            e = here[f"inverse/points/{point}/quaternion"][k]
            np.testing.assert_allclose(T[:3, :3], rotation(e), rtol=0, atol=1e-12)


def rotation(e):
    """Of a unit quaternion, w first."""
    return Rotation.from_quat(np.roll(e, -1)).as_matrix()


CHAIN = """
name = "chain"
space = "spatial"
gravity = [0.0, 0.0, -9.81]
initial = {{ joint_rates = {{ nut = 3.0 }} }}
analysis = [{{ name = "fall", kind = "forward", end = 0.2, output_step = 0.05, tolerance = 1e-8 }}]
{bodies}
joint = [
    {{ name = "nut", type = "screw", between = ["ground", "one.a"], axis = [0.3, 1.0, 0.2], lead = 0.3, rpy = [0.2, 0.0, 0.4] }},
    {{ name = "tube", type = "cylindrical", between = {tube}, axis = [1.0, 0.2, 0.0], rpy = [0.0, 0.5, 0.0] }},
    {{ name = "cross", type = "universal", between = {cross}, axis = [0.0, 1.0, 0.0], second_axis = [1.0, 0.0, 0.0] }},
    {{ name = "ball", type = "spherical", between = ["three.b", "four.a"] }},
    {{ name = "table", type = "planar", between = ["four.b", "five.a"], axis = [0.0, 1.0, 1.0] }},
]
"""  # noqa: E501
BODIES = "body = [" + ", ".join(
    f'{{ name = "{name}", rigid = {{ mass = 1.0, center = [0.1, 0.0, 0.0], inertia = [0.002, 0.01, 0.01],'
    " points = { a = [-0.1, 0.0, 0.02], b = [0.2, 0.01, 0.0], c = [0.0, 0.1, 0.2] } } }"
    for name in ("one", "two", "three", "four", "five", "free")
) + "]"  # fmt: skip


@pytest.mark.parametrize("backwards", [False, True])
def test_joints_in_steps(backwards, tmp_path, ffrobot):
    """Screw, cylindrical and universal joints in several steps: places by yourdfpy from the scene's coordinates."""
    order = slice(None, None, -1 if backwards else 1)
    tube, cross = (str(list(sides[order])).replace("'", '"') for sides in (("one.b", "two.a"), ("two.b", "three.a")))
    scene, urdf = tmp_path / "scene.toml", tmp_path / "chain.urdf"
    scene.write_text(CHAIN.format(bodies=BODIES, tube=tube, cross=cross))
    for command in (("solve", scene), ("export", scene, "--format", "urdf", "-o", urdf)):
        done = ffrobot.ok(*command)
    for text in ('"ball": 3 joints instead of a spherical one', "angles about x, y, z", '"tube": 2 joints instead'):
        assert text in done.stderr + done.stdout
    results, robot = Results(tmp_path / "scene.results.h5"), yourdfpy.URDF.load(str(urdf))
    types = {joint.get("name"): joint.get("type") for joint in ElementTree.parse(urdf).getroot().findall("joint")}
    assert (types["table"], types["free_free"]) == ("planar", "floating")
    nut, tube, cross = (results[f"fall/joints/{name}/coordinate"] for name in ("nut", "tube", "cross"))
    assert min(np.abs(np.diff(x, axis=0)).min() for x in (nut, tube, cross)) > 1e-4  # all of them move
    for k in range(len(nut)):
        values = {"nut": nut[k], "tube_angle": tube[k, 0], "tube_way": tube[k, 1],
                  "cross_first": cross[k, 0], "cross_second": cross[k, 1]}  # fmt: skip
        robot.update_cfg({name: float(value) for name, value in values.items()})
        T = robot.get_transform("three_c", "ground")
        np.testing.assert_allclose(T[:3, 3], results["fall/points/three.c/position"][k], rtol=0, atol=1e-10)
        np.testing.assert_allclose(T[:3, :3], rotation(results["fall/points/three.c/quaternion"][k]), atol=1e-10)


def test_a_flexible_link_is_its_undeformed_self(tmp_path):
    """Mass, center and inertia of a tube: m L²/12 across, ρ I_p L along its axis; drawn as a cylinder."""
    link = beam_link(0.6, tube(0.02, 0.016), 20, name="rod", modes={"count": 4}, damping={"ratio": 0.01})
    joint = tables_3d.revolute("a", "ground", "rod.root", rotor_inertia=0.1)
    scene, analysis = tmp_path / "rod.toml", {"name": "rest", "kind": "static"}
    bodies = [{"name": "rod", "link": link}]
    scene.write_text(tomli_w.dumps(tables_3d.scene(bodies, [joint], analysis, gravity=[0.0, 0.0, 9.81])))
    told = export_file(scene, "urdf", None, None)
    assert told.path == tmp_path / "rod.urdf"
    for part in ('"rod": rigid in the URDF', "rotor_inertia", "gravity [0.0, 0.0, 9.81] left out"):
        assert any(part in remark for remark in told.remarks)
    link = ElementTree.parse(told.path).getroot().find("link[@name='rod']")
    inertia = {key: float(value) for key, value in link.find("inertial/inertia").attrib.items()}
    mass = 2700.0 * np.pi / 4 * (0.02**2 - 0.016**2) * 0.6
    polar = np.pi / 32 * (0.02**4 - 0.016**4)
    assert float(link.find("inertial/mass").get("value")) == pytest.approx(mass, rel=1e-12)
    assert inertia["ixx"] == pytest.approx(2700.0 * polar * 0.6, rel=1e-9)
    assert inertia["iyy"] == pytest.approx(mass * 0.6**2 / 12, rel=1e-9)
    assert inertia["izz"] == pytest.approx(mass * 0.6**2 / 12, rel=1e-9)
    cylinder = link.find("visual/geometry/cylinder")
    assert (float(cylinder.get("radius")), float(cylinder.get("length"))) == pytest.approx((0.01, 0.6))


def test_what_cannot_be_exported(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(ARM.replace('space = "spatial"', 'space = "planar"'))
    with pytest.raises(InputError, match="gravity"):  # a planar scene is read as one
        export_file(scene, "urdf", None, None)
    scene.write_text(with_motion(ARM, *MOTION))
    with pytest.raises(InputError, match='expected one of "urdf", "fmu" of a scene, found "csv"'):
        export_file(scene, "csv", None, None)
    with pytest.raises(InputError, match="--analysis: expected it with results and FMUs only, found a scene"):
        export_file(scene, "urdf", "inverse", None)
