"""Singular postures and limits of joints along a path in space: a wrist of three axes that turns its tool about y."""

import h5py
import pytest

BODY = """
[[body]]
name = "{name}"
[body.rigid]
mass = 1.0
inertia = [0.02, 0.03, 0.04]
center = [0.0, 0.0, 0.0]
points = {{ in = [0.0, 0.0, 0.0], out = [0.0, 0.0, 0.1] }}

[[joint]]
name = "q{number}"
type = "revolute"
between = ["{inner}", "{name}.in"]
axis = {axis}
{keys}
"""
HEAD = 'name = "wrist"\nspace = "spatial"\ngravity = [0.0, 0.0, -9.81]\n'
PATH = """
[[trajectory]]
name = "turn"
point = "c.out"
rpy = ["0", "{pitch}", "0"]

[initial]
joints = {{ q2 = {start} }}

[[analysis]]
name = "inverse"
kind = "pcid"
end = 1.0
output_step = 0.01
tolerance = 1e-8
"""


def wrist(folder, pitch, start, keys=""):
    axes = ("[0, 0, 1]", "[0, 1, 0]", "[0, 0, 1]")
    inner, text = "ground", HEAD
    for number, (name, axis) in enumerate(zip("abc", axes, strict=True), 1):
        text += BODY.format(name=name, number=number, inner=inner, axis=axis, keys=keys if number == 2 else "")
        inner = f"{name}.out"
    path = folder / "scene.toml"
    path.write_text(text + PATH.format(pitch=pitch, start=start))
    return path


def results(path):
    with h5py.File(path.with_suffix(".results.h5")) as file:
        group = file["inverse"]
        return (
            group.attrs["status"],
            list(group.attrs["warnings"]),
            group["time"][()],
            group["joints/q2/coordinate"][()],
        )


def test_a_singular_posture_ends_the_run(tmp_path, ffrobot):
    """Axes 1 and 3 in line at t = 0.5: what there is before is kept."""
    path = wrist(tmp_path, "0.5-t", 0.5)
    done = ffrobot("solve", path)
    assert done.returncode == 1
    status, warnings, time, _ = results(path)
    assert status == "diverged"
    assert time[-1] > 0
    (warning,) = warnings
    assert 'a singular posture: motions of "q1", "q3" against each other' in warning
    assert "at t = 0." in warning


def test_a_nearly_singular_posture_is_told(tmp_path, ffrobot):
    path = wrist(tmp_path, "0.0005+0.4*exp(-(4*t)**2)", 0.4005)
    done = ffrobot("solve", path)
    assert done.returncode == 0, done.stderr
    status, warnings, _, _ = results(path)
    assert status == "completed"
    assert [text for text in warnings if "nearly a singular posture (ratio 2.5e-04)" in text and '"q1", "q3"' in text]


@pytest.mark.parametrize(("pitch", "told"), [("0.5+0.3*t**2", True), ("0.5+0.1*t**2", False)])
def test_limits_of_positions_are_watched(pitch, told, tmp_path, ffrobot):
    path = wrist(tmp_path, pitch, 0.5, "position_limit = [0.0, 0.65]")
    done = ffrobot("solve", path)
    assert done.returncode == 0, done.stderr
    _, warnings, time, q2 = results(path)
    if told:
        (warning,) = warnings
        first = time[q2 > 0.65][0]
        assert f'joint "q2": leaves its position_limit [0, 0.65] rad at t = {first:.6g} s' in warning
        assert "from 0.5 to 0.8 rad" in warning
    else:
        assert not warnings
