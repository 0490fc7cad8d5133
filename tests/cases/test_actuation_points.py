"""Forces at actuation points of links in 3D: they carry the motion by themselves, and are those of the plane."""

import numpy as np
import pytest
import scenes_in_3d
from checkpoints import CASES

import ffrobot

GUESS = {"O": 0.0, "A": 1.0471975511965976}
SHORT = {"end": 0.05, "output_step": 0.005}
INVERSE = {"name": "inverse", "kind": "pcid", "tolerance": 1e-9, **SHORT}
STRAIGHT = {"name": "straight", "kind": "fcid", "shape": "static", **SHORT}


def forward(name, source):
    return {"name": name, "kind": "forward", "actuation": source, "apply": "points", "tolerance": 1e-6}


ANALYSES = [INVERSE, forward("points", "inverse"), STRAIGHT, forward("straight_points", "straight")]
ACROSS = [0.05, 0.10, 0.18, 0.27, 0.36, 0.45, 0.54, 0.63, 0.72, 0.81, 0.91, "tip"]


def test_planar_points_put_into_space(tmp_path):
    """Components along and across the links chosen by hand: the forces of the plane, which return the motion."""
    planar = scenes_in_3d.read(CASES / "two_link_points" / "scene.toml") | {"analysis": ANALYSES}
    spatial = scenes_in_3d.in_3d(planar) | {"initial": {"joints": GUESS}, "analysis": ANALYSES}
    spatial["actuation_points"] = [{"body": "link1"}, {"body": "link2", "x": ["tip"], "y": ACROSS}]
    results = [
        ffrobot.solve(scenes_in_3d.write(tables, tmp_path / f"{name}.toml"))
        for name, tables in (("planar", planar), ("spatial", spatial))
    ]
    with results[0] as plane, results[1] as space:
        for analysis in ("inverse", "straight"):
            name = f"{analysis}/actuation_points/link2"
            found, expected = space[f"{name}/force"], plane[f"{name}/force"]
            largest = np.abs(expected).max()
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * largest)
            np.testing.assert_allclose(space[f"{name}/position"][:, 0], plane[f"{name}/position"][:, 0], atol=1e-12)
            for body in ("link1", "link2"):
                assert space[f"{analysis}/actuation_points/{body}/residual"].max() < 1e-9 * largest
        for source, again in (("inverse", "points"), ("straight", "straight_points")):
            place = "points/link2.tip/position"
            np.testing.assert_allclose(space[f"{again}/{place}"], space[f"{source}/{place}"], rtol=0, atol=1e-7)
            for body in ("link1", "link2"):
                of_both = [space[f"{one}/bodies/{body}/modal"] for one in (source, again)]
                np.testing.assert_allclose(*of_both, rtol=0, atol=1e-6 * max(np.abs(of_both[0]).max(), 1e-3))


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


def test_forces_along_three_axes_carry_an_arm(case_copy, ffrobot, monkeypatch):
    """The path's force acts on the forearm's tip: three components there are that force, whatever others there are."""
    import ffrobot as library

    monkeypatch.setenv("XDG_CACHE_HOME", str(ffrobot.cache))
    scene = arm(case_copy)
    with library.solve(scene) as results:
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
    "beyond the link": ('body = "fore"\ny = [3.0]', "expected places within the link, 0 … "),
    "two alike": (
        'body = "fore"\ny = ["tip", "tip"]',
        "y: expected points apart from each other, found two at tip and tip",
    ),
    "places on a rigid body": ('body = "column"\nx = [0.1]', "expected points of the rigid body by name"),
    "body that is none": ('body = "hand"', 'expected one of the bodies "column", "upper", "fore", found "hand"'),
    "twice": ('body = "fore"\n[[actuation_points]]\nbody = "fore"', "expected one table for each body, found 2"),
    "on another body": ('body = "upper"', r"expected \[\[actuation_points\]\] on every body that trajectories drive"),
}


@pytest.mark.parametrize("what", MISTAKES)
def test_mistakes(case_copy, ffrobot, monkeypatch, what):
    import ffrobot as library

    monkeypatch.setenv("XDG_CACHE_HOME", str(ffrobot.cache))
    keys, message = MISTAKES[what]
    with pytest.raises(library.InputError, match=message):
        library.solve(arm(case_copy, f"[[actuation_points]]\n{keys}\n"))


def test_forces_at_points_need_points(case_copy):
    import ffrobot as library

    with pytest.raises(library.InputError, match=r'apply: expected at least one \[\[actuation_points\]\] for "points"'):
        library.load_scene(arm(case_copy, ""))
