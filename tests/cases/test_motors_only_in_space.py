"""Motors alone in space: the planar numbers of a planar robot, and moments that carry an arm along its path."""

import tomllib
from pathlib import Path

import numpy as np
import planar_in_space
import pytest
import tomli_w
from checkpoints import CASES
from patched_arms import ARM, LINK

import ffrobot

KEPT = ("exact", "redefined")


@pytest.fixture(scope="module")
def two_link(tmp_path_factory):
    """The case of the plane with two modes a link, its inversions alone, in the plane and in space."""
    folder, found = tmp_path_factory.mktemp("two_link"), {}
    tables = planar_in_space.read(CASES / "two_link_motors_only" / "scene.toml")
    tables["analysis"] = [
        analysis | {"end": 0.5, "output_step": 0.005} for analysis in tables["analysis"] if analysis["name"] in KEPT
    ]
    for body in tables["body"]:
        link = tomllib.loads(Path(body["link"]).read_text(encoding="utf-8"))
        link["modes"]["count"] = 2
        body["link"] = str(folder / f"{body['name']}.toml")
        Path(body["link"]).write_text(tomli_w.dumps(link), encoding="utf-8")
    spatial = planar_in_space.in_space(tables) | {"analysis": tables["analysis"]}
    spatial["initial"] = {"state": "static", "joints": {"O": 0.0, "A": np.pi / 3}}
    for space, scene in (("planar", tables), ("spatial", spatial)):
        found[space] = ffrobot.solve(planar_in_space.write(scene, folder / f"{space}.toml"))
    yield found
    for results in found.values():
        results.close()


@pytest.mark.parametrize("name", KEPT)
def test_planar_robot_in_space_has_the_planar_moments(name, two_link):
    """Zeros on both sides: moments before the path and after it; or integrated forward."""
    plane, space = two_link["planar"], two_link["spatial"]
    np.testing.assert_allclose(space[f"{name}/time"], plane[f"{name}/time"], atol=1e-12)
    assert plane[f"{name}/time"][0] < -0.01 or name == "redefined"
    for joint in ("O", "A"):
        expected = plane[f"{name}/joints/{joint}/moment"]
        np.testing.assert_allclose(space[f"{name}/joints/{joint}/moment"], expected, atol=2e-6 * np.abs(expected).max())


PATH = """
[[trajectory]]
name = "tip"
point = "link.tip"
y = "0.1*({s})"
z = "0.25 - 0.15*({s})"
[[analysis]]
name = "exact"
kind = "motors-only"
end = 0.4
output_step = 0.01
tolerance = 1e-6
[[analysis]]
name = "again"
kind = "forward"
actuation = "exact"
apply = "joints"
tolerance = 1e-7
"""
S = "10*(t/0.4)**3 - 15*(t/0.4)**4 + 6*(t/0.4)**5"


@pytest.mark.parametrize("motors", ["section", "frame"])
def test_moments_carry_the_arm_along_its_path_and_to_rest(motors, tmp_path):
    """A link that bends in both planes, yaw and pitch: motors alone keep its tip on the path, and it rests after."""
    modes = 'count = 2\nfamily = ["in-plane-bending", "out-of-plane-bending"]'
    (tmp_path / "link.toml").write_text(LINK.format(name="link", length=0.4, modes=modes, height=0.006, width=0.012))
    (tmp_path / "scene.toml").write_text(ARM.format(motors=motors) + PATH.format(s=S))
    with ffrobot.solve(tmp_path / "scene.toml") as results:
        t, tip = results["again/time"], results["again/points/link.tip/position"]
        assert t[0] < -0.03
        assert t[-1] > 0.43
        u = np.clip(t / 0.4, 0.0, 1.0)
        s = 10 * u**3 - 15 * u**4 + 6 * u**5
        expected = np.column_stack([0.1 * s, 0.25 - 0.15 * s])
        np.testing.assert_allclose(tip[:, 1:], expected, atol=2e-6)
        assert np.abs(results["exact/points/link.tip/deflection"]).max(axis=0)[1:].min() > 1e-4
        swing = np.abs(results["again/bodies/link/modal_velocity"])
        assert swing[-1].max() < 1e-4 * swing.max()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('z = "0.25', '# z = "0.25', "trajectory components as the mechanism has degrees of freedom (2), found 1"),
        ('y = "0.1*', 'y = "0.1*t + 0*', "expected a path at rest at t = 0 s"),
    ],
)
def test_mistakes(old, new, message, tmp_path):
    modes = 'count = 2\nfamily = ["in-plane-bending", "out-of-plane-bending"]'
    (tmp_path / "link.toml").write_text(LINK.format(name="link", length=0.4, modes=modes, height=0.006, width=0.012))
    text = ARM.format(motors="section") + PATH.format(s=S)
    assert old in text
    (tmp_path / "scene.toml").write_text(text.replace(old, new))
    with pytest.raises(ffrobot.InputError) as error:
        ffrobot.solve(tmp_path / "scene.toml")
    assert message in " ".join(str(error.value).split())
