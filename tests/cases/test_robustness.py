"""What is left of computed motions where the robot is not its model: scaled links, lanes, bad input."""

import re
from pathlib import Path

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.body import from_modal_body, scaled

pytestmark = pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "tracking.md"


def test_scaled_bodies_are_those_of_other_materials():
    """Of 5 % less stiffness and 7 % more mass, with geometric stiffening; modes may have the other sign."""
    links = [
        beam_link(0.5, rectangle(0.008, 0.012), 8, E=E, rho=rho, modes={"count": 4}, damping={"ratio": 0.02})
        for E, rho in ((70e9, 2700.0), (0.95 * 70e9, 1.07 * 2700.0))
    ]
    bodies = [from_modal_body("link", modal_body(keys), stiffened=True) for keys in links]
    found, wanted = scaled(bodies[0], stiffness=0.95, mass=1.07), bodies[1]
    assert found.mass == pytest.approx(wanted.mass, rel=1e-12)
    moving = [np.vstack([of.points["tip"].translation, of.points["tip"].rotation]) for of in bodies]
    signs = np.sign((moving[0] * moving[1]).sum(axis=0))
    for key in ("stiffness", "first_moment", "second_moment", "J_spin"):
        np.testing.assert_allclose(getattr(found, key), getattr(wanted, key), rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(found.damping, wanted.damping, rtol=1e-8, atol=1e-9)
    for key in ("S_bar", "I_bar"):
        size = np.abs(getattr(wanted, key)).max()
        np.testing.assert_allclose(getattr(found, key) * signs, getattr(wanted, key), atol=1e-6 * size)
    for ours, theirs in (
        (found.stiffening.K_x, wanted.stiffening.K_x),
        (found.stiffening.at("tip"), wanted.stiffening.at("tip")),
    ):
        np.testing.assert_allclose(ours * signs * signs[:, None], theirs, atol=1e-6 * np.abs(theirs).max())


def scene(folder, robustness):
    blocks = dict(re.findall(r"`(\w+\.toml)`:\n\n```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL))
    for name, text in blocks.items():
        text = text.replace("tolerance = 1e-4\n", f"tolerance = 1e-4\nrobustness = {{ {robustness} }}\n")
        text = text.replace('kind = "forward"\nactuation = "carried"\napply = "joints"\n', HELD)
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "scene.toml"


HELD = """kind = "closed-loop"
actuation = "carried"
sample_time = 1e-3
feed_forward = "joints+pzt"
"""


def test_lanes_side_by_side(tmp_path):
    """The replay is exact, holding costs what a loop without controllers does, and small changes are linear."""
    with ffrobot.solve(scene(tmp_path, "parameters = [0.002, 0.01], force = 0.001")) as results:
        causes = [str(cause) for cause in results.attributes("carried/robustness")["causes"]]
        lanes = {
            name: dict(zip(causes, results[f"carried/robustness/{name}"], strict=True))
            for name in results.names("carried/robustness")
        }
        path = results["carried/points/arm.tip/position"]
        found = [
            np.linalg.norm(results[f"{name}/points/arm.tip/position"] - path, axis=1).max()
            for name in ("replay", "without_patches")
        ]
    open_loop, control = lanes["open_loop"], lanes["joint_control"]
    assert open_loop["as computed"] == pytest.approx(found[0], abs=1e-8)
    assert open_loop["zero-order hold of 1 ms"] == pytest.approx(found[1], rel=1e-3)
    for what in ("stiffness", "mass"):
        assert open_loop[f"{what} ± 1 %"] / open_loop[f"{what} ± 0.2 %"] == pytest.approx(5.0, rel=0.03)
        assert np.isfinite(control[f"{what} ± 1 %"])
    assert control["mass ± 1 %"] < open_loop["mass ± 1 %"]
    assert control["zero-order hold of 1 ms"] < 0.1 * lanes["joint_control_without_voltages"]["zero-order hold of 1 ms"]
    assert np.isnan(control["as computed"])
    # half of the acceleration F/m over the path's time, by a motor whose torque stays, is more than that of the tip
    assert 0.0 < control["0.001 N at the tip"] < open_loop["0.001 N at the tip"] < 0.5 * 0.001 / 0.05 * 0.6**2


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ("parameters = [1.5]", "robustness.parameters[0]: expected a number less than 1, found 1.5"),
        ("sample_time = 0.0", "robustness.sample_time: expected a number greater than 0"),
        ("sampletime = 1e-3", 'did you mean "sample_time"?'),
    ],
)
def test_deviations_that_are_none(tmp_path, keys, text):
    with pytest.raises(InputError, match=re.escape(text)):
        ffrobot.solve(scene(tmp_path, keys))
