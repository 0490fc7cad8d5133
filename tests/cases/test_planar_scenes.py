"""Planar scenes have the numbers of the same in 3D, however that is turned and its bodies are listed."""

import h5py
import numpy as np
import pytest
from planar_features import COMPARED, FEATURES, peaks, same_models

import ffrobot
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
