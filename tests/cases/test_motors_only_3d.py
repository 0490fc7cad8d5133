"""Motors alone in 3D: moments that carry an arm along its path."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from patched_arms import arm
from tables_3d import pin, planar

import ffrobot
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher

S = "10*(t/0.4)**3 - 15*(t/0.4)**4 + 6*(t/0.4)**5"
PATH = {"name": "tip", "point": "link.tip", "y": f"0.1*({S})", "z": f"0.25 - 0.15*({S})"}
EXACT = {"name": "exact", "kind": "motors-only", "end": 0.4, "output_step": 0.01, "tolerance": 1e-6}
AGAIN = {"name": "again", "kind": "forward", "actuation": "exact", "apply": "joints", "tolerance": 1e-7}


def scene(*analyses, path=PATH, **tables):
    return ffrobot.make_scene(**arm(*analyses, trajectory=[path], **tables))


@pytest.mark.parametrize("motors", ["section", "frame"])
def test_moments_carry_the_arm_along_its_path_and_to_rest(motors):
    """A link that bends in both planes, yaw and pitch: motors alone keep its tip on the path, and it rests after."""
    with ffrobot.solve(scene(EXACT, AGAIN, motors=motors)) as results:
        t, tip = results["again/time"], results["again/points/link.tip/position"]
        assert t[0] < -0.03
        assert t[-1] > 0.43
        u = np.clip(t / 0.4, 0.0, 1.0)
        s = 10 * u**3 - 15 * u**4 + 6 * u**5
        expected = np.column_stack([0.1 * s, 0.25 - 0.15 * s])
        np.testing.assert_allclose(tip[:, 1:], expected, atol=2e-6)
        assert np.abs(results["exact/points/link.tip/deflection"]).max(axis=0)[1:].min() > 1e-4
        swing = np.abs(results["again/bodies/link/modal_velocity"])
        assert swing[-1].max() < 1e-4 * swing.max()


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ({k: PATH[k] for k in ("name", "point", "y")}, r"as the mechanism has degrees of freedom \(2\), found 1"),
        (PATH | {"y": f"0.1*t + 0*({S})"}, "expected a path at rest at t = 0 s"),
    ],
)
def test_mistakes(path, message):
    with pytest.raises(ffrobot.InputError, match=message):
        ffrobot.solve(scene(EXACT, path=path))


def off_its_line(case, run):
    """Largest distance of the tip from the straight line, m."""
    start, end = np.array([[0.65, 0.10, 0.50], [0.40, 0.45, 0.65]])
    way = (end - start) / np.linalg.norm(end - start)
    tip = case.file[f"{run}/points/fore.tip/position"][()] - start
    return np.linalg.norm(tip - np.outer(tip @ way, way), axis=1).max()


def test_leaning_arm_keeps_to_its_line(solved):
    """Offsets, a leaning axis, bending in both planes, gravity, a payload: the replay in the nonlinear model."""
    leaning_arm = solved("arm_3r_motors_only")
    assert off_its_line(leaning_arm, "exact") < 1e-9
    assert off_its_line(leaning_arm, "exact_forward") < 1e-8
    assert off_its_line(leaning_arm, "joints_only") > 1e-3
    last = leaning_arm.file["exact_forward/points/fore.tip/position"][-1]
    np.testing.assert_allclose(last, [0.40, 0.45, 0.65], atol=1e-8)
    for body in ("upper", "fore"):
        bent = np.abs(leaning_arm.file[f"exact/points/{body}.tip/deflection"]).max(axis=0)
        assert bent[1:].min() > 5e-4


def test_an_arm_that_starts_next_to_a_singular_posture_is_told_so():
    """Undeformed it reaches its start, nearly stretched; bent links need postures beyond the reach of its joints.

    Round-off decides which of two causes is met first.
    """
    link = beam_link(0.4, rectangle(0.012, 0.02), 8, modes={"count": 2, "family": "in-plane-bending"})
    path = {"name": "tip", "point": "b.tip", "x": f"0.8*cos(5e-4) - 0.05*({S})", "y": f"0.1*({S})"}
    tables = planar(
        [{"name": name, "link": link} for name in "ab"], [pin("O", "ground", "a.root"), pin("A", "a.tip", "b.root")],
        EXACT, gravity=(0.0, 0.0), trajectory=[path], initial={"joints": {"O": -5e-4, "A": 1e-3}},
    )  # fmt: skip
    causes = "at t = 0 s nearly a singular posture.*Move the path", "singular coupling between t = 0 and"
    with pytest.raises(ffrobot.SolveError, match="|".join(causes)):
        ffrobot.solve(ffrobot.make_scene(**tables))


class StopsAfter(Watcher):
    """Stops an analysis at its n-th question, or at the first beyond a time."""

    def __init__(self, questions=10**9, time=np.inf):
        self.questions, self.time = questions, time

    def advance(self, t, end):
        self.questions -= 1
        return self.questions > 0 and t < self.time


@pytest.mark.parametrize("questions", [1, 3, 6])
def test_stop_before_a_motion_is_found_says_so(questions):
    """Before the postures, and in the linearization."""
    with pytest.raises(ffrobot.SolveError, match=r'analysis "exact": stopped on request before any of its motion'):
        solve_scene(scene(EXACT), StopsAfter(questions))


def test_stop_keeps_the_motion_that_was_found():
    run = solve_scene(scene(EXACT | {"output": "redefined"}), StopsAfter(time=0.1)).outcomes["exact"]
    assert run.status == "interrupted"
    assert 0.1 < run.time[-1] < 0.4
    assert np.isfinite(run.q).all()
    with pytest.raises(ffrobot.SolveError, match=r'"exact" ended at t = 0\.\d+ s \(interrupted\): stopped on request'):
        run.check_completed()
