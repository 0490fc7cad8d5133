"""Damping ratios of an assembled robot: of its links' modes, and as `of = "robot"` wants them."""

import numpy as np
import pytest
from damped_arms import RATIO, planar_arm, vibrations_of

CHOICES = [("simply-supported", "simply-supported"), ("simply-supported", "cantilever"), ("cantilever", "cantilever")]


def linear(conditions, of):
    return vibrations_of(planar_arm(conditions, of))


@pytest.mark.parametrize(
    ("conditions", "expected"),
    list(zip(CHOICES, [(0.0105, 0.0115), (0.0115, 0.0164), (0.0159, 0.0175)], strict=True)),
    ids=["ss", "sc", "cc"],
)
def test_ratios_of_the_links_are_others_in_the_robot(conditions, expected):
    """The numbers of docs/theory.md; that they depend on the frame is the point."""
    _, ratio = linear(conditions, "link")
    np.testing.assert_allclose(ratio[:2], expected, rtol=0.01)
    assert np.all(ratio[:2] > 1.04 * RATIO)


def test_the_summary_lists_ratios(tmp_path, ffrobot):
    scene = tmp_path / "scene.toml"
    scene.write_text(
        """
name = "arm"
space = "planar"
gravity = [0.0, 0.0]
body = [{ name = "link", link = "link.toml" }]
joint = [{ name = "O", type = "revolute", between = ["ground", "link.root"] }]
analysis = [{ name = "at_rest", kind = "linear" }]
""",
        encoding="utf-8",
    )
    (tmp_path / "link.toml").write_text(
        """
name = "link"
material = { youngs_modulus = 70e9, density = 2700.0 }
geometry = { kind = "beam", length = 0.5, section = { shape = "rectangle", height = 0.01, width = 0.02 } }
mesh = { elements = 10 }
reference = { condition = "cantilever" }
modes = { count = 3, family = "in-plane-bending", attachment_modes = false }
damping = { ratio = 0.02, of = "robot" }
""",
        encoding="utf-8",
    )
    done = ffrobot.ok("solve", scene, "--verbose")
    assert "damping ratios" in done.stdout
    assert "0.02, 0.02, 0.02" in done.stdout
    link = tmp_path / "link.toml"
    link.write_text(link.read_text(encoding="utf-8").replace("ratio = 0.02", "ratio = [0.1, 0.1, 0.1]"))
    done = ffrobot("solve", scene, "--verbose")
    assert done.returncode == 2
    assert 'damping: expected one ratio, with of = "robot"' in done.stderr
