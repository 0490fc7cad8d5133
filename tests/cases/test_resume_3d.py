"""Runs in 3D that were stopped go on from their results file as if they had never been."""

import pytest
import tables_3d
from stopped_runs import SAME, Stops, differences, go_on
from tables_3d import joint, rigid

import ffrobot

PATCHES = """
[[pzt]]
body = "fore"
count = 3
length = 0.05
width = 0.01
thickness = 0.5e-3
modulus = 63e9
d31 = 110e-12
"""
FORWARD = """
[[analysis]]
name = "forward"
kind = "forward"
actuation = "inverse"
apply = "joints+pzt"
integrator = "dop853"
tolerance = 1e-6
"""


def test_a_body_that_tumbles_goes_on(tmp_path):
    """Where q has a quaternion, which is brought to length one once more: the same to rounding."""
    top, pivot = (
        rigid("top", 2.0, [0.03, 0.05, 0.02], [0.0, 0.0, 0.3]),
        joint("pivot", "spherical", "ground", "top.root"),
    )
    spin = {"name": "spin", "kind": "forward", "end": 20.0, "output_step": 0.05, "tolerance": 1e-9}
    start = {"joint_rates": {"pivot": [3.0, 1.0, 40.0]}}
    tables = tables_3d.scene([top], [pivot], spin, gravity=[0.0, 1.0, -9.81], initial=start)
    scene = ffrobot.make_scene(folder=tmp_path, **tables)
    expected, path = ffrobot.solve(scene), tmp_path / "top.h5"
    with pytest.raises(ffrobot.SolveError, match=r"resume=True\) resumes from t = "):
        ffrobot.solve(scene, path, Stops("spin", 4.0))
    results = ffrobot.solve(scene, path, resume=True)
    assert results.attributes("spin")["steps"] == expected.attributes("spin")["steps"]
    found = dict(differences(results, expected))
    for name in ("bodies/top/quaternion[0]", "bodies/top/angular_velocity[2]", "joints/pivot/reaction[2]"):
        assert found[name] < 1e-10, name


def test_outputs_that_fail_leave_the_integration(case_copy, monkeypatch):
    """It is kept as if it had been stopped at its end: outputs are made from it without another step.

    Of the arm of three joints, a part of its motion, with patches on its forearm.
    """
    scene = case_copy("arm_3r")
    text = scene.read_text(encoding="utf-8").replace("[[analysis]]", PATCHES + "\n[[analysis]]", 1) + FORWARD
    for old, new in (("end = 0.6", "end = 0.2"), ("tolerance = 1e-8", "tolerance = 1e-6")):
        assert old in text, old
        text = text.replace(old, new)
    scene.write_text(text, encoding="utf-8")
    expected, path = ffrobot.solve(scene), scene.with_suffix(".h5")
    with monkeypatch.context() as fault:
        fault.setattr("ffrobot.run.solve.totals", lambda motion: 1 / 0)
        with pytest.raises(ffrobot.SolveError, match=r'"inverse": outputs failed .* kept .*ZeroDivisionError'):
            ffrobot.solve(scene, path)
    kept = ffrobot.Results(path)
    assert kept.attributes("inverse")["status"] == "not evaluated"
    assert len(kept.time("inverse")) == len(expected.time("inverse"))
    results = go_on(scene)
    found = dict(differences(results, expected))
    del found["joints/waist/reaction_moment[2]"]  # along the axis of the motor: round-off of zero
    assert max(found.values()) < SAME
    assert results.attributes("inverse")["evaluations"] < expected.attributes("inverse")["evaluations"] + 5
