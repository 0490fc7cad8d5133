"""Patches placed on links in 3D: out of plane, bad input."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from tables_3d import ORIGIN, Y, revolute, scene

import ffrobot
from ffrobot.common.errors import InputError

STRIP = beam_link(
    0.6, rectangle(0.02, 0.004), 20, nu=None, name="strip",
    modes={"count": 4, "family": ["in-plane-bending", "out-of-plane-bending"]}
)  # fmt: skip
LAYOUT = {
    "body": "arm", "count": 1, "length": 0.06, "width": 0.02, "thickness": 0.5e-3, "modulus": 63e9, "d31": 110e-12,
    "structural": False, "bends": "out-of-plane", "limit": 200.0, "allocation": "least-squares",
}  # fmt: skip
BESIDE = {"name": "b", "bends": "in-plane", "width": 0.004}


def placed(layouts, placement):
    where = {"name": "where", "kind": "placement", "placement": placement}
    tables = scene([{"name": "arm", "link": STRIP}], [revolute("hub", "ground", "arm.root", Y)], where, gravity=ORIGIN)
    return ffrobot.solve(ffrobot.make_scene(**tables, pzt=layouts))


@pytest.mark.parametrize(
    ("layouts", "placement"),
    [([LAYOUT], {"body": "arm"}), ([LAYOUT | {"name": "up"}, LAYOUT | BESIDE], {"body": "arm", "pzt": "up"})],
)
def test_patches_out_of_plane_reach_modes_out_of_plane_alone(layouts, placement):
    """A cantilever that its motor holds: one patch for its first mode sits at the root, where the curvature is most.

    Whatever other layouts the link has.
    """
    with placed(layouts, placement) as found:
        assert found["where/placement/best/centers"] == pytest.approx([0.03])
        reach = found["where/placement/candidate_reach"][0]
        assert (np.diff(reach) < 0).all()
        x, beta = found["where/placement/candidates"], 1.8751040687 / 0.6
        edges = np.stack([x - 0.03, x + 0.03])
        s = (np.cosh(1.8751040687) + np.cos(1.8751040687)) / (np.sinh(1.8751040687) + np.sin(1.8751040687))
        slope = np.sinh(beta * edges) + np.sin(beta * edges) - s * (np.cosh(beta * edges) - np.cos(beta * edges))
        turn = np.diff(slope, axis=0)[0] ** 2
        np.testing.assert_allclose(reach, turn / turn.max(), rtol=1e-3)


@pytest.mark.parametrize(
    ("layouts", "placement", "expected"),
    [
        ([LAYOUT], {"body": "hub"}, 'found "hub"'),
        ([LAYOUT], {"body": "arm", "count": 20}, "expected patches that fit side by side"),
        ([LAYOUT], {"body": "arm", "modes": 9}, "placement.modes: expected at most"),
        ([LAYOUT, LAYOUT | BESIDE], {"body": "arm"}, 'pzt: expected one of the layouts "arm", "b" of "arm"'),
        ([LAYOUT, LAYOUT | BESIDE], {"body": "arm", "pzt": "c"}, "placement.pzt: expected one of the layouts"),
        ([LAYOUT], {"body": "arm", "criterion": "voltage"}, "about: expected an earlier analysis"),
    ],
)  # fmt: skip
def test_bad_input(layouts, placement, expected):
    with pytest.raises(InputError, match=expected):
        placed(layouts, placement)
