"""Scenes in 3D through `ffrobot solve`, against an independent code: all quantities to 1e-6 of their peaks."""

import h5py
import numpy as np
import pytest
import tomli_w
from beam_links import beam_link, circle
from checkpoint_mechanisms import load
from checkpoint_scene_files import close, write_scene
from tables_3d import pin, planar

from ffrobot import Results

SOLVED = (
    "arm3_line_undeformed",  # its static start and its circle: test_cases.py
    "stanford",
    "slider_crank_3d",
    "arm5_tool_axis",
    "arm6_static",
    "arm6_undeformed",
)


@pytest.fixture(scope="module", params=SOLVED)
def solved(request, tmp_path_factory, ffrobot):
    scene = write_scene(request.param, tmp_path_factory.mktemp(request.param))
    done = ffrobot.ok("solve", scene, "--verbose")
    told = [line for line in done.stdout.splitlines() if line.startswith("warning  ")]
    known = ("no actuator provides all modal forces", "bends by")  # no patches and stiffening, as the reference has it
    assert all(any(text in line for text in known) for line in told)
    with h5py.File(scene.with_suffix(".results.h5")) as file:
        yield load(request.param), file


def test_joints_and_motors(solved):
    data, file = solved
    samples, names = data["samples"], list(file["inverse/joints"])
    for key, dataset in (("joints", "coordinate"), ("joint_rates", "rate")):
        expected = np.array([sample[key] for sample in samples])
        if "crank" in names:
            close(file[f"inverse/joints/crank/{dataset}"], expected[:, 0])
            close(file[f"inverse/joints/universal/{dataset}"], expected[:, 1:])
        else:
            for number, name in enumerate(names):
                close(file[f"inverse/joints/{name}/{dataset}"], expected[:, number])
    if "crank" in names:
        close(file["inverse/joints/crank/moment"], [sample["motor_moment"] for sample in samples])
    else:
        expected = np.array([sample["moments"] for sample in samples])
        for number, name in enumerate(names):
            close(file[f"inverse/joints/{name}/moment"], expected[:, number], np.abs(expected).max())


def test_force_on_the_path(solved):
    data, file = solved
    force = file["inverse/trajectories/path/force"]
    expected = np.array([sample["path_force"] for sample in data["samples"]])
    close(force, expected[:, : force.shape[1]])
    if "guide" in file["inverse/joints"]:  # its reaction holds the slider across: the other two rows of the numbers
        close(file["inverse/joints/guide/reaction"][:, 1:], expected[:, 1:])


def test_bodies_and_points(solved):
    data, file = solved
    samples = data["samples"]
    for name in samples[0]["bodies"]:
        if name == "cross":
            continue
        group, of_body = file[f"inverse/bodies/{name}"], [sample["bodies"][name] for sample in samples]
        close(group["position"], [each["position"] for each in of_body], 1.0)
        e, expected = group["quaternion"][()], np.array([each["quaternion"] for each in of_body])
        assert np.all(np.abs(np.abs(np.sum(e * expected, axis=1)) - 1) < 1e-12)
        assert np.all(np.sum(e[1:] * e[:-1], axis=1) > 0)
        for key in ("modal", "modal_velocity", "modal_force"):
            if key in of_body[0]:
                close(group[key], [each[key] for each in of_body])
    for name in samples[0]["points"]:
        close(file[f"inverse/points/{name}/deflection"], [sample["points"][name]["deflection"] for sample in samples])


@pytest.mark.parametrize(("family", "is_rigid"), [("axial", True), ("torsion", True), ("in-plane-bending", False)])
def test_links_say_what_they_cannot_do_in_the_plane(tmp_path, ffrobot, family, is_rigid):
    """Likewise; and nothing is claimed of what modes that are not there would do."""
    link = beam_link(0.6, circle(0.02), 8, name="arm", modes={"count": 3, "family": family})
    path = {"name": "path", "joint": "j", "value": "0.5*(10*t**3 - 15*t**4 + 6*t**5)"}
    scene = planar(
        [{"name": "arm", "link": link}], [pin("j", "ground", "arm.root")],
        {"name": "run", "kind": "pcid", "end": 1.0, "output_step": 0.1}, initial={"state": "static"}, trajectory=[path],
    )  # fmt: skip
    (tmp_path / "scene.toml").write_text(tomli_w.dumps(scene))
    done = ffrobot.ok("solve", tmp_path / "scene.toml", "-o", tmp_path / "results.h5", "--verbose")
    told = " ".join(done.stdout.split())
    assert ("arm: rigid in in-plane-bending, of which its file has no modes" in told) == is_rigid
    assert ("modes: not estimated: rigid without modes: arm in in-plane-bending" in told) == is_rigid
    assert ("of peaks, estimated" in told) != is_rigid
    with Results(tmp_path / "results.h5") as results:
        assert ("mode_error" in results.attributes("run")) != is_rigid


def test_motor_that_is_not_there_is_told(tmp_path, ffrobot):
    scene = write_scene("arm3_line_undeformed", tmp_path)
    text = scene.read_text().replace('name = "q3"\n', 'name = "q3"\nmotor = false\n')
    scene.write_text(text.replace("tolerance = 1e-08", "tolerance = 1e-5"))
    done = ffrobot("solve", scene, "--strict")
    assert done.returncode == 1
    assert "joints without motor: q3" in done.stdout + done.stderr
