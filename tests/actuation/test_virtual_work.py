"""Motors and patches do the work of the force on the tip, in a run through `solve` with links from stage 1."""

import numpy as np
import pytest

from ffrobot.mbs.observation import trajectory_force
from ffrobot.solution import solve

SCENE = """
name = "two_link"
space = "planar"
gravity = [0.0, -9.81]
motors = "{motors}"

[[body]]
name = "link1"
link = "{link1}"

[[body]]
name = "link2"
link = "{link2}"

[[joint]]
name = "O"
type = "revolute"
between = ["ground", "link1.root"]

[[joint]]
name = "A"
type = "revolute"
between = ["link1.tip", "link2.root"]

[initial]
angles = {{ link1 = 0.0, link2 = 1.0471975511965976 }}

[[trajectory]]
name = "tip"
point = "link2.tip"
x = "1.5*cos(pi*t/4)"
y = "sqrt(3)/2*cos(pi*t/4)"
{patches}
[[analysis]]
name = "inverse"
kind = "pcid"
end = 0.1
output_step = 0.02
tolerance = 1e-6
"""
PATCHES = """
[[pzt]]
body = "{body}"
count = 10
length = 0.05
width = 0.025
thickness = 0.75e-3
modulus = 63e9
d31 = 110e-12
"""


@pytest.fixture(scope="module", params=["section", "frame"])
def solution(request, link_file, tmp_path_factory):
    links = {"link1": link_file("link1", "simply-supported"), "link2": link_file("link2", "cantilever")}
    patches = "".join(PATCHES.format(body=body) for body in links)
    scene = tmp_path_factory.mktemp("scene") / "scene.toml"
    scene.write_text(SCENE.format(motors=request.param, patches=patches, **links))
    return solve(scene)


def test_power_of_motors_and_patches_is_that_of_the_force_on_the_tip(solution):
    """Joint forces do none. To 1e-10 of the largest term, at every output after the start from rest."""
    outcome, section = solution.outcomes["inverse"], solution.scene.motors == "section"
    t = outcome.time
    rate = -np.pi / 4 * np.sin(np.pi * t / 4)
    tip_velocity = np.outer(rate, [1.5, np.sqrt(3) / 2])
    target = (trajectory_force(outcome, "tip") * tip_velocity).sum(axis=1)

    def turn(body, point):
        """Rate of the angle that the motors work on."""
        v = outcome.v[:, outcome.coordinates(body)]
        rotation = outcome.assembly.model.body(body).points[point].rotation
        return v[:, 2] + (v[:, 3:] @ rotation if section else 0.0)

    motors = [
        outcome.tau[:, 0] * turn("link1", "root"),
        outcome.tau[:, 1] * (turn("link2", "root") - turn("link1", "tip")),
    ]
    patches = [
        ((solution.voltages["inverse"][body].required @ solution.patches[body].Phi_V.T)
         * outcome.v[:, outcome.coordinates(body)][:, 3:]).sum(axis=1)
        for body in ("link1", "link2")
    ]  # fmt: skip
    terms = np.column_stack([*motors, *patches, -target])
    assert np.all(np.abs(terms[1:, :2]).max(axis=1) > 0.1)
    assert np.all(np.abs(terms.sum(axis=1))[1:] < 1e-10 * np.abs(terms).max(axis=1)[1:])


def test_checkpoint_of_voltages(solution):
    """formulation.md, section 9, at t = 0.1 s: kilovolts, of which link 1 needs none with motors at the frames."""
    voltages = solution.voltages["inverse"]
    expected = {"section": [91903.83, 76997.78, 22644.86], "frame": [0.0, 0.0, 0.0]}[solution.scene.motors]
    np.testing.assert_allclose(voltages["link1"].required[-1, [0, 3, 9]], expected, atol=1e-5 * 92000)
    np.testing.assert_allclose(
        voltages["link2"].required[-1, [0, 3, 9]], [20542.10, 11524.44, -3430.40], atol=1e-5 * 20542
    )
