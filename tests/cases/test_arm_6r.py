"""The six-axis arm from its URDF: what was imported, its path, and what its links' flexibility costs at the tool."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from checkpoints import CASES, check_table, reference
from rigid_robots import moments, numbers
from scipy.spatial.distance import pdist

from ffrobot.common.rotations import exponential, of_quaternion
from ffrobot.fe_models.modal_body_file import read_modal_body

pytestmark = pytest.mark.nightly  # a minute of solids from STEP: tests/mesh/test_step_files.py has small ones

CASE = CASES / "arm_6r"
JOINTS = ("waist", "shoulder", "elbow", "forearm_roll", "wrist_pitch", "wrist_roll")
DURATION = 0.9  # s, of the motion
PART = '<payload><inertial><origin xyz="0.02 0 0"/><mass value="4"/>'  # as in scene.toml, in axes of the tool
PART += '<inertia ixx="6e-3" ixy="0" ixz="0" iyy="6e-3" iyz="0" izz="6e-3"/></inertial></payload>'


@pytest.fixture(scope="module")
def arm(solved):
    return solved("arm_6r")


def test_the_scene_is_what_import_makes(tmp_path, ffrobot):
    """Bodies, joints and link files: those of the command in the README, to the last letter."""
    files = {"upper_arm": CASE / "links" / "casting.toml", "forearm": CASE / "links" / "tube.toml"}
    flexible = [f"--flexible={link}={file}" for link, file in files.items()]
    ffrobot.ok("import", CASE / "arm.urdf", "-o", tmp_path, *flexible)
    made, kept = ((folder / "scene.toml").read_text(encoding="utf-8") for folder in (tmp_path, CASE))
    assert kept.startswith(made[: made.index("# What is to be computed")])
    for name in ("upper_arm.toml", "forearm.toml"):
        made, kept = (tomllib.loads((folder / name).read_text(encoding="utf-8")) for folder in (tmp_path, CASE))
        for keys in (made, kept):
            if "file" in keys["geometry"]:
                keys["geometry"]["file"] = keys["geometry"]["file"].rpartition("/")[2]
        assert made == kept


def test_the_part_weighs_what_the_urdf_says(arm):
    """<inertial> is that of the exact shape (make_part.py prints it); cells leave out 2e-4 of its round parts."""
    body = read_modal_body(Path(json.loads(arm.file.attrs["modal_bodies"])["upper_arm"]["path"]))
    inertial = ElementTree.parse(CASE / "arm.urdf").find("link[@name='upper_arm']/inertial")
    assert body.mass == pytest.approx(float(inertial.find("mass").get("value")), rel=1e-3)
    x, y, z = numbers(inertial.find("origin"), "xyz")
    np.testing.assert_allclose(body.first_moment / body.mass, [z, x, y], atol=1e-3 * 0.4)  # link: x up, z about y


def target(t):
    """Place (T, 3) and axes (T, 3, 3) of the tool: the path of scene.toml, written again."""
    tau = np.minimum(t / DURATION, 1)
    s = 35 * tau**4 - 84 * tau**5 + 70 * tau**6 - 20 * tau**7
    zero = np.zeros_like(s)
    place = np.stack([0.6 - 0.12 * s, -0.36 + 0.8 * s, 0.12 + 0.16 * s + 9.6 * s**3 * (1 - s) ** 3], axis=1)
    turn = exponential(np.stack([zero, zero, -0.3 + np.pi / 2 * s], axis=1))
    return place, turn @ exponential(np.array([0.0, np.pi / 2, 0.0]))


def deviation(group):
    """Of the tool from its path: distances (T,) in mm and angles (T,) in mrad."""
    place, axes = target(group["time"][()])
    way = 1e3 * np.linalg.norm(group["points/flange.tool/position"][()] - place, axis=1)
    turn = np.swapaxes(axes, 1, 2) @ of_quaternion(group["points/flange.tool/quaternion"][()])
    sine = np.linalg.norm(np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0],
                                    turn[:, 1, 0] - turn[:, 0, 1]]), axis=0) / 2  # fmt: skip
    return way, 1e3 * sine


def deviations(group):
    """At the start, at most and at the end, and the largest turn: as in the README."""
    way, turn = deviation(group)
    return way[0], way.max(), way[-1], turn.max()


def test_straight_links_need_the_moments_of_a_rigid_robot(arm):
    """Newton and Euler on the URDF, the part in the gripper, friction of <dynamics>; accelerations by differences.

    To 2e-3 of the largest: h² q⁗/6 of differences over 5 ms, and 2e-4 of the mass of the upper arm.
    """
    group = arm.file["straight"]
    q, v, tau = (np.array([group[f"joints/{name}/{key}"][()] for name in JOINTS])
                 for key in ("coordinate", "rate", "moment"))  # fmt: skip
    a = np.gradient(v, group["time"][()], axis=1)
    text = (CASE / "arm.urdf").read_text(encoding="utf-8")
    text = text.replace(
        '<link name="tool"/>', PART.replace("payload", "link name='tool'", 1).replace("payload", "link")
    )
    dynamics = np.array([[float(x) for x in pair]
                         for pair in re.findall(r'damping="(.*?)" friction="(.*?)"', text)])  # fmt: skip
    for k in range(20, 180, 20):
        found = moments(text, *(dict(zip(JOINTS, row[:, k], strict=True)) for row in (q, v, a)))
        friction = dynamics[:, 0] * v[:, k] + dynamics[:, 1] * np.tanh(v[:, k] / 0.01)
        expected = np.array([found[name] for name in JOINTS]) + friction
        np.testing.assert_allclose(tau[:, k], expected, atol=2e-3 * np.abs(tau).max())


@pytest.fixture(scope="module")
def behind_gears(arm, ffrobot):
    """The groups of the scenes of behind_gears.py by their names."""
    subprocess.run([sys.executable, CASE / "behind_gears.py", arm.folder], check=True)
    groups = {}
    for name in ("gears", "swift", "slower", "shaped"):
        ffrobot.ok("solve", arm.folder / f"{name}.toml")
        groups[name] = h5py.File(arm.folder / f"{name}.results.h5")[name]
    return groups


def after_path(group):
    """Times (T,) and places (T, 3) of the tool, mm, once the motors stand still."""
    late = group["time"][()] >= group["trajectories/waist"].attrs["end"]
    return group["time"][late], 1e3 * group["points/flange.tool/position"][late]


def test_numbers_behind_gears(behind_gears):
    check_table("arm_6r", "gears", 0.01, lambda row: deviations(behind_gears["gears"]))

    def of_scene(row):
        group = behind_gears[row.removesuffix(".toml")]
        moments = [np.abs(group[f"joints/{joint}/moment"]).max() for joint in ("waist", "shoulder")]
        return [group["trajectories/waist"].attrs["end"], pdist(after_path(group)[1]).max(), *moments]

    check_table("arm_6r", "behind gears", 0.02, of_scene, smallest=2e-3)


def test_joints_where_those_of_the_rigid_arm_are(arm, ffrobot):
    """hold_joints.py makes deviation.csv, which the figure shows, and a line of the README."""
    subprocess.run([sys.executable, CASE / "hold_joints.py", arm.folder], check=True)
    ffrobot.ok("solve", arm.folder / "held.toml")
    table = reference("arm_6r/deviation.csv")
    with h5py.File(arm.folder / "held.results.h5") as file:
        groups = {"joints locked on q_r(t)": file["held"], "torques of the rigid arm": arm.file["rigid_moments"]}
        check_table("arm_6r", "run", 0.02, lambda row: deviations(groups[row]), smallest=1e-6)
        way, _ = deviation(file["held"])
        rows = np.abs(file["held/time"][()][:, None] - np.array(table["t"], dtype=float)).argmin(axis=0)
    np.testing.assert_allclose(way[rows], np.array(table["held"], dtype=float), atol=0.02 * way.max())
