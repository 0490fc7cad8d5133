"""Linear analyses through the command line: results, summary, export; and what is refused."""

import numpy as np
import pytest
from mistakes import edited

from ffrobot.results.file import Results

SCENE = """
name = "arm"
gravity = [0.0, -9.81]
joint = [{ name = "hub", type = "revolute", between = ["ground", "arm.root"] }]
load = [{ joint = "hub", moment = "3.0" }]
initial = { angles = { arm = 0.5 } }
analysis = [
    { name = "swing", kind = "forward", end = 0.2, output_step = 0.1 },
    { name = "held", kind = "linear" },
    { name = "along", kind = "linear", about = "swing", times = [0.1, 0.2] },
]
[[body]]
name = "arm"
rigid = { mass = 2.0, inertia = 0.3, center = [0.5, 0.0], points = { root = [0.0, 0.0], tip = [1.0, 0.0] } }
"""
INERTIA, WEIGHT = 0.3 + 2.0 * 0.5**2, 2.0 * 9.81 * 0.5


@pytest.fixture
def scene(tmp_path):
    """Write the scene, parts of its text exchanged."""

    def write(edits=None):
        (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
        edited(tmp_path, "scene.toml", edits or {})
        return tmp_path / "scene.toml"

    return write


def test_a_rigid_arm_held_by_its_motor_and_in_motion(ffrobot, scene):
    """δθ̈ = (δτ + m g l sin θ δθ)/J: gravity's stiffness at the angle at which the arm is."""
    path = scene()
    done = ffrobot.ok("solve", path, "--verbose")
    assert "held: joint/hub → joint/hub: minimum phase" in done.stdout
    with Results(path.with_suffix(".results.h5")) as results:
        (held,), moving = results.linear("held"), results.linear("along")
        angles = results["along/bodies/arm/angle"]
        assert results["along/linear/frequency"].shape == (2, 1)
    for model, angle in zip([held, *moving], [0.5, *angles], strict=True):
        np.testing.assert_allclose(model.A, [[0, 1], [WEIGHT * np.sin(angle) / INERTIA, 0]], rtol=1e-10)
        np.testing.assert_allclose(model.B[:, 0], [0, 1 / INERTIA], rtol=1e-12)
    assert [model.time for model in moving] == [0.1, 0.2]
    assert held.input_names == ("joint/hub", "force/arm.tip/x", "force/arm.tip/y")


def test_export(ffrobot, scene, tmp_path):
    path = scene()
    assert ffrobot("solve", path, "--verbose").returncode == 0
    results = path.with_suffix(".results.h5")
    assert ffrobot("linear", results, "-o", tmp_path / "held.npz").returncode == 0
    assert ffrobot("linear", results, "--analysis", "along", "-o", tmp_path / "along.mat").returncode == 0
    assert np.load(tmp_path / "held.npz")["A"].shape == (2, 2)
    assert (tmp_path / "along.mat").stat().st_size > 0
    missing = ffrobot("linear", results, "--analysis", "swing")
    assert missing.returncode == 2
    assert 'expected a linear analysis ("held", "along"), found "swing"' in missing.stderr


MISTAKES = {
    "unknown analysis": (
        {'about = "swing"': 'about = "swign"'},
        ["about: expected an earlier analysis", '"swign" (did you mean "swing"?)'],
    ),
    "linear about a linear one": ({'about = "swing"': 'about = "held"'}, ["about: expected", 'found "held"']),
    "time beyond the end": (
        {"[0.1, 0.2]": "[0.1, 0.3]"},
        ['times: expected at most 0.2, where "swing" ends, found 0.3'],
    ),
    "no output time": ({"[0.1, 0.2]": "[0.15]"}, ['expected output times of "swing", every 0.1 s', "found 0.15"]),
    "no times": ({", times = [0.1, 0.2]": ""}, ['times: expected the times of "swing"', "found none"]),
    "times at rest": ({', about = "swing"': ""}, ['times: expected none about "static"']),
    "times of a forward run": (
        {"end = 0.2": "end = 0.2, times = [0.1]"},
        ['expected the key "times" only in kind = "linear" or "placement", found kind = "forward"'],
    ),
    "unknown point": (
        {'about = "swing"': 'about = "swing", points = ["arm.tpi"]'},
        ['"arm.tpi"', 'did you mean "tip"'],
    ),
    "an end": (
        {'kind = "linear", about': 'kind = "linear", end = 1.0, about'},
        ['expected the key "end" only in kind = "pcid", "fcid", "forward", "motors-only", "tracking" or "closed-loop"'],
    ),
    "placement without patches": (
        {'kind = "linear", about': 'kind = "placement", placement = { body = "arm" }, about'},
        ["placement.body: expected a body with patches, none"],
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_bad_input(ffrobot, scene, mistake):
    edits, expected = MISTAKES[mistake]
    done = ffrobot("solve", scene(edits))
    assert done.returncode == 2
    for part in expected:
        assert part in done.stderr
    assert 'analysis "' in done.stderr


def test_what_no_motor_does_is_not_judged(ffrobot, scene):
    linear = SCENE[SCENE.index('    { name = "held"') : SCENE.index("]\n[[body]]")]
    path = scene({'"arm.root"]': '"arm.root"], motor = false', linear: ""})
    assert ffrobot("solve", path).returncode == 0
    done = ffrobot("feasibility", path.with_suffix(".results.h5"))
    assert done.returncode == 2
    assert "expected an analysis with motors or patches, found none" in done.stderr
