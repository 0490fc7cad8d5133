"""`keep_steps` and `repeat_steps` of analyses: the same run again, mistakes, and where sensitivity does without."""

from copy import deepcopy

import numpy as np
import pytest
from small_robots import SWING, TUBE

import ffrobot

FORWARD = {"name": "forward", "kind": "forward", "actuation": "inverse", "apply": "joints"}
SCENE = SWING | {"analysis": [*SWING["analysis"], FORWARD]}
IN_SPACE = {
    "space": "spatial",
    "gravity": [0.0, 0.0, -9.81],
    "joint": [SCENE["joint"][0] | {"axis": [0.3, 0.8, 0.5]}],
    "body": [{"name": "arm", "link": TUBE | {"modes": TUBE["modes"] | {"family": "in-plane-bending"}}}],
}


def with_steps(keys, **of_analyses):
    new = deepcopy(keys)
    for analysis in new["analysis"]:
        analysis |= of_analyses
    return new


def histories(results):
    names = ["inverse/joints/shoulder/moment", *(f"{name}/points/arm.tip/position" for name in results.analyses)]
    return np.hstack([results[name].reshape(len(results[name]), -1) for name in names])


@pytest.mark.parametrize("more", [{}, IN_SPACE], ids=["plane", "space"])
def test_the_same_run_again(tmp_path, more):
    """An inverse analysis and its replay with their own steps: equal to rounding; and they keep the same steps."""
    scene = SCENE | more
    with ffrobot.solve(ffrobot.make_scene(**with_steps(scene, keep_steps=True))) as results:
        path = results.save(tmp_path / "kept.h5")
        expected, steps = histories(results), {name: results[f"{name}/step_ends"] for name in results.analyses}
    again = with_steps(scene, keep_steps=True, repeat_steps=str(path))
    with ffrobot.solve(ffrobot.make_scene(**again)) as results:
        for name, ends in steps.items():
            np.testing.assert_array_equal(results[f"{name}/step_ends"], ends)
            assert results.attributes(name)["integrator_reason"] == "steps taken again"
        np.testing.assert_allclose(histories(results), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"end": 0.2}, "expected steps up to 0.2 s, where the run ends, found them up to 0.1 s"),
        ({"name": "other"}, 'expected the steps of an analysis "other", found none'),
        ({"integrator": "radau"}, 'expected integrator = "dop853", which made the steps'),
        ({"check": "finer"}, 'expected no "check" with it'),
        ({"repeat_steps": "kept.hdf"}, 'did you mean "kept.h5"?'),
    ],
)
def test_mistakes(write, tmp_path, changes, message):
    ffrobot.solve(ffrobot.make_scene(**with_steps(SCENE, keep_steps=True)), tmp_path / "kept.h5").close()
    keys = SCENE | {"analysis": [SCENE["analysis"][0] | {"repeat_steps": "kept.h5"} | changes]}
    with pytest.raises(ffrobot.InputError) as told:
        ffrobot.solve(write(keys))
    assert message in str(told.value)


def test_runs_that_cannot_be_repeated_choose_their_own_steps(write):
    """With the implicit integrator: differences as they are of any runs, at the tolerance of those."""
    keys = SCENE | {"analysis": [SCENE["analysis"][0] | {"integrator": "radau", "end": 0.02}]}
    found = ffrobot.sensitivity(write(keys), ["rms joints.shoulder.moment"], ["payload.0.mass"])
    assert {entry.method for row in found.entries for entry in row} == {"differences"}
    assert found.tolerance == 1e-9
