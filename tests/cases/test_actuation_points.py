"""Forces at actuation points of links in 3D carry the motion by themselves; bad input."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle

import ffrobot

ARM_POINTS = """
[[actuation_points]]
body = "column"
[[actuation_points]]
body = "upper"
[[actuation_points]]
body = "fore"
x = ["tip"]
y = ["tip", 0.2]
z = [0.3, "tip"]
"""
AGAIN = """
[[analysis]]
name = "points"
kind = "forward"
actuation = "inverse"
apply = "points"
tolerance = 1e-6
"""


def arm(case_copy, points=ARM_POINTS, more=AGAIN):
    scene = case_copy("arm_3r")
    text = scene.read_text(encoding="utf-8").replace("end = 0.6", "end = 0.1")
    scene.write_text(text.replace("[[analysis]]", points + "\n[[analysis]]", 1) + more, encoding="utf-8")
    return scene


def test_forces_along_three_axes_carry_an_arm(case_copy):
    """The path's force acts on the forearm's tip: three components there are that force, whatever others there are."""
    with ffrobot.solve(arm(case_copy)) as results:
        group = "inverse/actuation_points/fore"
        assert list(results.attributes(group)["components"]) == ["x", "y", "y", "z", "z"]
        force, path = results[f"{group}/force"], results["inverse/trajectories/tool/force"]
        peak = np.abs(path).max()
        np.testing.assert_allclose(
            np.linalg.norm(force[:, [0, 1, 4]], axis=1), np.linalg.norm(path, axis=1), atol=1e-6 * peak
        )
        assert np.abs(force[:, [2, 3]]).max() < 1e-6 * peak
        assert results[f"{group}/residual"].max() < 1e-9 * peak
        for body in ("column", "upper"):  # not driven; chosen by the program, as many as can be told from each other
            assert np.abs(results[f"inverse/actuation_points/{body}/force"]).max() < 1e-12 * peak
        name = "points/fore.tip/position"
        np.testing.assert_allclose(results[f"points/{name}"], results[f"inverse/{name}"], rtol=0, atol=1e-6)


MISTAKES = {
    "axis of the plane": ('body = "fore"\naxial = ["tip"]', "axial: expected no such key .* along x, y and z"),
    "point that is none": ('body = "fore"\nx = ["top"]', r'expected a point of the body \(.*tip.*\), found "top"'),
    "body that is none": ('body = "hand"', 'expected one of the bodies "column", "upper", "fore", found "hand"'),
    "twice": ('body = "fore"\n[[actuation_points]]\nbody = "fore"', "expected one table for each body, found 2"),
    "on another body": ('body = "upper"', r"expected \[\[actuation_points\]\] on every body that trajectories drive"),
}


@pytest.mark.parametrize("what", MISTAKES)
def test_mistakes(case_copy, what):
    keys, message = MISTAKES[what]
    with pytest.raises(ffrobot.InputError, match=message):
        ffrobot.solve(arm(case_copy, f"[[actuation_points]]\n{keys}\n"))


def test_forces_that_turn_a_strip_and_hold_it_straight():
    """In closed form: sum, moment and work on the lowest mode of a cantilever, √m w = cosh − cos − σ (sinh − sin).

    Turned about its root a strip takes no force, the moment m L²/3 θ̈ and θ̈ ∫ρA x w dx = θ̈ √m L 2/λ² on the mode.
    """
    L, m, at = 1.0, 2700.0 * 0.004 * 0.02, (0.3, 0.6, 1.0)
    link = beam_link(
        L, rectangle(0.004, 0.02), 24, name="strip",
        modes={"family": "in-plane-bending", "count": 1, "attachment_modes": False}
    )  # fmt: skip
    scene = ffrobot.make_scene(
        name="strip", space="planar", gravity=[0.0, 0.0], body=[{"name": "arm", "link": link}],
        joint=[{"name": "hub", "type": "revolute", "between": ["ground", "arm.root"]}],
        trajectory=[{"name": "turn", "joint": "hub", "value": "0.5*t**2 + t**3"}],
        actuation_points=[{"body": "arm", "transverse": [*at[:2], "tip"]}],
        analysis=[{"name": "straight", "kind": "fcid", "shape": "zero", "end": 0.5, "output_step": 0.05}],
    )  # fmt: skip
    lam = 1.8751040687119612
    sigma, x = (np.sinh(lam) - np.sin(lam)) / (np.cosh(lam) + np.cos(lam)), lam * np.array(at) / L
    shape = (np.cosh(x) - np.cos(x) - sigma * (np.sinh(x) - np.sin(x))) / np.sqrt(m)
    per_acceleration = np.linalg.solve([np.ones(3), at, shape], [0.0, m * L**2 / 3, np.sqrt(m) * L * 2 / lam**2])
    with ffrobot.solve(scene) as results:
        force = results["straight/actuation_points/arm/force"]
        acceleration = 1.0 + 6.0 * results.time("straight/actuation_points/arm/force")
    np.testing.assert_allclose(force, acceleration[:, None] * per_acceleration, rtol=1e-4)
