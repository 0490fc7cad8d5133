"""The cases in 3D through `ffrobot solve`, against an independent code, and by what has to hold in any motion."""

import numpy as np
import pytest
from checkpoints import CASES, check_column, peak, readme_table, reference

RELATIVE = 1e-6  # of each quantity's peak
ARM_RUNS = [("line", "static"), ("circle", "static"), ("circle", "undeformed")]  # the other one: test_scenes.py
ARM_LENGTHS = {"upper": 0.7, "fore": 0.6}  # m


@pytest.fixture(scope="module", params=ARM_RUNS, ids="-".join)
def arm(request, solved):
    """The arm on both paths from both starts, as its README says: path, start, solved case."""
    path, start = request.param

    def edit(text):
        assert 'state = "static"' in text
        return text.replace('state = "static"', f'state = "{start}"')

    return path, start, solved("arm_3r", edit, scene={"line": "scene.toml", "circle": "circle.toml"}[path])


def test_arm_at_the_checkpoints(arm):
    path, start, case = arm
    table = reference(f"arm_3r/reference_{path}_{start}.csv")
    times = np.array(table.pop("t"), dtype=float)
    for name, printed in table.items():
        check_column(case, "inverse", name, times, printed, RELATIVE)


@pytest.mark.parametrize(
    "arm", [*ARM_RUNS, pytest.param(("line", "undeformed"), marks=pytest.mark.nightly)], indirect=True, ids="-".join
)
def test_numbers_of_the_readme(arm):
    path, start, case = arm
    group = case.file["inverse"]
    moments = [peak(group[f"joints/{joint}/moment"]) for joint in ("waist", "shoulder", "elbow")]
    force = np.linalg.norm(group["trajectories/tool/force"], axis=1).max()
    across = 1e3 * np.abs(group["points/fore.tip/deflection"][:, 1:]).max(axis=0)
    printed = readme_table("arm_3r", "run")[f"{path}, {start}"]
    np.testing.assert_allclose([*moments, force, *across], printed, rtol=1e-3)


def test_arm_is_on_its_path_and_in_one_piece(arm):
    """From the outputs alone: the tip, the two joints, the lengths of links that hardly stretch."""
    *_, case = arm
    group = case.file["inverse"]
    at = {name: group[f"points/{name}/position"][()] for name in ("column.top", "upper.root", "upper.tip", "fore.root",
                                                                  "fore.tip")}  # fmt: skip
    np.testing.assert_allclose(at["fore.tip"], group["trajectories/tool/target"], rtol=0, atol=1e-9)
    np.testing.assert_allclose(at["column.top"], at["upper.root"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(at["upper.tip"], at["fore.root"], rtol=0, atol=1e-12)
    for link, length in ARM_LENGTHS.items():
        along, *across = group[f"points/{link}.tip/deflection"][()].T
        chord = np.linalg.norm(at[f"{link}.tip"] - at[f"{link}.root"], axis=1)
        np.testing.assert_allclose(chord, np.hypot(length + along, np.hypot(*across)), atol=1e-12)


def test_loop_is_closed(slider_crank_3d):
    """From the outputs alone: the crank's circle about its axis, the pin on the guide, both ends of the rod."""
    group = slider_crank_3d.file["inverse"]
    at = {name: group[f"points/{name}/position"][()] for name in ("crank.tip", "rod.root", "rod.tip", "slider.pin")}
    np.testing.assert_allclose(at["crank.tip"], at["rod.root"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(at["rod.tip"], at["slider.pin"], rtol=0, atol=1e-10)
    np.testing.assert_allclose(at["slider.pin"][:, 0], 0.42 + 0.08 * np.sin(30 * group["time"][()]), rtol=0, atol=1e-10)
    np.testing.assert_allclose(at["slider.pin"][:, 1:], np.tile([0.03, 0.1], (len(at["crank.tip"]), 1)), atol=1e-10)
    axis = np.array([0.19047253607043549, -0.47618134017608871, 0.85847046790847781])  # scene.toml
    np.testing.assert_allclose(at["crank.tip"] @ axis, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(at["crank.tip"], axis=1), 0.12, atol=1e-12)


def test_slider_moves_by_its_own_forces(slider_crank_3d):
    """Newton's law of the slider, 0.3 kg: path, guide, ball and weight give m ẍ; across the guide, nothing."""
    group = slider_crank_3d.file["inverse"]
    total = group["joints/ball/reaction"][()] + group["joints/guide/reaction"][()] + 0.3 * np.array([0.0, 0.0, -9.81])
    total[:, 0] += group["trajectories/slider/force"][:, 0]
    expected = np.zeros_like(total)
    expected[:, 0] = -0.3 * 0.08 * 30**2 * np.sin(30 * group["time"][()])
    np.testing.assert_allclose(total, expected, rtol=0, atol=1e-8 * np.abs(total).max())
    assert np.abs(group["joints/guide/reaction"][:, 0]).max() < 1e-9 * np.abs(total).max()


def test_solid_links_take_other_link_files_alone():
    """Beams become solids without a change of the scene."""
    beams, solids = ((CASES / name / "scene.toml").read_bytes() for name in ("two_link", "two_link_solid"))
    assert beams == solids
