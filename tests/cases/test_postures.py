"""Singular postures along a path in 3D: of a wrist of three axes that turns its tool about y, and of an arm with it."""

import re

import h5py
import numpy as np

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


def wrist(folder, pitch, start):
    axes = ("[0, 0, 1]", "[0, 1, 0]", "[0, 0, 1]")
    inner, text = "ground", HEAD
    for number, (name, axis) in enumerate(zip("abc", axes, strict=True), 1):
        text += BODY.format(name=name, number=number, inner=inner, axis=axis)
        inner = f"{name}.out"
    path = folder / "scene.toml"
    path.write_text(text + PATH.format(pitch=pitch, start=start))
    return path


# 6R: yaw, two pitches, a wrist of roll, pitch and roll whose axes meet 0.15 m behind the tip.
ARM = (("[0, 0, 1]", 0.0), ("[0, 1, 0]", 0.4), ("[0, 1, 0]", 0.35), ("[1, 0, 0]", 0.0), ("[0, 1, 0]", 0.0),
       ("[1, 0, 0]", 0.15))  # fmt: skip
LINK = """
[[body]]
name = "l{number}"
[body.rigid]
mass = 1.0
inertia = [0.002, 0.01, 0.01]
center = [{half}, 0.0, 0.0]
points = {{ in = [0.0, 0.0, 0.0], out = [{length}, 0.0, 0.0] }}

[[joint]]
name = "q{number}"
type = "revolute"
between = ["{inner}", "l{number}.in"]
axis = {axis}
"""
TOOL = """
[[trajectory]]
name = "tool"
point = "l6.out"
x = "{x!r} + 0.15*cos({pitch})"
y = "0"
z = "{z!r} - 0.15*sin({pitch})"
rpy = ["0", "{pitch}", "0"]

[initial]
joints = {{ q2 = {q2}, q3 = {q3}, q5 = {q5} }}

[[analysis]]
name = "inverse"
kind = "pcid"
end = 1.0
output_step = 0.01
tolerance = 1e-8
"""


def arm(folder, pitch, at_start):
    """The wrist stays where it is, the tool turns about y by `pitch`: q5 = pitch − 0.5."""
    q2, q3 = -0.9, 1.4
    text, inner = HEAD, "ground"
    for number, (axis, length) in enumerate(ARM, 1):
        text += LINK.format(number=number, axis=axis, length=length, half=length / 2, inner=inner)
        inner = f"l{number}.out"
    x, z = 0.4 * np.cos(q2) + 0.35 * np.cos(q2 + q3), -0.4 * np.sin(q2) - 0.35 * np.sin(q2 + q3)
    path = folder / "scene.toml"
    place = {"x": float(x), "z": float(z), "q2": q2, "q3": q3, "q5": at_start - q2 - q3}
    path.write_text(text + TOOL.format(pitch=pitch, **place))
    return path


def of_arm(path):
    with h5py.File(path.with_suffix(".results.h5")) as file:
        group = file["inverse"]
        return group.attrs["status"], list(group.attrs["warnings"]), group["joints/q5/coordinate"][()]


def test_an_arm_whose_wrist_comes_into_line_stops_there(tmp_path, ffrobot):
    """Axes 4 and 6 in line at t = 0.5; in the plane of the arm all of the equations would go on through it."""
    path = arm(tmp_path, "0.9-0.8*t", 0.9)
    done = ffrobot("solve", path)
    assert done.returncode == 1
    assert 'a singular posture: motions of "q4", "q6" against each other' in done.stderr
    status, warnings, angle = of_arm(path)
    assert status == "diverged"
    (found,) = filter(None, (re.match(r"at t = (\S+) s a singular posture", warning) for warning in warnings))
    assert abs(float(found[1]) - 0.5) < 0.1  # between two steps
    assert np.all(np.diff(angle) < 0)


def test_an_arm_that_comes_near_such_a_posture_is_told(tmp_path, ffrobot):
    path = arm(tmp_path, "0.5005+0.4*exp(-(4*t)**2)", 0.9005)
    ffrobot.ok("solve", path)
    status, warnings, angle = of_arm(path)
    assert status == "completed"
    (warning,) = warnings
    assert "nearly a singular posture (ratio" in warning
    assert 'motions of "q4", "q6" against each other' in warning
    assert abs(angle[-1] - 0.0005) < 1e-6
