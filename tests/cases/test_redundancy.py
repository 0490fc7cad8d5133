"""Arms with seven joints under six components: what settles the freedom left, and what is said where nothing does."""

import re

import numpy as np
import pytest
import scenes_in_3d
from checkpoint_scene_files import write_scene
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation
from tables_3d import ORIGIN, revolute, rigid, scene

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.common.rotations import exponential

LENGTHS = [0.0, 0.3, 0.0, 0.35, 0.0, 0.25, 0.15]  # m along x, of the link behind each joint
AXES = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=float)
GUESS = [0.2, -0.6, 0.3, 1.1, -0.4, 0.5, 0.2]
JOINTS = [f"q{k}" for k in range(1, 8)]
RUN = {"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": 0.005, "tolerance": 1e-9}


def places(angles):
    """By hand: axes (7, 3) and places (7, 3) of the joints, orientation and place of the tip."""
    A, r, axes, at = np.eye(3), np.array([0.0, 0.0, 0.4]), [], []
    for angle, axis, length in zip(angles, AXES, LENGTHS, strict=True):
        axes.append(A @ axis)
        at.append(r)
        A = A @ exponential(axis * angle)
        r = r + A @ [length, 0.0, 0.0]
    return np.array(axes), np.array(at), A, r


def jacobian(angles):
    axes, at, _, tip = places(angles)
    return np.vstack([np.cross(axes, tip - at).T, axes.T])


def left_free(angles):
    """The one direction of joint rates that moves neither the tip nor its axes."""
    return np.linalg.svd(jacobian(angles))[2][-1]


def arm(*analyses, **keys):
    bodies, joints = [], []
    for k, (axis, length) in enumerate(zip(AXES, LENGTHS, strict=True)):
        mass = 0.3 + 2 * length
        inertia = [2e-3, 2e-3 + mass * length**2 / 12, 3e-3 + mass * length**2 / 12]
        bodies.append(rigid(f"l{k}", mass, inertia, [length / 2, 0.01, -0.005], tip=[length, 0.0, 0.0]))
        inner = "ground" if k == 0 else f"l{k - 1}.tip"
        joints.append(revolute(JOINTS[k], inner, f"l{k}.root", axis.tolist()))
    joints[0]["at"] = [0.0, 0.0, 0.4]
    _, _, A, tip = places(GUESS)
    turn, tip, way = Rotation.from_matrix(A).as_rotvec().tolist(), tip.tolist(), "(1-cos(2*pi*t))"
    path = {
        "name": "tool", "point": "l6.tip", "reference_rotation_vector": turn,
        "x": f"{tip[0]!r} - 0.03*{way}", "y": f"{tip[1]!r} + 0.06*{way}", "z": f"{tip[2]!r} + 0.04*{way}",
        "rotation_vector": [f"0.05*{way}", "0", f"-0.08*{way}"],
    }  # fmt: skip
    start = {"joints": dict(zip(JOINTS, GUESS, strict=True))}
    return scene(bodies, joints, *analyses, trajectory=[path], initial=start, **keys)


def solve(tables):
    return ffrobot.solve(ffrobot.make_scene(**tables))


def read(found, key):
    return np.stack([found[f"inverse/joints/{joint}/{key}"] for joint in JOINTS], axis=1)


def test_least_motion_has_no_part_in_the_freedom_left():
    """q̇ = J⁺ẋ, J by the cross products of axes and arms: q̇ is square to what leaves the tip where it is."""
    with solve(arm(RUN, redundancy="least-motion")) as found:
        q, rates = read(found, "coordinate"), read(found, "rate")
        across = [left_free(angles) @ rate for angles, rate in zip(q, rates, strict=True)]
        assert np.abs(rates).max() > 0.5
        assert np.abs(across).max() < 1e-6 * np.abs(rates).max()
        assert not any("forces and inertia move" in text for text in found.attributes("inverse")["warnings"])
        assert len(found.attributes("inverse")["resolved_by"]) == 1


def test_least_torque_is_the_least_of_whole_motions():
    """∫ Σ τ² over ε, the size of (t/T)² that the joint has besides: the lowest point of the parabola is at ε = 0."""
    tables = arm(RUN | {"end": 0.4, "tolerance": 1e-7}, redundancy="least-torque")

    def integral(found):
        return simpson(np.sum(read(found, "moment") ** 2, axis=1), x=found["inverse/time"])

    with solve(tables) as found:
        (joint,) = found.attributes("inverse")["resolved_by"]
        time, angle, least = found["inverse/time"], found[f"inverse/joints/{joint}/coordinate"], integral(found)
    del tables["redundancy"]
    sums, sizes = [], (-0.1, 0.0, 0.1)
    tables["trajectory"].append({"name": "held", "joint": joint, "value": "0"})
    curve = np.polynomial.Polynomial.fit(time, angle, 32)  # of t/0.2 − 1
    assert np.abs(curve(time) - angle).max() < 1e-6
    for epsilon in sizes:
        terms = [f"({c!r})*(t/0.2 - 1)**{k}" for k, c in enumerate(curve.coef.tolist())]
        tables["trajectory"][-1]["value"] = " + ".join([*terms, f"({epsilon!r})*(t/0.4)**2"])
        with solve(tables) as found:
            sums.append(integral(found))
    a, b = (sums[0] + sums[2]) / 2 - sums[1], (sums[2] - sums[0]) / 2  # of ε/0.1
    assert sums[1] == pytest.approx(least, rel=1e-4)
    assert a > 1e-3 * least
    assert abs(b / (2 * a)) < 0.03
    with solve(arm(RUN | {"end": 0.4, "tolerance": 1e-7}, redundancy="least-motion")) as found:
        assert integral(found) > 1.001 * least


def test_freedom_that_nothing_settles_is_told_with_the_joints_that_move():
    with solve(arm(RUN)) as found:
        (told,) = (text for text in found.attributes("inverse")["warnings"] if "forces and inertia move" in text)
        moving = np.abs(left_free(GUESS)) > 1e-6
        assert told.startswith("1 degrees of freedom are not prescribed")
        assert [joint in told for joint in JOINTS] == moving.tolist()
        assert 'redundancy = "least-motion"' in told


def test_equilibrium_and_prescribed_shape_are_settled_as_well():
    rest, straight = {"name": "rest", "kind": "static"}, RUN | {"name": "inverse", "kind": "fcid", "shape": "zero"}
    straight.pop("tolerance")
    with solve(arm(rest, straight, redundancy="least-motion")) as found:
        np.testing.assert_allclose([found[f"rest/joints/{joint}/coordinate"][0] for joint in JOINTS], GUESS, atol=1e-9)
        across = [left_free(q) @ v for q, v in zip(read(found, "coordinate"), read(found, "rate"), strict=True)]
        assert np.abs(across).max() < 1e-6 * np.abs(read(found, "rate")).max()


@pytest.mark.parametrize("criterion", ["least-motion", "least-torque"])
def test_flexible_arm_on_a_turntable_follows_its_path_and_comes_back(tmp_path, criterion):
    """The 6R arm of the checkpoints with a seventh joint below: six rows hold, motors and forces replay the motion."""
    tables = scenes_in_3d.read(write_scene("arm6_undeformed", tmp_path))
    points = {"root": [0.0, 0.0, 0.0], "top": [0.1, 0.0, 0.0]}
    table = {"mass": 3.0, "center": [0.05, 0.0, 0.0], "inertia": [0.02, 0.03, 0.04], "points": points}
    first = next(joint for joint in tables["joint"] if "ground" in joint["between"])
    at = first.pop("at", [0.0, 0.0, 0.0])
    first["between"] = ["table.top" if side == "ground" else side for side in first["between"]]
    swivel = {"name": "swivel", "type": "revolute", "between": ["ground", "table.root"], "axis": [0.1, 0.0, 1.0]}
    tables["body"].insert(0, {"name": "table", "rigid": table})
    tables["joint"].insert(0, swivel | {"at": [at[0] - 0.1, at[1], at[2]]})
    tables["analysis"] = [{"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.005, "tolerance": 1e-7}]
    with solve(tables | {"redundancy": criterion}) as found:
        assert found["inverse/constraint_violation"][:, 0].max() < 1e-10
        (joint,) = found.attributes("inverse")["resolved_by"]
        moments = [found[f"inverse/joints/{each['name']}/moment"] for each in tables["joint"]]
        assert np.abs(found[f"inverse/joints/{joint}/moment"]).max() > 1e-3
        assert np.all(np.isfinite(moments))


@pytest.mark.parametrize("criterion", ["least-motion", "least-torque"])
def test_a_path_out_of_reach_ends_where_the_arm_is_straight(criterion):
    """Three bars of 1.2 m in all; the search went on without end."""
    names = ["ground", "a", "b", "c"]
    bars = [rigid(name, 1.0, [1e-3, 0.02, 0.02], [0.2, 0.0, 0.0], tip=[0.4, 0.0, 0.0]) for name in names[1:]]
    ends = ["ground", "a.tip", "b.tip"]
    joints = [revolute(f"j{k}", ends[k], f"{names[k + 1]}.root", [0.0, 0.0, 1.0]) for k in range(3)]
    tables = scene(
        bars, joints, {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.1}, gravity=ORIGIN,
        initial={"joints": {"j0": 0.8, "j1": -1.0, "j2": -0.6}}, redundancy=criterion,
        trajectory=[{"name": "line", "point": "c.tip", "x": "0.7 + 0.6*t", "y": "0.1"}],
    )  # fmt: skip
    with pytest.raises(ffrobot.SolveError, match="the joints cannot follow the path there") as error:
        solve(tables)
    reached = (np.sqrt(1.2**2 - 0.1**2) - 0.7) / 0.6
    assert float(re.search(r"at t = ([\d.]+) s", str(error.value))[1]) == pytest.approx(reached, abs=1e-6)


def test_keys_that_settle_nothing_are_refused():
    tables = arm(RUN, redundancy="least-motion")
    tables["trajectory"].append({"name": "held", "joint": "q3", "value": "0.3"})
    with pytest.raises(InputError, match="redundancy: expected a mechanism with more degrees of freedom"):
        solve(tables)
    with pytest.raises(InputError, match="redundancy: expected"):
        solve(arm(RUN, redundancy="least"))
