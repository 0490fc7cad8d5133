"""Planar scenes have the numbers of the same in 3D, however that is turned and its bodies are listed."""

import h5py
import numpy as np
import pytest
import scenes_in_3d
from checkpoint_scene_files import write_scene
from planar_features import COMPARED, FEATURES, peaks, same_models
from scenes_in_3d import REST, STRAIGHT, TIGHT, close

import ffrobot
from ffrobot.common.rotations import exponential, of_rpy
from ffrobot.mbs.model import system

ATTRIBUTES = ("status", "check_point", "check_modes", "check_error", "check_status")


def solved(tables, path):
    """Datasets that are compared, attributes of the analyses, and linear models of a scene."""
    with ffrobot.solve(ffrobot.make_scene(**tables), output=path) as results, h5py.File(path) as file:
        found = {}
        file.visititems(lambda name, item: found.__setitem__(name, item))
        about = {
            name: {key: file[name].attrs[key] for key in ATTRIBUTES if key in file[name].attrs}
            for name in file
            if isinstance(file[name], h5py.Group)
        }
        numbers = {
            name: item[()] for name, item in found.items()
            if isinstance(item, h5py.Dataset) and item.size and name.rpartition("/")[2] in COMPARED
            and not ("/linear/" in name and not name.endswith("frequency"))
            and not ("link1" in name and "actuation" in name)  # points of other components in the plane
        }  # fmt: skip
        return about, numbers, {name: results.linear(name) for name in about if f"{name}/linear" in file}


@pytest.mark.parametrize("feature", FEATURES)
def test_a_planar_scene_is_that_in_3d(feature, tmp_path, monkeypatch):
    """The equations in 3D are integrated as they are, without a projection on the plane in which the robot moves."""
    kind, tables, share = FEATURES[feature]
    planar, spatial = tables()
    about, plane, models = solved(planar, tmp_path / "planar.h5")
    monkeypatch.setattr(system, "in_plane", lambda *_: None)
    about_3d, found, models_3d = solved(spatial, tmp_path / "spatial.h5")
    errors = [[one[name].pop("check_error", 0.0) for name in about] for one in (about, about_3d)]
    assert errors[1] == pytest.approx(errors[0], rel=1e-2)  # of replays at 1e-5 of the path
    assert about_3d == about
    for name, of_plane in models.items():
        same_models(of_plane, models_3d[name], share)
    assert any(name.endswith(kind) for name in plane)
    sizes = peaks(plane)
    for name, expected in plane.items():
        there = found[name]
        if there.shape != expected.shape:  # vectors in 3D
            assert there.shape[:-1] == expected.shape[:-1]
            there = there[..., : expected.shape[-1]]
        size = sizes[name.rpartition("/")[2]]
        np.testing.assert_allclose(there, expected, rtol=0, atol=share * max(size, 1e-9), err_msg=name)


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
