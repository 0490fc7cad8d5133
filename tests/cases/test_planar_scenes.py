"""Planar scenes have the numbers of the same in 3D, however that is turned and its bodies are listed."""

import h5py
import numpy as np
import pytest
from checkpoint_scenes import rpy
from planar_features import COMPARED, FEATURES, INVERSE, pair, peaks, same_models
from scenes_in_3d import CRANK

import ffrobot
from ffrobot.common.rotations import exponential
from ffrobot.mbs.model import system


def solved(tables, path, compared=COMPARED):
    """Status by name of what is in the file, datasets that are compared, and linear models of a scene."""
    with ffrobot.solve(ffrobot.make_scene(**tables), output=path) as results, h5py.File(path) as file:
        found = {}
        file.visititems(lambda name, item: found.__setitem__(name, item))
        about = {name: of.attrs.get("status") for name, of in file.items() if isinstance(of, h5py.Group)}
        numbers = {
            name: item[()] for name, item in found.items()
            if isinstance(item, h5py.Dataset) and item.size and name.rpartition("/")[2] in compared
            and not ("/linear/" in name and not name.endswith("frequency"))
        }  # fmt: skip
        for name, item in found.items():
            if name.endswith("/modal_transform") and item.shape[0] > item.shape[1]:  # fewer modes, of own coordinates
                analysis, _, body, _ = name.split("/")
                numbers[f"{analysis}/bodies/{body}/modal"] = results.modal(analysis, body)
                del numbers[f"{analysis}/bodies/{body}/modal_force"]
        return about, numbers, {name: results.linear(name) for name in about if f"{name}/linear" in file}


@pytest.mark.parametrize("feature", FEATURES)
def test_a_planar_scene_is_that_in_3d(feature, tmp_path, monkeypatch):
    """The equations in 3D are integrated as they are, without a projection on the plane in which the robot moves."""
    kind, tables, share = FEATURES[feature]
    planar, spatial = tables()
    about, plane, models = solved(planar, tmp_path / "planar.h5")
    monkeypatch.setattr(system, "in_plane", lambda *_: None)
    about_3d, found, models_3d = solved(spatial, tmp_path / "spatial.h5")
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


def test_gravity_across_the_plane_is_carried_by_the_joints(tmp_path, monkeypatch):
    """Reactions across it are those of the inverse sweep in 3D."""
    tables = pair("two_link", INVERSE)[1] | {"gravity": [0.0, -1.0, -9.81]}
    in_plane, planes, compared = system.in_plane, [], (*COMPARED, "reaction_moment")
    monkeypatch.setattr(system, "in_plane", lambda *of_scene: planes.append(in_plane(*of_scene)) or planes[-1])
    _, plane, _ = solved(tables, tmp_path / "plane.h5", compared)
    monkeypatch.setattr(system, "in_plane", lambda *_: None)
    _, space, _ = solved(tables, tmp_path / "space.h5", compared)
    assert planes
    assert all(plane is not None for plane in planes)
    assert np.abs(plane["inverse/joints/O/reaction"][:, 2]).max() > 1.0
    sizes = peaks(space)
    sizes["reaction_moment"] = max(sizes["reaction_moment"], sizes["reaction"])  # of links a meter long
    assert plane.keys() == space.keys()
    for name, expected in space.items():
        size = sizes[name.rpartition("/")[2]]
        np.testing.assert_allclose(plane[name], expected, rtol=0, atol=1e-9 * size, err_msg=name)


def test_a_loop_in_a_plane_that_stands_askew(tmp_path):
    """Its motion is the same, a force along x does its work by the share of x in the slider's way.

    In space rounding gives rows across the plane a mobility: one of these took 720 480 steps in place of 728.
    """
    C = exponential(0.5 * np.random.default_rng(3).standard_normal(3))
    upright, askew = (pair("slider_crank", INVERSE | {"end": 0.01}, start=CRANK)[1] for _ in range(2))
    for joint in askew["joint"]:
        if joint["between"][0] == "ground":
            joint["axis"], joint["rpy"] = (C @ joint["axis"]).tolist(), rpy(C)
    (path,) = askew["trajectory"]
    path["x"] = f"({float(C[0, 0])!r})*({path['x']})"
    expected, turned = (solved(tables, tmp_path / f"{k}.h5")[1] for k, tables in enumerate((upright, askew)))
    with h5py.File(tmp_path / "1.h5") as file:
        assert file["inverse"].attrs["steps"] < 2000
    for name, share in {
        "joints/O/coordinate": 1.0, "joints/A/rate": 1.0, "bodies/rod/modal": 1.0, "trajectories/slider/force": C[0, 0],
    }.items():  # fmt: skip
        values, found = expected[f"inverse/{name}"], share * turned[f"inverse/{name}"]
        np.testing.assert_allclose(found, values, rtol=0, atol=1e-8 * np.abs(values).max(), err_msg=name)
    reaction = turned["inverse/joints/O/reaction"] @ C
    np.testing.assert_allclose(reaction[:, :2], expected["inverse/joints/O/reaction"][:, :2], rtol=0, atol=1e-6)
