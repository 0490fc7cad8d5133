"""Motors and patches of scenes in 3D, acting again or with given voltages."""

import h5py
import numpy as np
import pytest
from checkpoint_scene_files import close
from patched_arms import ARM, LINK, PZT, SEVEN

PATH = """
[[trajectory]]
name = "tip"
point = "link.tip"
y = "0.08*sin(6*t)**3"
z = "0.2 + 0.07*sin(5*t)**3"
[[analysis]]
name = "inverse"
kind = "pcid"
end = 0.2
output_step = 0.02
tolerance = 1e-8
"""
AGAIN = """
[[analysis]]
name = "again"
kind = "forward"
actuation = "inverse"
apply = "{apply}"
tolerance = 1e-8
"""


def layout(name, bends, limit=2000.0, count=2):
    keys = f'name = "{name}"\nbends = "{bends}"\nallocation = "exact"'
    return PZT.format(body="link", keys=keys, limit=limit).replace("count = 4", f"count = {count}")


def solved(folder, ffrobot, parts, *, motors="section", limits=False):
    """The arm whose link bends in both planes by two modes each, with two patches for each plane."""
    modes = 'count = 2\nfamily = ["in-plane-bending", "out-of-plane-bending"]'
    (folder / "link.toml").write_text(LINK.format(name="link", length=0.4, modes=modes, height=0.006, width=0.012))
    (folder / "scene.toml").write_text(ARM.format(motors=motors) + "".join(parts))
    ffrobot.ok("solve", folder / "scene.toml")
    return h5py.File(folder / "scene.results.h5")


@pytest.mark.parametrize("motors", ["section", "frame"])
def test_motors_and_patches_carry_the_robot_along_its_path(motors, tmp_path, ffrobot):
    """Whatever motors turn, motors and patches together do what the forces on the path did."""
    parts = [layout("one", "in-plane"), layout("other", "out-of-plane"), PATH, AGAIN.format(apply="joints+pzt")]
    with solved(tmp_path, ffrobot, parts, motors=motors) as file:
        assert np.abs(file["inverse/pzt/one/required_voltage"]).max() > 10.0
        close(file["again/points/link.tip/position"], file["inverse/points/link.tip/position"][()])
        for key in ("modal", "position"):
            close(file[f"again/bodies/link/{key}"], file[f"inverse/bodies/link/{key}"][()])
        for joint in ("waist", "shoulder"):
            close(file[f"again/joints/{joint}/rate"], file[f"inverse/joints/{joint}/rate"][()])


GIVEN = """
[[load]]
pzt = "other"
voltage = ["30", "30"]
[[trajectory]]
name = "turn"
joint = "waist"
value = "0"
[[trajectory]]
name = "pitch"
joint = "shoulder"
value = "0"
[[analysis]]
name = "rest"
kind = "static"
[[analysis]]
name = "swing"
kind = "pcid"
end = 0.02
output_step = 0.01
"""


def test_given_voltages_bend_the_link_as_they_do_without_gravity(tmp_path, ffrobot):
    """At rest K p = Φ_V V beside gravity: the difference of two equilibria is that of the voltages, to its sign."""
    bent = {}
    for volts in (0, 30, -30):
        folder = tmp_path / f"{volts}"
        folder.mkdir()
        parts = [layout("one", "in-plane"), layout("other", "out-of-plane"), GIVEN.replace('"30"', f'"{volts}"')]
        with solved(folder, ffrobot, parts) as file:
            bent[volts] = file["rest/points/link.tip/deflection"][0]
            np.testing.assert_allclose(file["rest/bodies/link/modal_force"], 0, atol=1e-9)
    up, down = bent[30] - bent[0], bent[-30] - bent[0]
    np.testing.assert_allclose(up, -down, atol=1e-9 * np.abs(up).max())
    assert up[2] > 1e-6  # a positive voltage bends towards +z


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('pzt = "other"', 'pzt = "othr"', 'load no. 1: pzt: expected one of the layouts "one", "other", found "othr"'),
        (
            '["30", "30"]',
            '["30"]',
            'voltage: expected 2 expressions, one for each patch of "other", found 1',
        ),
        ('voltage = ["30", "30"]', 'moment = "1"', 'expected the keys "voltage" with "pzt", found "moment"'),
    ],
)
def test_mistakes_in_given_voltages(old, new, message, tmp_path, ffrobot):
    (tmp_path / "link.toml").write_text(LINK.format(name="link", length=0.4, modes=SEVEN, height=0.006, width=0.012))
    text = ARM.format(motors="section") + layout("one", "in-plane") + layout("other", "out-of-plane") + GIVEN
    assert old in text
    (tmp_path / "scene.toml").write_text(text.replace(old, new))
    done = ffrobot("solve", tmp_path / "scene.toml")
    assert done.returncode == 2
    assert message in " ".join(done.stderr.split())
