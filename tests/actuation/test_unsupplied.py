"""Paths of a tip that motors alone cannot follow: what the program says they miss, against runs with motors alone."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from links import quintic

import ffrobot as library
from ffrobot.actuation import feasibility
from ffrobot.mbs.quantities.motion import section_motion
from ffrobot.run.solve import solve_scene

GEARED = {"gear_ratio": 80.0, "rotor_inertia": 2e-5}


def link(name, length, height):
    return beam_link(
        length, rectangle(height, 0.03), 20, nu=None, name=name,
        modes={"count": 4, "family": "in-plane-bending", "attachment_modes": False}, damping={"ratio": 0.01}
    )  # fmt: skip


def chain(lengths, heights, angles, payload, joint, trajectory, analysis):
    names = [f"link{k}" for k in range(1, len(lengths) + 1)]
    ends = ["ground", *(f"{name}.tip" for name in names)]
    joints = [
        {"name": f"J{k}", "type": "revolute", "between": [end, f"{name}.root"], **joint}
        for k, (end, name) in enumerate(zip(ends[:-1], names, strict=True), 1)
    ]
    return library.make_scene(
        name="chain", space="planar", gravity=[0.0, -9.81], joint=joints, trajectory=trajectory, analysis=analysis,
        body=[{"name": n, "link": link(n, *of)} for n, *of in zip(names, lengths, heights, strict=True)],
        payload=[{"point": f"{names[-1]}.tip", "mass": payload}],
        initial={"state": "static", "angles": dict(zip(names, angles, strict=True))},
    )  # fmt: skip


def place(lengths, angles):
    return np.array([np.cos(angles), np.sin(angles)]) @ lengths


LENGTHS, HEIGHTS, START, END = (0.5, 0.4, 0.15), (0.012, 0.01, 0.008), (1.2, 0.3, -0.3), (0.7, -0.1, -0.9)


def run_for(duration):
    return {"name": "inverse", "kind": "pcid", "end": duration, "output_step": 0.002, "tolerance": 1e-5}


REPEATED = {"name": "moments", "kind": "forward", "actuation": "inverse", "apply": "joints"}


def three(payload, *later):
    """Three links behind geared motors, the tip and the angle of the hand on paths."""
    tip = {
        axis: quintic(a, b, 1.2)
        for axis, a, b in zip("xy", place(LENGTHS, START), place(LENGTHS, END), strict=True)
    }  # fmt: skip
    trajectory = [
        {"name": "tip", "point": "link3.tip", **tip},
        {"name": "hand", "angle": "link3", "value": quintic(START[2], END[2], 1.2)},
    ]
    return solve_scene(chain(LENGTHS, HEIGHTS, START, payload, GEARED, trajectory, [run_for(1.2), *later]))


def one(*later):
    trajectory = [{"name": "tip", "point": "link1.tip", "y": quintic(-0.8 * np.sin(0.2), 0.8 * np.sin(0.5), 1.0)}]
    return solve_scene(chain((0.8,), (0.012,), (-0.2,), 0.5, {}, trajectory, [run_for(1.0), *later]))


def miss(solution, name, point):
    """Distance (T,) m of the point in a run from where it is in "inverse"."""
    run, path = (section_motion(solution.analyses[analysis].run, point).r for analysis in (name, "inverse"))
    return np.linalg.norm(run - path[: len(run)], axis=1)


def found(solution):
    return solution.analyses["inverse"].actuation.feasibility.unsupplied


def test_moments_repeated():
    """Before the robot drifts away: in the first third of the run."""
    solution = one(REPEATED)
    about, error = found(solution), miss(solution, "moments", "link1.tip")
    assert about.point == "link1.tip"
    assert error[: len(error) // 3].max() == pytest.approx(about.moments_repeated, rel=0.35)
    assert about.moments_repeated > 3e-4


def test_moments_repeated_by_few_instants(monkeypatch):
    """What they find is what all instants find."""
    monkeypatch.setattr(feasibility, "ROWS", 100_000)
    every = found(one()).moments_repeated
    monkeypatch.setattr(feasibility, "ROWS", 12)
    assert found(one()).moments_repeated == pytest.approx(every, rel=1e-3)


def test_angles_kept():
    """By stiff controllers about the joint angles that were found: the mean over a run that rings at first."""
    gains = dict.fromkeys(("J1", "J2", "J3"), 2000.0)
    pid = {"kind": "joint-pid", "proportional": gains, "derivative": {name: 40.0 for name in gains}}
    kept = {"name": "kept", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.0005, "controller": [pid]}
    solution = three(1.0, kept)
    error, about = miss(solution, "kept", "link3.tip"), found(solution)
    late = error[len(error) // 2 :]
    assert late.mean() == pytest.approx(about.angles_kept, rel=0.1)
    assert error.max() < 1.5 * about.angles_kept


def test_what_is_said(tmp_path):
    trajectory = [{"name": "tip", "point": "link1.tip", "y": quintic(-0.15, 0.3, 1.0)}]
    scene = chain((0.8,), (0.012,), (-0.2,), 0.5, {}, trajectory, [run_for(1.0)])
    with pytest.warns(
        library.FfrobotWarning, match=r'no actuator provides all modal forces required on link1.*"motors-only"'
    ):
        results = library.solve(scene, tmp_path / "one.h5")
    about = results.attributes("inverse/feasibility/unsupplied")
    assert list(about["bodies"]) == ["link1"]
    assert not results.attributes("inverse/feasibility")["feasible"]
    shift = np.linalg.norm(results["inverse/points/link1.tip/predicted_shift"], axis=1)
    assert about["angles_kept"] == pytest.approx(shift.max(), rel=1e-4)  # which may be between outputs
    assert about["at_start"] == shift[0]


def test_a_joint_path_needs_nothing_besides_motors():
    trajectory = [{"name": "turn", "joint": "J1", "value": "0.3*(1-cos(3*t))"}]
    result = solve_scene(chain((0.8,), (0.012,), (0.0,), 0.5, {}, trajectory, [run_for(0.5)])).analyses["inverse"]
    assert result.actuation.feasibility.unsupplied is None
    assert result.actuation.feasibility.is_feasible
    assert not result.predicted_shift
