"""The cases in 3D through `ffrobot solve`, against an independent code."""

import numpy as np
import pytest
from checkpoints import CASES, check_column, peak, readme_table, reference

RELATIVE = 1e-6  # of each quantity's peak
ARM_RUNS = [("line", "static"), ("circle", "static"), ("circle", "undeformed")]  # the other one: test_scenes.py


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


def test_solid_links_take_other_link_files_alone():
    """Beams become solids without a change of the scene."""
    beams, solids = ((CASES / name / "scene.toml").read_bytes() for name in ("two_link", "two_link_solid"))
    assert beams == solids
