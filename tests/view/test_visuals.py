"""Shapes of rigid bodies in pictures: those of a URDF reach the scene, and move with their body; by closed forms."""

import tomllib

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import ffrobot
from ffrobot import InputError, Results
from ffrobot.common.validation import validate
from ffrobot.exchange.urdf.import_urdf import import_urdf
from ffrobot.mbs.scene.bodies import Visual
from ffrobot.pictures.view.view import results_grid

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
MESH_AT, BALL_AT, HIP = [0.1, 0.2, -0.1], [0.0, 0.3, 0.0], np.array([0.0, 0.0, 0.5])
URDF = f"""<robot name="r"><link name="base">{INERTIAL}</link>
<link name="arm">{INERTIAL}
<visual><origin xyz="0.1 0.2 -0.1" rpy="0.3 -0.2 0.5"/>
<geometry><mesh filename="arm.stl" scale="2 1 1"/></geometry></visual>
<visual><geometry><mesh filename="gone.stl"/></geometry></visual></link>
<link name="tool">{INERTIAL}<visual><geometry><sphere radius="0.02"/></geometry></visual></link>
<joint name="hip" type="continuous"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 0.5"/><axis xyz="0 0 1"/></joint>
<joint name="grip" type="fixed"><parent link="arm"/><child link="tool"/><origin xyz="0 0.3 0"/></joint></robot>"""
MOTION = """
[[trajectory]]
name = "hip"
joint = "hip"
value = "2*t"

[[analysis]]
name = "inverse"
kind = "pcid"
end = 0.5
output_step = 0.25
"""


@pytest.fixture
def solved(tmp_path):
    (tmp_path / "robot").mkdir()
    trimesh.creation.box((0.1, 0.1, 0.4)).export(tmp_path / "robot" / "arm.stl")
    (tmp_path / "robot" / "r.urdf").write_text(URDF)
    import_urdf(tmp_path / "robot" / "r.urdf", tmp_path / "scene", {})
    scene = tmp_path / "scene" / "scene.toml"
    scene.write_text(scene.read_text() + MOTION)
    return scene, ffrobot.solve(scene).save(scene.with_suffix(".results.h5"))


def test_shapes_move_with_their_body(solved):
    scene, path = solved
    (body,) = tomllib.loads(scene.read_text())["body"]
    assert body["rigid"]["visual"] == [
        {"mesh": "../robot/arm.stl", "scale": [2, 1, 1], "at": MESH_AT, "rpy": pytest.approx([0.3, -0.2, 0.5])},
        {"sphere": 0.02, "at": BALL_AT},
    ]
    notes = []
    with Results(path) as results:
        grid = results_grid(results, "inverse", np.arange(3), notes)
    assert not notes
    corners = 0.5 * np.array([[x, y, z] for x in (-0.2, 0.2) for y in (-0.1, 0.1) for z in (-0.4, 0.4)])
    for t, points in zip((0.0, 0.25, 0.5), grid.points, strict=True):
        turn = Rotation.from_euler("z", 2 * t)
        box = turn.apply(Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).apply(corners) + MESH_AT) + HIP
        distance = np.linalg.norm(points[:8, None] - box, axis=2)
        assert distance.min(axis=1).max() < 1e-7  # STL has single precision
        assert distance.min(axis=0).max() < 1e-7
        ball = turn.apply(BALL_AT) + HIP
        np.testing.assert_allclose(np.linalg.norm(points[8:] - ball, axis=1), 0.02, rtol=1e-9)


def test_a_missing_mesh_is_noted(solved):
    scene, path = solved
    (scene.parents[1] / "robot" / "arm.stl").unlink()
    notes = []
    with Results(path) as results:
        grid = results_grid(results, "inverse", np.arange(3), notes)
    assert len(notes) == 1
    assert notes[0].startswith("arm is drawn without its mesh: ")
    assert len(grid.points[0]) < 8


@pytest.mark.parametrize("keys", [{}, {"box": [1, 1, 1], "sphere": 1}, {"box": [1, 1, 0]}, {"cylinder": [1]}])
def test_a_visual_is_one_shape(keys, tmp_path):
    with pytest.raises(InputError):
        validate(Visual, keys, tmp_path / "scene.toml")
