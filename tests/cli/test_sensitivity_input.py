"""What `ffrobot sensitivity` refuses before anything is run or written."""

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


@pytest.mark.parametrize(
    ("of", "to", "message"),
    [
        ("peak", "payload.0.mass", '--of: expected "peak HISTORY"'),
        ("at noon joints.shoulder.moment", "payload.0.mass", '"at TIME HISTORY"'),
        ("mass", "payload.0.masss", '--to: expected a number at payload.0.masss, found none (did you mean "mass"?)'),
        ("mass", "payload.0.point", "--to: expected a number at payload.0.point, found 'arm.tip'"),
        ("mass", "payload.1.mass", '--to: expected one of "0" in "payload.1.mass", found "1"'),
        ("mass", "links.arm.geometry.length", "--to: expected links.BODY.KEY with a body that has a link file (none)"),
        ("mass", "payload..mass", "--to: expected a key such as payload.0.mass"),
    ],
)
def test_mistakes_are_told_before_any_run(refused, tmp_path, of, to, message):
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    assert message in refused(tmp_path, "sensitivity", "scene.toml", "--of", of, "--to", to)
