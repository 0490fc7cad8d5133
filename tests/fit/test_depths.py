"""Stable depths of cut of an arm assembled in NumPy: over turns of the tool, and with the errors of a fit."""

import copy
from io import StringIO

import h5py
import numpy as np
import pytest
import tomli_w
from rich.console import Console
from rigid_chain import ARM, TOOL, frames, receptance, scene
from scipy.spatial.transform import Rotation

from ffrobot.batch.batch import batch_of
from ffrobot.common.errors import InputError
from ffrobot.fit.covariance import read_covariance, with_deviations
from ffrobot.map.map_file import print_map, write_map
from ffrobot.map.pose_map import make_map, plan_map
from ffrobot.milling.process import read_milling
from ffrobot.pictures.studies.pose_map import draw_map
from ffrobot.run.watcher import Watcher

POSE = [0.0, 0.0, 0.2, -0.8, 1.5, 0.3, 0.7, 0.1]
AXIS = np.array([0.0, 0.6, 0.8])
PROCESS = {
    "teeth": 3, "tangential": 6e8, "radial": 2e8, "entry": "90*deg", "exit": "180*deg", "axis": AXIS.tolist(),
    "speeds": "3000:9000:7",
}  # fmt: skip


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    folder = tmp_path_factory.mktemp("turned")
    (folder / "arm.toml").write_text(tomli_w.dumps(scene(ARM, TOOL, POSE)))
    (folder / "cutter.toml").write_text(tomli_w.dumps(PROCESS))
    over = ("tilt_x=0", "tilt_y=0", "turn=-40*deg:40*deg:5")
    plan = plan_map(folder / "arm.toml", over, folder / "map", milling=read_milling(folder / "cutter.toml"))
    with batch_of(1) as batch:
        return make_map(plan, batch, Watcher())


def depth(pose, milling, chain=ARM, lines=8_000):
    """1/(2 max Re ν) of the averaged forces of the worst of twelve feeds, from receptances at many frequencies."""
    G = receptance(chain, pose, np.array(TOOL), np.geomspace(2.0, 400.0, lines))
    A = np.array([milling.average @ E @ G @ E.T for E in milling.feeds(np.eye(3))])
    mean, det = np.trace(A, axis1=-2, axis2=-1) / 2, np.linalg.det(A)
    return 0.5 / (mean.real + np.abs(np.sqrt(mean**2 - det).real)).max()


def test_a_turned_tool_keeps_its_place_and_its_axis(mapped):
    """Poses by the frames of the arm; the depth of one of them by its receptances."""
    assert (mapped.status == 0).all()
    of_tool = [frames(ARM, q[:8])[-1] for q in mapped.q]
    places = np.array([o + R @ TOOL for o, _, R in of_tool])
    np.testing.assert_allclose(places, places[[2]].repeat(5, axis=0), atol=1e-9)
    for turn, (_, _, R) in zip(np.radians([-40, -20, 0, 20, 40]), of_tool, strict=True):
        np.testing.assert_allclose(R, Rotation.from_rotvec(turn * AXIS).as_matrix() @ of_tool[2][2], atol=1e-9)
    np.testing.assert_allclose(mapped.q[:, :2], 0.0, atol=1e-12)
    found = mapped.values["joints_compliant/milling_depth"]
    assert found[4] == pytest.approx(depth(mapped.q[4, :8], mapped.plan.milling), rel=1e-3)


def test_the_best_turn_is_stored_printed_and_drawn(mapped):
    found, console = mapped.values["joints_compliant/milling_depth"], StringIO()
    print_map(mapped, Console(file=console, width=160))
    angle = [-40, -20, 0, 20, 40][int(found.argmax())]
    assert f"{1e3 * found.max():.4g} mm at all places with the tool turned by {angle}°" in console.getvalue()
    assert "mm in the worst pose with the best feed, along (" in console.getvalue()
    with h5py.File(write_map(mapped)) as file:
        assert np.degrees(file["joints_compliant/best_turn"][0, 0]) == pytest.approx(angle)
        assert file["joints_compliant/best_turn_depth"][0, 0] == found.max()
    assert "lobes_compliant" in {file.stem for file in draw_map(mapped)}


def test_deviation_of_the_depth_is_that_of_samples(mapped, tmp_path):
    """Correlated errors of two parameters, by 40 draws of the arm in NumPy: their spread is known to 11 %."""
    keys, deviation, correlation = ("joint.elbow.stiffness", "joint.elbow.damping"), np.array([0.04, 0.1]), 0.6
    table = {"keys": keys, "deviation": deviation.tolist(), "correlation": [[1.0, correlation], [correlation, 1.0]]}
    (tmp_path / "fitted.covariance.toml").write_text(tomli_w.dumps(table))
    errors_of_fit = read_covariance(tmp_path / "fitted.covariance.toml")
    found = with_deviations(mapped, errors_of_fit).values["joints_compliant/milling_deviation"]
    errors = np.random.default_rng(4).multivariate_normal([0.0, 0.0], [[1.0, correlation], [correlation, 1.0]], 40)
    pose, depths = mapped.q[2, :8], []
    for error in errors * deviation:
        chain = copy.deepcopy(ARM)
        chain[4].k, chain[4].d = chain[4].k * np.exp(error[0]), chain[4].d * np.exp(error[1])
        depths.append(depth(pose, mapped.plan.milling, chain, 1_500))
    assert found[2] == pytest.approx(np.std(depths), rel=0.3)
    (tmp_path / "bad.toml").write_text(tomli_w.dumps(table | {"correlation": [[1.0, 2.0], [2.0, 1.0]]}))
    (tmp_path / "short.toml").write_text(tomli_w.dumps(table | {"deviation": [0.1]}))
    (tmp_path / "half.toml").write_text(tomli_w.dumps(table | {"correlation": [[1.0, 0.6], [0.0, 1.0]]}))
    (tmp_path / "covariance.toml").write_text(tomli_w.dumps(table | {"correlation": [[4.0, 0.6], [0.6, 9.0]]}))
    for name, wrong in (
        ("bad.toml", "without negative eigenvalues"),
        ("short.toml", "for each of 2 keys"),
        ("half.toml", "a symmetric matrix with 1 on its diagonal"),
        ("covariance.toml", "a symmetric matrix with 1 on its diagonal"),
    ):
        with pytest.raises(InputError, match=wrong):
            with_deviations(mapped, read_covariance(tmp_path / name))


def test_turns_need_a_tool_that_mills(mapped):
    with pytest.raises(InputError, match="--over: turn: expected --milling with the axis"):
        plan_map(mapped.plan.scene, ("turn=0:1:3",), mapped.plan.folder)


def test_the_axis_of_a_tool_frame_is_in_its_own_axes(mapped, tmp_path):
    """The same turns and depths with z of a frame along the axis at the start."""
    upright = Rotation.from_rotvec([-np.arctan2(0.6, 0.8), 0.0, 0.0])
    rpy = (Rotation.from_matrix(frames(ARM, POSE)[-1][2]).inv() * upright).as_euler("xyz").tolist()
    of_tool = scene(ARM, TOOL, POSE) | {"tool": [{"name": "cutter", "point": "body7.end", "rpy": rpy}]}
    (tmp_path / "arm.toml").write_text(tomli_w.dumps(of_tool))
    (tmp_path / "cutter.toml").write_text(tomli_w.dumps(PROCESS | {"axis": [0.0, 0.0, 1.0]}))
    over, milling = ("tilt_x=0", "tilt_y=0", "turn=0:40*deg:2"), read_milling(tmp_path / "cutter.toml")
    plan = plan_map(tmp_path / "arm.toml", over, tmp_path / "map", "body7.cutter", milling=milling)
    with batch_of(1) as batch:
        found = make_map(plan, batch, Watcher())
    np.testing.assert_allclose(found.q, mapped.q[[2, 4]], atol=1e-7)
    for name in ("milling_best_depth", "milling_depth"):
        expected = mapped.values[f"joints_compliant/{name}"][[2, 4]]
        np.testing.assert_allclose(found.values[f"joints_compliant/{name}"], expected, rtol=0.02)
