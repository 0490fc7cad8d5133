"""Paths of open chains whose equations hardly differ at the start."""

import numpy as np
import pytest
from rods import arm_of_rods

from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher


@pytest.mark.parametrize("off", [*np.geomspace(3e-6, 1e-3, 12), 0.3])
def test_all_equations_of_a_path_are_followed(off):
    """A kept joint angle and the tip's way along x, which turns by `off` + t² about the ground: x = 2 cos ½ cos(…).

    Both rows hardly differ where `off` is small; round-off leaves 1e-16/off² of their multipliers.
    """
    scene = arm_of_rods(
        {"link1": (1.0, 1.0), "link2": (1.0, 1.0)},
        trajectory=[
            {"name": "tip", "point": "link2.tip", "x": f"2*cos(0.5)*cos({off}+t**2)"},
            {"name": "bend", "joint": "A", "value": "1"},
        ],
        initial={"angles": {"link1": off - 0.5, "link2": off + 0.5}},
        analysis=[{"name": "follow", "kind": "pcid", "end": 0.05, "output_step": 0.005, "tolerance": 1e-6}],
    )
    run = solve_scene(scene, Watcher()).outcomes["follow"]
    assert run.status == "completed"
    assert run.statistics.steps < 1000
    assert off > 8e-6 or any("nearly singular postures amplify" in text for text in run.statistics.warnings)
    np.testing.assert_allclose(run.q[:, 0], off + run.time**2 - 0.5, rtol=0, atol=1e-13 / off)
