"""Runs in 3D that were stopped go on from their results file as if they had never been."""

import pytest
import tables_3d
from stopped_runs import SAME, Stops, differences
from tables_3d import joint, rigid

import ffrobot


def top(folder, end):
    body = rigid("top", 2.0, [0.03, 0.05, 0.02], [0.0, 0.0, 0.3])
    pivot = joint("pivot", "spherical", "ground", "top.root")
    spin = {"name": "spin", "kind": "forward", "end": end, "output_step": 0.05, "tolerance": 1e-9}
    start = {"joint_rates": {"pivot": [3.0, 1.0, 40.0]}}
    tables = tables_3d.scene([body], [pivot], spin, gravity=[0.0, 1.0, -9.81], initial=start)
    return ffrobot.make_scene(folder=folder, **tables)


def test_a_body_that_tumbles_goes_on(tmp_path):
    """Where q has a quaternion, which is brought to length one once more: the same to rounding."""
    scene, path = top(tmp_path, 20.0), tmp_path / "top.h5"
    expected = ffrobot.solve(scene)
    with pytest.raises(ffrobot.SolveError, match=r"resume=True\) resumes from t = "):
        ffrobot.solve(scene, path, Stops("spin", 4.0))
    results = ffrobot.solve(scene, path, resume=True)
    assert results.attributes("spin")["steps"] == expected.attributes("spin")["steps"]
    found = dict(differences(results, expected))
    for name in ("bodies/top/quaternion[0]", "bodies/top/angular_velocity[2]", "joints/pivot/reaction[2]"):
        assert found[name] < 1e-10, name


def test_outputs_that_fail_leave_the_integration(tmp_path, monkeypatch):
    """It is kept as if it had been stopped at its end: outputs are made from it without another step."""
    scene, path = top(tmp_path, 1.0), tmp_path / "top.h5"
    expected = ffrobot.solve(scene)
    with monkeypatch.context() as fault:
        fault.setattr("ffrobot.run.result.totals", lambda run: 1 / 0)
        with pytest.raises(ffrobot.SolveError, match=r'"spin": outputs failed .* kept .*ZeroDivisionError'):
            ffrobot.solve(scene, path)
    kept = ffrobot.Results(path)
    assert kept.attributes("spin")["status"] == "not evaluated"
    assert len(kept.time("spin")) == len(expected.time("spin"))
    results = ffrobot.solve(scene, path, resume=True)
    found = dict(differences(results, expected))
    assert max(of for name, of in found.items() if not name.startswith("joints/pivot/reaction_moment")) < SAME
    assert results.attributes("spin")["evaluations"] < expected.attributes("spin")["evaluations"] + 5
