"""Patches of scenes in 3D through `ffrobot solve`: turned links, and what no patch reaches."""

import h5py
import numpy as np
import pytest
from patched_arms import LINK, PZT, SEVEN

from ffrobot import Results

ONE_LINK = """
name = "turned"
space = "spatial"
gravity = [0.3, 0.5, -9.81]
[[body]]
name = "link"
link = "link.toml"
[[joint]]
name = "yaw"
type = "universal"
between = ["ground", "link.root"]
axis = [0.0, 0.0, 1.0]
second_axis = {second_axis}
rpy = {rpy}
[[payload]]
point = "link.tip"
mass = 0.1
[[trajectory]]
name = "tip"
point = "link.tip"
y = "0.02*sin(6*t)**3"
z = "0.03*sin(5*t)**3"
{layouts}
[[analysis]]
name = "inverse"
kind = "pcid"
end = 0.2
output_step = 0.02
tolerance = 1e-8
"""


def layouts(first, second):
    text = "".join(PZT.format(body="link", keys=f'name = "{name}"\nbends = "{bends}"', limit=200.0)
                   for name, bends in (("one", first), ("other", second)))  # fmt: skip
    return text


@pytest.fixture(scope="module")
def straight(tmp_path_factory, ffrobot):
    return solve_turned(tmp_path_factory.mktemp("straight"), ffrobot, turned=False)


def solve_turned(folder, ffrobot, *, turned):
    """A link, or the same turned by 90° about its axis, height and width exchanged: y becomes z and z becomes −y."""
    size = {"height": 0.012, "width": 0.006} if turned else {"height": 0.006, "width": 0.012}
    (folder / "link.toml").write_text(LINK.format(name="link", length=0.4, modes=SEVEN, **size))
    names = ("out-of-plane", "in-plane") if turned else ("in-plane", "out-of-plane")
    keys = {
        "second_axis": [0.0, 0.0, 1.0] if turned else [0.0, 1.0, 0.0],
        "rpy": [-np.pi / 2, 0.0, 0.0] if turned else [0.0, 0.0, 0.0],
    }
    (folder / "scene.toml").write_text(ONE_LINK.format(layouts=layouts(*names), **keys))
    done = ffrobot.ok("solve", folder / "scene.toml", "--verbose")
    assert "voltages of" in done.stdout
    return folder / "scene.results.h5"


def test_turning_a_link_about_its_axis_exchanges_its_planes(straight, tmp_path, ffrobot):
    """Patches towards the old y, now z, have the same voltages; those towards the old z, now −y, the opposite ones."""
    with h5py.File(straight) as one, h5py.File(solve_turned(tmp_path, ffrobot, turned=True)) as other:
        for name, sign in (("one", 1.0), ("other", -1.0)):
            for key in ("required_voltage", "voltage"):
                expected = one[f"inverse/pzt/{name}/{key}"][()]
                assert np.abs(expected).max() > 1.0
                found = sign * other[f"inverse/pzt/{name}/{key}"][()]
                np.testing.assert_allclose(found, expected, atol=2e-6 * np.abs(expected).max())
        moments = [file["inverse/joints/yaw/moment"][()] for file in (one, other)]
        np.testing.assert_allclose(moments[1], moments[0], atol=2e-6 * np.abs(moments[0]).max())


def test_feasibility_of_a_scene_in_3d(straight, ffrobot):
    done = ffrobot.ok("feasibility", straight)
    assert "yaw 1" in done.stdout  # motors of a universal joint, one for each axis
    for name in ("one", "other"):
        assert f"\n{name} " in done.stdout
    with Results(straight) as results:
        verdict = results.verdict["inverse"]
        assert set(verdict.patches) == {"one", "other"}
        assert verdict.feasible == all(need.factor <= 1.0 for need in verdict.patches.values())


WRIST = """
name = "wrist"
space = "spatial"
gravity = [0.0, 0.0, 0.0]
[[body]]
name = "link"
link = "link.toml"
[[body]]
name = "hand"
[body.rigid]
mass = 0.2
center = [0.0, 0.05, 0.0]
inertia = [1e-4, 1e-4, 1e-4]
points = {{ root = [0.0, 0.0, 0.0], tool = [0.0, 0.1, 0.0] }}
[[joint]]
name = "yaw"
type = "revolute"
between = ["ground", "link.root"]
axis = [0.0, 0.0, 1.0]
[[joint]]
name = "roll"
type = "revolute"
between = ["link.tip", "hand.root"]
axis = [1.0, 0.0, 0.0]
[[trajectory]]
name = "tool"
point = "hand.tool"
y = "0.1 - 0.02*sin(8*t)**3"
z = "0.05*sin(10*t)**3"
{layouts}
[[analysis]]
name = "inverse"
kind = "pcid"
end = 0.2
output_step = 0.02
tolerance = 1e-6
"""


def test_what_no_patch_reaches_is_told_mode_by_mode(tmp_path, ffrobot):
    """The moment of a wrist about the link's axis twists it: the modal force τ φ_x of torsion is left, whole."""
    link = LINK.format(name="link", length=0.4, modes=SEVEN.replace("7]", "7, 8]"), height=0.006, width=0.012)
    (tmp_path / "link.toml").write_text(link)
    (tmp_path / "scene.toml").write_text(WRIST.format(layouts=layouts("in-plane", "out-of-plane")))
    done = ffrobot.ok("solve", tmp_path / "scene.toml")
    with Results(tmp_path / "scene.results.h5") as results, h5py.File(results.path) as file:
        force, left = results["inverse/bodies/link/modal_force"], results["inverse/pzt/one/residual_force"]
        torsion = list(file["inverse/pzt/one/residual_force"].attrs["columns"]).index("torsion")
        moment = results["inverse/joints/roll/moment"]
        expected = moment * results.modal_body("link").interfaces["tip"].rotation[0, torsion]
        np.testing.assert_allclose(force[:, torsion], expected, atol=1e-2 * np.abs(expected).max())  # small rotations
        np.testing.assert_allclose(left[:, torsion], force[:, torsion], rtol=1e-9)
        np.testing.assert_array_equal(left, results["inverse/pzt/other/residual_force"])
        assert results.verdict["inverse"].feasible is False
        (told,) = (text for text in results.warnings["inverse"] if "no actuator provides" in text)
        assert "modal forces required on link (torsion), off by" in told
    assert "no actuator provides all modal forces" in " ".join(done.stdout.split())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "other"', 'name = "one"', 'pzt "one": name: expected a separate name for each layout on a body'),
        ('body = "link"', 'body = "lnk"', 'expected one of the bodies "link", found "lnk"'),
        ('bends = "out-of-plane"', 'bends = "twist"', "plain piezoceramic strains alike in all directions"),
        ("count = 4", "count = 1", "expected as many patches as modes"),
        (
            "limit = 200.0",
            'coupling = "surface"',
            'expected bends = "in-plane" and no fibers with coupling = "surface"',
        ),
    ],
)
def test_mistakes(old, new, message, tmp_path, ffrobot):
    modes = 'count = 6\nfamily = "all"'
    link = LINK.format(name="link", length=0.4, modes=modes, height=0.006, width=0.012)
    (tmp_path / "link.toml").write_text(link)
    keys = {"second_axis": [0.0, 1.0, 0.0], "rpy": [0.0] * 3}
    text = ONE_LINK.format(layouts=layouts("in-plane", "out-of-plane"), **keys)
    assert old in text
    (tmp_path / "scene.toml").write_text(text.replace(old, new))
    done = ffrobot("solve", tmp_path / "scene.toml")
    assert done.returncode == 2
    assert message in " ".join(done.stderr.split())
    assert not (tmp_path / "scene.results.h5").exists()
