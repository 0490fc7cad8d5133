"""Loops whose equations turn dependent on the way, in a plane, declared or found, and in space: runs end there."""

import numpy as np
import pytest
from four_bar import bauchau
from tables_3d import pin, planar

from ffrobot.common.errors import InputError
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher
from ffrobot.scene.load import make_scene

CRANK, FOOT = 0.3, 1.0  # m
SPIN = 6.0  # rad/s, of a base that turns on


def rod(space, mass, length):
    number = mass * length**2 / 12
    inertia = number if space == "planar" else [number / 10, number, number]
    points = {"root": point(space, 0.0), "tip": point(space, length)}
    return {"mass": mass, "inertia": inertia, "center": point(space, length / 2), "points": points}


def point(space, x):
    return [x, 0.0] if space == "planar" else [x, 0.0, 0.0]


def parallelogram(space, tolerance):
    """Cranks under a coupler that fall from 1 rad above the flat posture; "turning": on a heavy base that spins."""
    cranks, ends, joints = ("crank0", "crank1"), ("root", "tip"), []
    is_turning, space = space == "turning", "planar" if space == "planar" else "spatial"
    for k, (name, end) in enumerate(zip(cranks, ends, strict=True)):
        joints.append(pin(f"foot{k}", "ground", f"{name}.root", at=point(space, k * FOOT)))
        joints.append(pin(f"head{k}", f"{name}.tip", f"coupler.{end}"))
    bodies = [{"name": name, "rigid": rod(space, 0.5, CRANK)} for name in cranks]
    bodies.append({"name": "coupler", "rigid": rod(space, 0.8, FOOT)})
    axis, gravity = ({}, [0.0, -9.81]) if space == "planar" else ({"axis": [0.0, 0.0, 1.0]}, [0.0, -9.81, 0.05])
    fall = {"name": "fall", "kind": "forward", "end": 1.0, "output_step": 0.01, "tolerance": tolerance}
    initial = {"joints": {"foot0": 1.0, "foot1": 1.0, "head0": -1.0}}
    joints = [joint | axis for joint in sorted(joints, key=lambda joint: joint["name"])]  # feet first
    if is_turning:
        feet = {f"foot{k}": point(space, k * FOOT) for k in range(2)}
        bodies.append({"name": "base", "rigid": rod(space, 1e9, 1.0) | {"inertia": [1e9] * 3, "points": feet}})
        for k in range(2):
            joints[k] = pin(f"foot{k}", f"base.foot{k}", f"{cranks[k]}.root") | axis
        joints.append(pin("waist", "ground", "base.foot0") | {"axis": [0.0, 1.0, 0.0]})
        initial["joint_rates"] = {"waist": SPIN}
        initial["joints"]["waist"] = 0.75  # a quarter turn from the ground's z before the fall ends
    return make_scene(**planar(bodies, joints, fall, gravity=gravity, space=space, initial=initial))


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
@pytest.mark.parametrize("space", ["planar", "spatial", "turning"])
def test_a_parallelogram_that_falls_flat_stops_and_says_why(space, tolerance):
    """Branches meet there; steps that would jump over the posture do not.

    Axes of joints on the base that spins turn from beside the ground's z to its x, where its other axes close the loop.
    """
    run = solve_scene(parallelogram(space, tolerance), Watcher()).outcomes["fall"]
    assert run.status == "step underflow"
    assert run.statistics.cause.startswith("the configuration is singular or nearly so (ratio of singular values")
    assert 'loops that "head1" close' in run.statistics.cause
    angle = run.q[-1, run.model.columns("foot0")[0]]
    assert 0.0 < angle < 0.3
    # of a pendulum: (J_cranks + m l²) ω²/2 = (m_cranks/2 + m) g l (sin 1 − sin θ), and what spinning adds
    inertia, weight = 2 * 0.5 * CRANK**2 / 3 + 0.8 * CRANK**2, (0.5 + 0.8) * 9.81 * CRANK
    theta = np.linspace(0.0, 1.0, 200_001)[:-1]  # ∫dθ/ω, the end of which is integrable
    out, still = np.cos(theta), np.cos(1.0)
    centrifugal = 1.3 * FOOT * CRANK * (out - still) + (inertia - CRANK**2 / 120) * (out**2 - still**2)
    fallen = weight * (np.sin(1.0) - np.sin(theta)) + (space == "turning") * SPIN**2 / 2 * centrifugal
    rate = np.sqrt(2 / inertia * fallen)
    assert run.statistics.time_reached == pytest.approx(float(np.sum(1 / rate) * (theta[1] - theta[0])), rel=5e-3)


TURN = {"name": "turn", "kind": "pcid", "end": 0.45, "output_step": 0.005}


def driven(tilt, *more):
    """Bauchau's four bars under paths, stiffened."""
    tables = bauchau(tilt, "pi/2+4*t", TURN, modes={"count": 3}, damping={"rayleigh": [0.0, 2e-5]})
    return make_scene(**tables | {"trajectory": [*tables["trajectory"], *more], "geometric_stiffening": True})


def test_a_crank_drives_a_loop_that_only_bending_lets_move():
    """In line at 180 degrees branches meet: C comes to 90 degrees of the parallelogram, and then goes back."""
    run = solve_scene(driven(np.deg2rad(5.0)), Watcher()).outcomes["turn"]
    crank, hinge = (run.q[:, run.model.columns(name)[0]] for name in "AC")
    np.testing.assert_allclose(crank, np.pi / 2 + 4 * run.time, atol=1e-9)
    assert np.abs(hinge - crank + np.pi / 2)[run.time < 0.3].max() < 0.02  # a parallelogram that bends a little
    assert hinge[-1] < hinge.max() - 0.2 < np.pi / 2
    locked, branches = (one for one in run.statistics.warnings if "loop" in one)
    assert locked.startswith('loops lock joints "A", "B", "C" with rigid links')
    assert float(branches.split()[3]) == pytest.approx(np.pi / 8, abs=0.02)
    assert 'loops that "D" close pass a singular posture' in branches


def test_two_cranks_of_a_loop_that_moves_are_still_too_many():
    """Without the tilt links need not bend: as many paths as the mechanism has freedoms, no more."""
    scene = driven(0.0, {"name": "second", "joint": "B", "value": "-pi/2-4*t"})
    with pytest.raises(InputError, match="at most 1 components"):
        solve_scene(scene, Watcher())
