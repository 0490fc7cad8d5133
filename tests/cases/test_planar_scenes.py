"""Planar scenes put into space give the planar numbers, whichever way the scene is turned and its bodies are listed."""

import numpy as np
import pytest
import scenes_in_3d
from checkpoint_scene_files import write_scene
from checkpoints import CASES
from scenes_in_3d import CRANK, REST, STRAIGHT, TIGHT, TWO_LINK, close, compare_two_links

import ffrobot
from ffrobot.common.rotations import exponential, of_rpy


def both(case, analyses, guess, folder, payload=None):
    """Results of a planar scene and of the same in 3D."""
    planar = scenes_in_3d.read(CASES / case / "scene.toml")
    planar.pop("pzt", None)
    planar["analysis"] = analyses
    spatial = scenes_in_3d.in_3d(planar) | {"initial": {"joints": guess}, "analysis": analyses}
    if payload is not None:
        J = payload["inertia"]  # about z; the others are of no account in the plane
        planar["payload"], spatial["payload"] = [payload], [payload | {"inertia": [0.7 * J, 0.6 * J, J]}]
    return [
        ffrobot.solve(scenes_in_3d.write(tables, folder / f"{name}.toml"))
        for name, tables in (("planar", planar), ("spatial", spatial))
    ]


GRIPPER = {"point": "link2.tip", "mass": 0.3, "inertia": 2e-3}


@pytest.mark.parametrize("payload", [None, GRIPPER], ids=["bare", "with a payload that has inertia"])
def test_two_links(payload, tmp_path):
    planar, spatial = both("two_link", [TIGHT, STRAIGHT, REST], TWO_LINK, tmp_path, payload)
    with planar, spatial:
        assert spatial.names("inverse/bodies") == planar.names("inverse/bodies")
        assert spatial.names("inverse/joints") == planar.names("inverse/joints")
        for analysis, share in (("inverse", 1e-8), ("straight", 1e-11), ("rest", 1e-9)):
            compare_two_links(planar, spatial, analysis, share)
        for key in ("kinetic", "strain"):
            close(spatial[f"inverse/energy/{key}"], planar[f"inverse/energy/{key}"], 1e-8)


def test_split_of_duties(tmp_path):
    """Links in the shape in which motors are enough: found, and made a spline, twice."""
    split = STRAIGHT | {"name": "split", "shape": "static"}
    planar, spatial = both("two_link_split", [STRAIGHT, split], TWO_LINK, tmp_path)
    with planar, spatial:
        compare_two_links(planar, spatial, "split", 1e-8)


def test_slider_crank_has_redundant_rows_in_3d(tmp_path):
    """A loop of parallel axes: reactions across the plane are not unique, what is in the plane is that of the plane."""
    planar, spatial = both("slider_crank", [TIGHT | {"end": 0.05}], CRANK, tmp_path)
    with planar, spatial:
        close(spatial["inverse/trajectories/slider/force"], planar["inverse/trajectories/slider/force"], 1e-8)
        close(spatial["inverse/bodies/rod/modal"], planar["inverse/bodies/rod/modal"], 1e-8)
        for joint in ("O", "A"):
            for key in ("coordinate", "rate"):
                close(spatial[f"inverse/joints/{joint}/{key}"], planar[f"inverse/joints/{joint}/{key}"], 1e-8)
            name = f"inverse/joints/{joint}/reaction"
            close(spatial[name][:, :2], planar[name], 1e-8)


def turned(tables, C):
    """The scene turned by C (3, 3): gravity, joints on the ground and paths."""
    found = dict(tables)
    found["gravity"] = (C @ tables["gravity"]).tolist()
    joints = []
    for joint in tables["joint"]:
        joint = dict(joint)
        if joint["between"][0] == "ground":
            joint["at"] = (C @ joint["at"]).tolist()
            joint["axis"] = (C @ joint["axis"]).tolist()
            joint["rpy"] = rpy(C @ of_rpy(*joint.get("rpy", [0.0, 0.0, 0.0])))
        joints.append(joint)
    found["joint"] = joints
    (path,) = tables["trajectory"]
    places = [path[key] for key in "xyz"]
    sums = [" + ".join(f"({c!r})*({x})" for c, x in zip(row, places, strict=True)) for row in C.tolist()]
    found["trajectory"] = [path | dict(zip("xyz", sums, strict=True))]
    return found


def rpy(C):
    return [
        float(np.arctan2(C[2, 1], C[2, 2])),
        float(-np.arcsin(np.clip(C[2, 0], -1, 1))),
        float(np.arctan2(C[1, 0], C[0, 0])),
    ]


ARM = [
    TIGHT | {"tolerance": 1e-9, "end": 0.1},
    STRAIGHT,
    REST,
]


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The 3R arm of the checkpoints: tables of its scene, and results."""
    folder = tmp_path_factory.mktemp("arm")
    tables = scenes_in_3d.read(write_scene("arm3_line_static", folder)) | {"analysis": ARM}
    tables["initial"]["state"] = "undeformed"
    with ffrobot.solve(scenes_in_3d.write(tables, folder / "arm.toml")) as results:
        yield tables, results


def same(found, expected, C=None):
    """Motor moments, modes and, turned by C, forces on the path of all analyses to 1e-9 of their peaks."""
    C = np.eye(3) if C is None else C
    for analysis in ("inverse", "straight", "rest"):
        for joint in ("q1", "q2", "q3"):
            peak = max(np.abs(expected[f"{analysis}/joints/{name}/moment"]).max() for name in ("q1", "q2", "q3"))
            name = f"{analysis}/joints/{joint}/moment"
            np.testing.assert_allclose(found[name], expected[name], rtol=0, atol=1e-9 * peak)
        name = f"{analysis}/trajectories/path/force"
        close(found[name], expected[name] @ C.T, 1e-9)
        for body in ("upper", "fore"):
            for key in ("modal", "modal_force"):
                name = f"{analysis}/bodies/{body}/{key}"
                close(found[name], expected[name], 1e-9)
            close(
                found[f"{analysis}/bodies/{body}/position"], expected[f"{analysis}/bodies/{body}/position"] @ C.T, 1e-9
            )


@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_depends_on_how_the_scene_is_turned(seed, arm, tmp_path):
    tables, expected = arm
    vector = np.random.default_rng(seed).standard_normal(3)
    C = exponential(2.5 * vector / np.linalg.norm(vector))
    with ffrobot.solve(scenes_in_3d.write(turned(tables, C), tmp_path / "turned.toml")) as found:
        same(found, expected, C)


def test_nothing_depends_on_the_order_of_bodies(arm, tmp_path):
    tables, expected = arm
    shuffled = tables | {"body": tables["body"][::-1]}
    with ffrobot.solve(scenes_in_3d.write(shuffled, tmp_path / "shuffled.toml")) as found:
        same(found, expected)
