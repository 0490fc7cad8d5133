"""Forces of an inverse analysis between its outputs, by its steps made again."""

import numpy as np
import pytest
from beam_links import beam_link, tube
from scipy.interpolate import CubicSpline

from ffrobot import make_scene
from ffrobot.mbs.quantities.supply import motor_moments
from ffrobot.mbs.run.replay import supplied
from ffrobot.run.solve import solve_scene

TUBES = {"upper": (0.5, 0.06, 0.052), "fore": (0.4, 0.05, 0.044), "hand": (0.2, 0.03, 0.026)}


def link(length, outer, inner):
    return beam_link(
        length, tube(outer, inner), 20, modes={"count": 4, "family": "in-plane-bending"}, damping={"ratio": 0.01}
    )


@pytest.fixture(scope="module")
def arm():
    """Three tubes with geared motors whose tip goes through four places by Radau, and a replay of its first 10 ms.

    Newton's method did not make one of the steps again, at 0.314 s, with the geometry of another: 33 880 N·m there.
    """
    gears = {"shoulder": (100.0, 3e-5), "elbow": (80.0, 1e-5), "wrist": (50.0, 3e-6)}
    between = [("ground", "upper.root"), ("upper.tip", "fore.root"), ("fore.tip", "hand.root")]
    scene = make_scene(
        name="three links",
        gravity=[0.0, -9.81],
        body=[{"name": name, "link": link(*sizes)} for name, sizes in TUBES.items()],
        joint=[
            {"name": name, "type": "revolute", "between": ends, "gear_ratio": ratio, "rotor_inertia": inertia}
            for (name, (ratio, inertia)), ends in zip(gears.items(), between, strict=True)
        ],
        payload=[{"point": "hand.tip", "mass": 2.0}],
        initial={"state": "static", "angles": {"upper": np.pi / 3, "fore": -np.pi / 6, "hand": -np.pi / 3}},
        trajectory=[
            {"name": "tip", "point": "hand.tip", "via": [[0.8, 0.0], [0.7, 0.4], [0.4, 0.5], [0.6, -0.2]],
             "duration": 0.8, "hold": 0.1},
            {"name": "tool", "angle": "hand", "value": "-45*deg"},
        ],
        analysis=[
            {"name": "inverse", "kind": "pcid", "integrator": "radau", "end": 0.4, "output_step": 0.002},
            {"name": "replay", "kind": "forward", "actuation": "inverse", "apply": "joints", "end": 0.01,
             "output_step": 0.002},
        ],
    )  # fmt: skip
    return solve_scene(scene)


def test_moments_between_outputs_are_those_of_a_spline_through_them(arm):
    """The path is smooth and the links do not ring, so that 1e-6 of the peak is what both leave."""
    source, motion = arm.outcomes["inverse"], arm.analyses["inverse"].run
    moments = np.hstack([motor_moments(motion)[joint] for joint in ("shoulder", "elbow", "wrist")])
    times = np.arange(0.0, 0.4, 0.00025)
    tau = supplied(source, np.full(3, np.inf), {}, limited=False).sample(times.tolist())
    off = np.abs(tau - CubicSpline(source.time, moments)(times)).max(axis=0)
    assert source.statistics.integrator.name == "radau"
    assert np.all(off < 2e-6 * np.abs(moments).max(axis=0))
