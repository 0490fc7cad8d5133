"""Free joints at points of links that modes move: their coordinates are those of the section."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle

import ffrobot

LENGTH = 0.6
LINK = beam_link(LENGTH, rectangle(0.008, 0.02), 8, nu=0.3, modes={"count": 5, "family": "all"})  # fmt: skip
VELOCITY, SPIN = np.array([0.3, -0.2, 0.5]), np.array([4.0, 1.0, -2.0])
LOADS = [{"point": "link.tip", "z": "3*sin(40*t)", "mx": "0.1"}, {"point": "link.root", "y": "-0.5"}]


def thrown(point, arm, **more):
    """A link that bends and twists, thrown at t = 0, with a free joint at a point, `arm` (m) from the root along x."""
    place = [arm, 0.0, 0.0]
    rates = [*(VELOCITY + np.cross(SPIN, place)).tolist(), *SPIN.tolist()]
    return ffrobot.solve(
        ffrobot.make_scene(
            name="thrown", space="spatial", gravity=[0.0, 0.0, -9.81], body=[{"name": "link", "link": LINK}],
            joint=[{"name": "hand", "type": "free", "between": ["ground", f"link.{point}"]}], load=LOADS,
            initial={"state": "undeformed", "joints": {"hand": [*place, 0.0, 0.0, 0.0]},
                     "joint_rates": {"hand": rates}},
            analysis=[{"name": "flight", "kind": "forward", "end": 0.1, "output_step": 0.005, "tolerance": 1e-10}
                      | more],
        )
    )  # fmt: skip


@pytest.mark.parametrize("integrator", ["dop853", pytest.param("radau", marks=pytest.mark.nightly)])
def test_a_link_flies_the_same_whichever_section_has_the_joint(integrator):
    """Modes of the clamped link move the tip, not the root: one flight in two sets of coordinates."""
    of_root = thrown("root", 0.0)
    of_tip = thrown("tip", LENGTH, integrator=integrator)
    for point in ("root", "tip"):
        name = f"flight/points/link.{point}/position"
        np.testing.assert_allclose(of_tip[name], of_root[name], rtol=0, atol=1e-8)
    for name in ("flight/bodies/link/modal", "flight/points/link.tip/quaternion", "flight/energy/strain"):
        expected = of_root[name]
        np.testing.assert_allclose(of_tip[name], expected, rtol=0, atol=1e-8 * (1 + np.abs(expected).max()))
    assert np.abs(of_root["flight/points/link.tip/deflection"]).max() > 1e-3
