"""Open chains on paths: errors of small torques are judged by their own size, equations that hardly differ hold."""

import numpy as np
import pytest
from rods import arm_of_rods

import ffrobot as program
from ffrobot.mbs.model.system import motor_forces, path_forces
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher


def arm():
    """Two links, and a hand of a gram which keeps its angle."""
    path = {"name": "tip", "point": "lower.tip", "x": "0.6+0.1*sin(2*t)", "y": "0.2-0.1*t**2"}
    return arm_of_rods(
        {"upper": (2.0, 0.5), "lower": (1.0, 0.4), "hand": (1e-3, 0.02)}, ("j0", "j1", "j2"),
        trajectory=[path, {"name": "turn", "angle": "hand", "value": "0.3*t**2"}],
        initial={"angles": {"upper": 0.9, "lower": -0.6, "hand": 0.0}},
        analysis=[{"name": "follow", "kind": "pcid", "end": 1.0, "output_step": 0.001, "tolerance": 1e-6}],
    )  # fmt: skip


def test_peaks_of_small_motors_are_among_those_that_errors_are_compared_with():
    """The last ones, by motor: that of the hand is what its motor did, as far as steps show it."""
    run = solve_scene(arm(), Watcher()).outcomes["follow"]
    q = run.q
    torques = motor_forces(run.model, q, path_forces(run.model, run.time, q, run.multipliers)).moments
    peaks = run.continuation.checkpoint.force_peaks[-3:]
    largest = np.array([np.abs(torques[f"j{k}"]).max() for k in range(3)])
    assert largest[2] < 1e-3 * largest[0]
    assert peaks[2] == pytest.approx(largest[2], rel=0.02)


@pytest.mark.parametrize(("gear", "subject"), [({}, "joint"), ({"stiffness": 1e5, "damping": 50.0}, "motor")])
def test_inertia_that_a_motor_turns_with_the_other_joints_locked(gear, subject):
    """Steiner: the shoulder turns both links and the hand, the farthest when they are stretched most.

    To 0.1 % behind compliant gears, in front of which motors follow the path.
    """
    keys, accuracy = {"gear_ratio": 50.0, "rotor_inertia": 2e-5, **gear}, 1e-3 if gear else 1e-9
    scene = arm_of_rods(
        {"upper": (2.0, 0.5), "lower": (1.0, 0.4)}, "se", keys,
        trajectory=[{"name": "s", subject: "s", "value": "sin(t)"}, {"name": "e", subject: "e", "value": "1 - t"}],
        analysis=[{"name": "follow", "kind": "pcid", "end": 0.5, "output_step": 0.01}],
    )  # fmt: skip
    results = program.solve(scene)
    motors = results.verdict["follow"].motors
    lower = 1.0 * 0.4**2 / 3
    shoulder = 2.0 * 0.5**2 / 3 + lower + 1.0 * (0.5**2 + 2 * 0.5 * 0.2 * np.cos(0.5)) + 2e-5  # and the other rotor
    assert motors["e"].load_inertia == pytest.approx(lower, rel=accuracy)
    assert motors["s"].load_inertia == pytest.approx(shoulder, rel=accuracy)


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
