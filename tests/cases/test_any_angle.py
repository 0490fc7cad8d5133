"""Angles of any size, far beyond a turn: joints, rpy, guesses, free orientations, paths of tools, joints of loops."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tables_3d import ORIGIN, X, Z, joint, revolute, rigid, scene

import ffrobot
from ffrobot.mbs.quantities.motion import node_of
from ffrobot.mbs.quantities.validity import doubts
from ffrobot.run.solve import solve_scene
from ffrobot.run.watcher import Watcher

W = 20 * np.pi  # rad/s: ten turns in a second


def bar(name, length=0.5, mass=1.0, center=None):
    center = [length / 2, 0.0, 0.0] if center is None else center
    return rigid(name, mass, [0.1, 0.2, 0.25], center, tip=[length, 0.0, 0.0])


def solved(body, joint, analysis, **tables):
    return ffrobot.solve(ffrobot.make_scene(**scene(body, joint, *analysis, gravity=ORIGIN, **tables)))


def analysis(kind, **keys):
    return [{"name": "a", "kind": kind, "end": 1.0, "output_step": 0.05, **keys}]


def turns(results, body):
    return Rotation.from_quat(np.roll(results[f"a/bodies/{body}/quaternion"], -1, axis=1))


@pytest.mark.parametrize(
    ("kind", "of_type", "rates", "lead"),
    [
        ("pcid", "revolute", W, 0.0), ("pcid", "screw", W, 0.01), ("forward", "revolute", W, 0.0),
        ("forward", "screw", W, 0.01), ("forward", "cylindrical", [W, 0.3], 0.0), ("forward", "planar", [0, 0, W], 0.0),
    ],
)  # fmt: skip
def test_bodies_are_where_their_joints_have_turned_them(kind, of_type, rates, lead):
    """By the closed form, ten turns from zero, the joint itself turned by an rpy of 30 rad."""
    keys = {"lead": lead} if of_type == "screw" else {}
    record = {"name": "j", "type": of_type, "between": ["ground", "a.root"], "axis": Z, "rpy": [0, 0, 30.0], **keys}
    center = {"center": [0.0, 0.0, 0.0]} if of_type == "planar" else {}
    tables = {"body": [bar("a", **center)], "joint": [record], "initial": {"joint_rates": {"j": rates}}}
    if kind == "pcid":
        tables["trajectory"] = [{"name": "t", "joint": "j", "value": f"{W}*t"}]
    results = solved(**tables, analysis=analysis(kind))
    t = results["a/time"]
    angle, rise = 30.0 + W * t, {"screw": lead * W / 2 / np.pi, "cylindrical": 0.3}.get(of_type, 0.0)
    tip = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), rise * t], axis=1)
    np.testing.assert_allclose(results["a/points/a.tip/position"], tip, atol=1e-9)
    (told,) = results.attributes("a")["warnings"]
    assert 'joint "j": rpy = [0, 0, 30] rad is more than a turn' in told


@pytest.mark.parametrize("initial", [{}, {"joints": {"j": "20*pi"}}], ids=["", "guessed"])
def test_a_path_may_begin_many_turns_from_zero(initial):
    joint = revolute("j", "ground", "a.root")
    path = {"name": "t", "joint": "j", "value": "20*pi+0.3+t**2"}
    results = solved(body=[bar("a")], joint=[joint], trajectory=[path], initial=initial, analysis=analysis("pcid"))
    angle = 0.3 + results["a/time"] ** 2
    expected = 0.5 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    np.testing.assert_allclose(results["a/points/a.tip/position"], expected, atol=1e-12)
    assert not list(results.attributes("a")["warnings"])


@pytest.mark.parametrize("integrator", ["dop853", "dopri5", "radau", "generalized-alpha"])
@pytest.mark.parametrize("joint", ["spherical", "free"])
def test_free_orientations_turn_by_more_than_a_step_may(joint, integrator):
    """About a principal axis: a constant rate, which no step of a method limits. From a guess beyond a turn."""
    guess, rates = [5.0, 9.0, -30.0], [0.0, 0.0, W]
    if joint == "free":
        guess, rates = [0.1, 0.2, 0.3, *guess], [0.0, 0.0, 0.0, *rates]
    results = solved(
        body=[bar("a", center=[0.0, 0.0, 0.0])], joint=[{"name": "j", "type": joint, "between": ["ground", "a.root"]}],
        initial={"joints": {"j": guess}, "joint_rates": {"j": rates}},
        analysis=analysis("forward", tolerance=1e-4, integrator=integrator),
    )  # fmt: skip
    expected = Rotation.from_rotvec(guess[-3:]) * Rotation.from_rotvec(
        W * results["a/time"][:, None] * np.array([0, 0, 1])
    )
    assert (turns(results, "a").inv() * expected).magnitude().max() < 1e-9


@pytest.mark.parametrize("key", ["rotation_vector", "rpy"])
def test_tools_turn_many_times(key):
    """Ten turns about an axis of its own, on three slides and a wrist."""
    axis = np.array([1.0, 2.0, 2.0]) / 3 if key == "rotation_vector" else np.array([1.0, 0.0, 0.0])
    wrist = [[0.0, 1.0, -1.0], [-4.0, 1.0, 1.0]] if key == "rotation_vector" else [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    bodies = [bar(name, 1e-3, mass=0.1) for name in "abcde"]
    for body in bodies:
        body["rigid"]["points"]["tip"] = [0.0, 0.0, 0.0]
    axes = [*np.eye(3).tolist(), *wrist, axis.tolist()]
    sides = zip(["ground", *(f"{name}.tip" for name in "abcde")], [f"{name}.root" for name in "abcdef"], strict=True)
    joints = [
        {"name": f"j{k}", "type": "prismatic" if k < 3 else "revolute", "axis": axes[k], "between": list(between)}
        for k, between in enumerate(sides)
    ]
    s = "(10*t**3-15*t**4+6*t**5)"
    angles = [f"{W * x}*{s}" for x in axis]
    path = {"name": "t", "point": "f.root", "x": "0", "y": "0", "z": "0.1*t", key: angles}
    results = solved(body=[*bodies, bar("f")], joint=joints, trajectory=[path], analysis=analysis("pcid"))
    t = results["a/time"]
    turned = W * (10 * t**3 - 15 * t**4 + 6 * t**5)
    expected = Rotation.from_rotvec(turned[:, None] * axis)
    assert (turns(results, "f").inv() * expected).magnitude().max() < 1e-9
    np.testing.assert_allclose(results["a/joints/j5/coordinate"], turned, atol=1e-8)
    assert list(results.attributes("a/trajectories/t")["components"]) == ["x", "y", "z", "mx", "my", "mz"]


def drag_link(outputs):
    """Both cranks of it turn all round, ten times; the loop is cut at C or at D. Where D is, and the results."""
    A, g, a, b, c = 0.4, 0.1, 0.3, 0.32, 0.3
    crank, D = a * np.array([np.cos(A), np.sin(A), 0.0]), np.array([g, 0.0, 0.0])
    d = np.linalg.norm(D - crank)
    theta = np.arctan2(*(D - crank)[1::-1]) + np.arccos((d**2 + b**2 - c**2) / (2 * d * b))
    psi = np.arctan2(*(crank + b * np.array([np.cos(theta), np.sin(theta), 0.0]) - D)[1::-1])
    joints = [
        {"name": "A", "type": "revolute", "between": ["ground", "a.root"], "axis": [0, 0, 1], "motor": True},
        {"name": "B", "type": "universal", "between": ["a.tip", "b.root"], "axis": [0, 0, 1], "second_axis": [0, 1, 0]},
        {"name": "C", "type": "universal", "between": ["b.tip", "c.tip"], "axis": [0, 0, 1], "second_axis": [0, 1, 0]},
        {"name": "D", "type": "cylindrical", "between": ["ground", "c.root"], "axis": [0, 0, 1], "at": D.tolist()},
    ]
    guess = {"A": A, "B": [theta - A, 0.0], "C": [psi - theta, 0.0], "D": [psi, 0.0]}
    path = {"name": "t", "joint": "A", "value": f"{A}+2*pi*10*(t-sin(2*pi*t)/2/pi)"}
    results = solved(
        body=[bar("a", a), bar("b", b), bar("c", c)], joint=joints, initial={"joints": guess}, trajectory=[path],
        analysis=analysis("pcid", output_step=1 / outputs),
    )  # fmt: skip
    return D, results


def test_loops_turn_many_times():
    """The bodies stay together, and the joint at which the loop is cut has turned as often as the crank."""
    D, results = drag_link(100)
    assert np.abs(results["a/bodies/c/position"] - D).max() < 1e-7
    assert results["a/constraint_violation"][:, 0].max() < 1e-8
    angle = results["a/joints/D/coordinate"][:, 0]
    assert angle[-1] - angle[0] == pytest.approx(20 * np.pi, abs=1e-6)
    assert not list(results.attributes("a")["warnings"])


@pytest.mark.parametrize("outputs", [2, 5, 10, 20])
def test_turns_that_outputs_do_not_show_are_told(outputs):
    """Of joints at which loops are cut, whose coordinates are read off the outputs."""
    (told,) = drag_link(outputs)[1].attributes("a")["warnings"]
    assert 'joint "D": outputs are too far apart to count the turns' in told


@pytest.mark.parametrize("unit", [1.0, 1e3, 1e-3])
@pytest.mark.parametrize("what", ["angle", "way", "point"])
def test_constraints_that_do_not_hold_are_told(what, unit):
    """Of a motion that is off by a known share of the robot's size, or rad; whatever the unit of length is."""
    joints = [revolute("A", "ground", "a.root"), joint("S", "prismatic", "a.tip", "b.root", axis=X)]
    path = {
        "angle": {"joint": "A", "value": "0.1*t"},
        "way": {"joint": "S", "value": f"{0.1 * unit}*t"},
        "point": {"point": "b.tip", "x": f"{unit}*(2+0.1*t)"},
    }[what]
    run = {"name": "a", "kind": "pcid", "end": 1.0, "output_step": 0.05, "tolerance": 1e-5}
    tables = scene([bar("a", unit), bar("b", unit)], joints, run, gravity=ORIGIN, trajectory=[{"name": "t"} | path])
    (result,) = solve_scene(ffrobot.make_scene(**tables), Watcher()).analyses.values()
    assert not list(doubts(result.run, 1e-5))
    column = node_of(result.run, "a" if what == "angle" else "b").q.start
    for off, is_told in ((3e-6, False), (1e-4, True), (1e20, True), (np.nan, True)):
        q = result.run.q.copy()
        q[7, column] += off * (1.0 if what == "angle" else unit)
        broken = replace(result, run=replace(result.run, q=q))
        assert any('trajectory "t" is violated by' in text for text in broken.warnings) == is_told
