"""Whole runs of scenes in 3D that move in a plane: solved in the plane, their results are those of space."""

import h5py
import numpy as np
import scenes_in_3d
from checkpoint_scenes import rpy
from checkpoints import CASES
from scenes_in_3d import CRANK, TWO_LINK

import ffrobot
from ffrobot.common.rotations import exponential
from ffrobot.mbs.model import system

CLOSE = 1e-9  # of the peak of each dataset; reactions and moments of each kind by the largest of them
OUTPUTS = {"end": 0.02, "output_step": 0.001, "tolerance": 1e-10}
INVERSE = {"name": "inverse", "kind": "pcid"} | OUTPUTS
ROUNDING = "constraint_violation"


def tables_of(case, guess, analyses):
    planar = scenes_in_3d.read(CASES / case / "scene.toml")
    planar.pop("pzt", None)
    return scenes_in_3d.in_3d(planar) | {"initial": {"joints": guess}, "analysis": analyses}


def numbers(path):
    """All datasets of numbers by name."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: (
                found.__setitem__(name, item[()])
                if isinstance(item, h5py.Dataset) and item.dtype.kind == "f" and item.size
                else None
            )
        )
    return found


def in_both(tables, folder, monkeypatch):
    """Numbers of a scene solved in its plane, and in 3D."""
    scene = scenes_in_3d.write(tables, folder / "scene.toml")
    planes, found = [], []
    in_plane = system.in_plane

    def watched(*of_scene):
        planes.append(in_plane(*of_scene))
        return planes[-1]

    for name, chosen in (("plane", watched), ("space", lambda *_: None)):
        monkeypatch.setattr(system, "in_plane", chosen)
        ffrobot.solve(scene, output=folder / f"{name}.h5").close()
        found.append(numbers(folder / f"{name}.h5"))
    assert planes
    assert all(plane is not None for plane in planes)
    return found


def assert_same(plane, space, close=CLOSE):
    assert plane.keys() == space.keys()
    peaks = {}
    for name, values in space.items():
        kind = name.rpartition("/")[2]
        peaks[kind] = max(peaks.get(kind, 0.0), np.abs(values).max())
    peaks["reaction_moment"] = max(peaks["reaction_moment"], peaks["reaction"] * 1.0)  # of links a meter long
    for name, expected in space.items():
        kind = name.rpartition("/")[2]
        if kind != ROUNDING:
            np.testing.assert_allclose(plane[name], expected, rtol=0, atol=close * peaks[kind], err_msg=name)


def test_implicit_integrator(tmp_path, monkeypatch):
    """Steps are the same, each as near to the solution of its equations as Newton's method goes."""
    chosen = {"integrator": "radau", "tolerance": 1e-6, "end": 0.01}
    tables = tables_of("two_link", TWO_LINK, [INVERSE | chosen])
    assert_same(*in_both(tables, tmp_path, monkeypatch), 1e-7)


def test_gravity_across_the_plane_is_carried_by_the_joints(tmp_path, monkeypatch):
    """Reactions across it are those of the inverse sweep in 3D."""
    tables = tables_of("two_link", TWO_LINK, [INVERSE]) | {"gravity": [0.0, -1.0, -9.81]}
    plane, space = in_both(tables, tmp_path, monkeypatch)
    assert_same(plane, space)
    assert np.abs(plane["inverse/joints/O/reaction"][:, 2]).max() > 1.0


def test_a_loop_in_a_plane_that_stands_askew(tmp_path):
    """Its motion is the same, a force along x does its work by the share of x in the slider's way.

    In space rounding gives rows across the plane a mobility: one of these took 720 480 steps in place of 728.
    """
    C = exponential(0.5 * np.random.default_rng(3).standard_normal(3))
    upright = tables_of("slider_crank", CRANK, [INVERSE | {"end": 0.01}])
    askew = tables_of("slider_crank", CRANK, [INVERSE | {"end": 0.01}])
    for joint in askew["joint"]:
        if joint["between"][0] == "ground":
            joint["axis"], joint["rpy"] = (C @ joint["axis"]).tolist(), rpy(C)
    (path,) = askew["trajectory"]
    path["x"] = f"({float(C[0, 0])!r})*({path['x']})"
    found = []
    for name, tables in (("upright", upright), ("askew", askew)):
        scene = scenes_in_3d.write(tables, tmp_path / f"{name}.toml")
        with ffrobot.solve(scene, output=tmp_path / f"{name}.h5") as results:
            assert results.attributes("inverse")["steps"] < 2000
        found.append(numbers(tmp_path / f"{name}.h5"))
    expected, turned = found
    for name, share in (
        ("joints/O/coordinate", 1.0),
        ("joints/A/rate", 1.0),
        ("bodies/rod/modal", 1.0),
        ("trajectories/slider/force", C[0, 0]),
    ):
        values = expected[f"inverse/{name}"]
        np.testing.assert_allclose(
            share * turned[f"inverse/{name}"], values, rtol=0, atol=1e-8 * np.abs(values).max(), err_msg=name
        )
    reaction = turned["inverse/joints/O/reaction"] @ C
    np.testing.assert_allclose(reaction[:, :2], expected["inverse/joints/O/reaction"][:, :2], rtol=0, atol=1e-6)
