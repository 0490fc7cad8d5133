"""Which trajectories jump: real jumps are refused, rounding of a path that stands still is none."""

import numpy as np
import pytest
from rods import arm_of_rods

import ffrobot


def arm(folder, **trajectory):
    """A rigid arm whose joint follows a trajectory for a tenth of a second."""
    return arm_of_rods(
        {"arm": (1.0, 0.2)}, ("shoulder",), folder=folder,
        trajectory=[{"name": "path", "joint": "shoulder", **trajectory}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01}],
    )  # fmt: skip


@pytest.mark.parametrize("value", [0.3, -0.7, 1e-6])
@pytest.mark.parametrize("rows", [3, 101, 1001])
def test_a_joint_held_by_waypoints_stands_still(tmp_path, value, rows):
    lines = [f"{t:.10g},{value}" for t in np.linspace(0.0, 0.1, rows)]
    (tmp_path / "held.csv").write_text("\n".join(["t,value", *lines]) + "\n", encoding="utf-8")
    moment = ffrobot.solve(arm(tmp_path, waypoints="held.csv"))["inverse/joints/shoulder/moment"]
    # The second derivative of a spline through equal numbers is their rounding over the square of the spacing.
    np.testing.assert_allclose(moment, 9.81 * 0.1 * np.cos(value), rtol=1e-6)
