"""What `ffrobot uncertainty` refuses before samples are run."""

import pytest

SCENE = """
name = "arm"
gravity = [0.0, -9.81]
payload = [{ point = "arm.tip", mass = 0.5 }]
joint = [{ name = "shoulder", type = "revolute", between = ["ground", "arm.root"] }]
trajectory = [{ name = "swing", joint = "shoulder", value = "t**2" }]
analysis = [{ name = "inverse", kind = "pcid", end = 0.5, output_step = 0.05 }]

[[body]]
name = "arm"
rigid = { mass = 2.0, center = [0.3, 0.0], inertia = 0.05, points = { root = [0.0, 0.0], tip = [0.6, 0.0] } }
"""
GOOD = "payload.0.mass=±2%"


@pytest.mark.parametrize(
    ("of", "spreads", "options", "message"),
    [
        ("peak of it all", [GOOD], [], '--of: expected "peak HISTORY"'),
        ("mass", ["payload.0.masss=±2%"], [], 'expected a number at payload.0.masss, found none (did you mean "mass"'),
        ("mass", ["payload.0.point=±2%"], [], "--spread: expected a number at payload.0.point, found 'arm.tip'"),
        ("mass", ["payload.1.mass=±2%"], [], '--spread: expected one of "0" in "payload.1.mass"'),
        ("mass", ["payload.0.mass"], [], "--spread: expected KEY=±2%, KEY=±0.1"),
        ("mass", ["payload.0.mass=2%"], [], "--spread: expected KEY=±2%, KEY=±0.1"),
        ("mass", ["payload.0.mass=±0"], [], "with positive spreads"),
        ("mass", ["payload.0.mass=normal:-1"], [], "with positive spreads"),
        ("mass", ["payload.0.mass=uniform:2:1"], [], "with positive spreads"),
        ("mass", ["payload.0.mass=±nan"], [], "with positive spreads"),
        ("mass", ["gravity.0=±1%"], [], "expected a spread in the unit of a key whose value is 0"),
        ("mass", [GOOD, "payload.0.mass=±1%"], [], "expected every key once, found payload.0.mass 2 times"),
        ("mass", ["body.arm.rigid.mass=±200%"], [], "with body.arm.rigid.mass = -2"),
        ("mass", ["body.arm.rigid.mass=normal:60%"], [], "expected spreads with which the scene makes sense"),
        ("mass", [GOOD], ["--samples", "0"], "expected at least 8 samples, found 0"),
        ("mass", [GOOD], ["--by", "gradients", "--indices"], "expected Sobol indices of samples"),
        ("mass", [GOOD], ["--by", "screening", "--indices"], "--indices: expected --by samples next to it"),
        ("mass", [GOOD], ["--by", "screening", "--trajectories", "1"], "--trajectories: expected at least 2, found 1"),
        ("joints.shoulder.moment", [GOOD], ["--by", "screening"], 'such as "peak joints.shoulder.moment"'),
        ("mass", [GOOD, "payload.0.mass=±1%"], ["--by", "screening"], "every key once, found payload.0.mass 2"),
        ("mass", ["body.arm.rigid.mass=±200%"], ["--by", "screening"], "with body.arm.rigid.mass = -2"),
        ("", [GOOD], [], '--of: expected "peak HISTORY"'),
        ("mass", [""], [], "--spread: expected a key such as payload.0.mass"),
        ("mass", ["payload.0.mass="], [], "--spread: expected KEY=±2%, KEY=±0.1"),
    ],
)  # fmt: skip
def test_mistakes_are_told_before_any_run(refused, tmp_path, of, spreads, options, message):
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    arguments = [one for text in spreads for one in ("--spread", text)]
    assert message in refused(tmp_path, "uncertainty", "scene.toml", "--of", of, *arguments, *options)


@pytest.mark.parametrize("of", ["peak joints.shoulder.momentt", "joints.shoulder.momentt", "rms"])
def test_goals_that_are_no_numbers_are_told_after_one_run(ffrobot, tmp_path, of):
    """Which histories there are is known then."""
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    done = ffrobot("uncertainty", tmp_path / "scene.toml", "--of", of, "--spread", GOOD)
    assert done.returncode == 2
    assert 'expected the name of a history, such as "joints.' in done.stderr
    assert len(list((tmp_path / "scene.uncertainty" / "runs").glob("*/row.json"))) == 1
