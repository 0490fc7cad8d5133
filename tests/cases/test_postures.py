"""Singular postures along a path in 3D, of an arm whose wrist turns its tool about y."""

import re

import h5py
import numpy as np
import pytest
import scenes_in_3d
from tables_3d import X, Y, Z, revolute, rigid, scene

# 6R: yaw, two pitches, a wrist of roll, pitch and roll whose axes meet 0.15 m behind the tip.
ARM = ((Z, 0.0), (Y, 0.4), (Y, 0.35), (X, 0.0), (Y, 0.0), (X, 0.15))


@pytest.fixture
def solved(ffrobot, tmp_path):
    """Run the arm: the wrist stays where it is, the tool turns about y by `pitch`: q5 = pitch − 0.5.

    Returns the command, attributes of the analysis, and q5.
    """

    def run(pitch, at_start):
        q2, q3 = -0.9, 1.4
        bodies, joints, inner = [], [], "ground"
        for k, (axis, length) in enumerate(ARM, 1):
            bodies.append(rigid(f"l{k}", 1.0, [0.002, 0.01, 0.01], [length / 2, 0.0, 0.0], out=[length, 0.0, 0.0]))
            joints.append(revolute(f"q{k}", inner, f"l{k}.root", axis))
            inner = f"l{k}.out"
        x, z = 0.4 * np.cos(q2) + 0.35 * np.cos(q2 + q3), -0.4 * np.sin(q2) - 0.35 * np.sin(q2 + q3)
        place = {"x": f"{float(x)!r} + 0.15*cos({pitch})", "y": "0", "z": f"{float(z)!r} - 0.15*sin({pitch})"}
        path = {"name": "tool", "point": "l6.out", "rpy": ["0", pitch, "0"]} | place
        start = {"joints": {"q2": q2, "q3": q3, "q5": at_start - q2 - q3}}
        inverse = {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.01, "tolerance": 1e-8}
        tables = scene(bodies, joints, inverse, trajectory=[path], initial=start)
        done = ffrobot("solve", scenes_in_3d.write(tables, tmp_path / "scene.toml"))
        with h5py.File(tmp_path / "scene.results.h5") as file:
            return done, dict(file["inverse"].attrs), file["inverse/joints/q5/coordinate"][()]

    return run


def test_an_arm_whose_wrist_comes_into_line_stops_there(solved):
    """Axes 4 and 6 in line at t = 0.5; in the plane of the arm all of the equations would go on through it."""
    done, about, angle = solved("0.9-0.8*t", 0.9)
    assert done.returncode == 1
    assert 'a singular posture: motions of "q4", "q6" against each other' in done.stderr
    assert about["status"] == "diverged"
    (found,) = filter(None, (re.match(r"at t = (\S+) s a singular posture", text) for text in about["warnings"]))
    assert abs(float(found[1]) - 0.5) < 0.1  # between two steps
    assert np.all(np.diff(angle) < 0)


def test_an_arm_that_comes_near_such_a_posture_is_told(solved):
    done, about, angle = solved("0.5005+0.4*exp(-(4*t)**2)", 0.9005)
    assert (done.returncode, about["status"]) == (0, "completed")
    posture, round_off = about["warnings"]
    assert "nearly a singular posture (ratio" in posture
    assert 'motions of "q4", "q6" against each other' in posture
    assert "a tolerance of 1e-08 is below round-off here" in round_off
    assert "nearly singular postures" in round_off
    assert abs(angle[-1] - 0.0005) < 1e-6
