"""What joints carry, by its definition: no force or moment of a motor along its joint, in all kinds of analysis."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tables_3d import rigid, scene

import ffrobot

END, STEP = 0.2, 0.02
POSE = {"cylindrical": [0.2, 0.1], "universal": [0.3, -0.2], "revolute": 0.4, "prismatic": 0.1, "screw": -0.3}
KINDS = ["rest", "straight", "inverse", "again", "along", "held"]


def body(name, tip):
    return rigid(name, 0.7, [4e-3, 5e-3, 6e-3], [0.1, 0.02, -0.01], tip=tip)


def analyses(paths_only):
    inverse = {"end": END, "output_step": STEP, "tolerance": 1e-9}
    replay = {"kind": "forward", "actuation": "inverse", "tolerance": 1e-9}
    found = [
        {"name": "rest", "kind": "static"},
        {"name": "straight", "kind": "fcid", "shape": "zero", "end": END, "output_step": STEP},
        {"name": "inverse", "kind": "pcid", **inverse},
        {"name": "again", "apply": "joints", **replay},
        {"name": "along", "apply": "trajectory", **replay},
    ]
    held = {"name": "held", "kind": "closed-loop", "actuation": "inverse", "sample_time": 0.002}
    return [*found, held | {"controller": [{"kind": "joint-pid", "proportional": paths_only}]}]


def chain(types, turned):
    """Joints of these types one after the other; every second one leads inwards where `turned`."""
    rng = np.random.default_rng(3)
    bodies = [body(f"b{k}", (0.3 * rng.standard_normal(3)).tolist()) for k in range(len(types))]
    joints, guess = [], {}
    for k, kind in enumerate(types):
        sides = ["ground" if k == 0 else f"b{k - 1}.tip", f"b{k}.root"]
        axis, across = rng.standard_normal((2, 3))
        keys = {"axis": axis.tolist()}
        if kind == "universal":
            keys["second_axis"] = np.cross(axis, across).tolist()
        if kind == "screw":
            keys["lead"] = 0.08
        inwards = turned and k % 2
        joints.append({"name": f"j{k}", "type": kind, "between": sides[:: -1 if inwards else 1]} | keys)
        guess[f"j{k}"] = POSE[kind]
    return scene(bodies, joints, gravity=[1.0, 2.0, -9.0], initial={"joints": guess})


def solved(tables, analyses):
    return ffrobot.solve(ffrobot.make_scene(**tables | {"analysis": analyses}))


def no_work(results, names, joints):
    for name in names:
        for joint in joints:
            assert np.abs(along_joint(results, name, joint)).max() < 1e-7, (name, joint["name"])


def along_joint(results, analysis, joint):
    """Sᵀ (reaction, reaction_moment) (T, k): what of them does work along the joint's coordinates."""
    force, moment = (results[f"{analysis}/joints/{joint['name']}/{key}"] for key in ("reaction", "reaction_moment"))

    def turned(side, axis):
        if side == "ground":
            return np.tile(np.array(axis) / np.linalg.norm(axis), (len(force), 1))
        e = np.roll(results[f"{analysis}/bodies/{side.partition('.')[0]}/quaternion"], -1, axis=1)
        return Rotation.from_quat(e).apply(np.array(axis) / np.linalg.norm(axis))

    z = turned(joint["between"][0], joint["axis"])
    of_force, of_moment = np.sum(z * force, axis=1), np.sum(z * moment, axis=1)
    if joint["type"] == "universal":
        return np.array([of_moment, np.sum(turned(joint["between"][1], joint["second_axis"]) * moment, axis=1)])
    return {
        "revolute": np.array([of_moment]), "prismatic": np.array([of_force]),
        "cylindrical": np.array([of_force, of_moment]),
        "screw": np.array([joint.get("lead", 0.0) / 2 / np.pi * of_force + of_moment]),
    }[joint["type"]]  # fmt: skip


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
def test_reactions_do_no_work_along_joints_that_follow_paths(turned):
    tables = chain(["prismatic", "screw", "revolute", "screw"], turned)
    tables["trajectory"] = [
        {"name": f"t{k}", "joint": joint["name"], "value": f"{POSE[joint['type']]}+0.3*t**2*sin({k + 4}*t)"}
        for k, joint in enumerate(tables["joint"])
    ]
    results = solved(tables, analyses({joint["name"]: 5.0 for joint in tables["joint"]}))
    no_work(results, KINDS, tables["joint"])
    for name in KINDS:
        for joint in tables["joint"]:
            assert np.abs(results[f"{name}/joints/{joint['name']}/moment"]).max() > 1e-3


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
def test_reactions_do_no_work_along_joints_with_several_coordinates(turned):
    """A tool in six coordinates that follows a pose, or motors that do."""
    tables = chain(["cylindrical", "universal", "revolute", "prismatic"], turned)
    joints, tip = tables["joint"], f"b{len(tables['joint']) - 1}.tip"
    start = solved(tables, [{"name": "a", "kind": "forward", "end": 1e-3, "output_step": 1e-3}])
    x = start[f"a/points/{tip}/position"][0]
    turn = Rotation.from_quat(np.roll(start[f"a/points/{tip}/quaternion"][0], -1)).as_rotvec()
    path = {key: f"{value}+0.4*t**2" for key, value in zip("xyz", x, strict=True)}
    path |= {"rotation_vector": ["t**2", "0", "-t**2"], "reference_rotation_vector": turn.tolist()}
    tables["trajectory"] = [{"name": "t", "point": tip, **path}]
    no_work(solved(tables, analyses({joint["name"]: 5.0 for joint in joints})), KINDS, joints)


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_a_screw_jack_in_closed_form(unit):
    """A nut lifts a mass along z: the thread gives m (g + a), and turns it back by that times the rise per radian."""
    m, lead, J = 2.0, 0.05 * unit, 0.03 * unit**2
    nut = body("nut", [0.0, 0.0, unit])
    nut["rigid"] |= {"mass": m, "center": [0.0, 0.0, 0.0], "inertia": [J, J, J]}
    joint = {"name": "jack", "type": "screw", "between": ["ground", "nut.root"], "axis": [0, 0, 1], "lead": lead}
    path = {"name": "t", "joint": "jack", "value": "20*t**3"}
    tables = scene([nut], [joint], gravity=[0.0, 0.0, -9.81 * unit], trajectory=[path])
    results = solved(tables, analyses({"jack": 5.0 * unit**2}))
    h = lead / (2 * np.pi)
    for name in ("straight", "inverse", "again", "along"):
        alpha = 120.0 * results[f"{name}/time"]
        force = m * (9.81 * unit + h * alpha)
        size = np.abs(force).max()
        np.testing.assert_allclose(results[f"{name}/joints/jack/reaction"][:, 2], force, atol=1e-9 * size)
        np.testing.assert_allclose(
            results[f"{name}/joints/jack/reaction_moment"][:, 2], -h * force, atol=1e-9 * h * size
        )
        np.testing.assert_allclose(results[f"{name}/joints/jack/moment"], J * alpha + h * force, atol=1e-8 * J * 24)


ROUGH = {"viscous_friction": 3.0, "coulomb_friction": 2.0, "friction_speed": 0.05}


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
def test_friction_loads_and_rotors_along_joints_are_no_reactions(turned):
    """They do work along the joints as motors do, and no reaction does."""
    tables = chain(["prismatic", "screw", "revolute", "cylindrical"], turned)
    for joint in tables["joint"]:
        joint |= ROUGH | ({"rotor_inertia": 0.02} if joint["type"] in ("revolute", "prismatic") else {})
    tables["load"] = [{"joint": "j0", "moment": "7*cos(9*t)"}, {"joint": "j2", "moment": "3*cos(9*t)"}]
    fall = {"name": "fall", "kind": "forward", "end": END, "output_step": STEP, "tolerance": 1e-9}
    results = solved(tables, [fall])
    no_work(results, ["fall"], tables["joint"])
    for joint in tables["joint"]:
        assert np.abs(results[f"fall/joints/{joint['name']}/rate"]).max() > 1e-2


@pytest.mark.parametrize("closes", [False, True], ids=["in the tree", "closes a loop"])
def test_a_block_that_slides_with_friction_in_closed_form(closes):
    """A block on rails across gravity: they bear m g across and nothing along, whatever friction takes of the motion.

    A second slide beside the first closes a loop; friction acts in the one that is asked about.
    """
    m, d, v0 = 2.0, 6.0, 1.5
    block = body("block", [0.0, 0.0, 0.0])
    block["rigid"] |= {"mass": m, "center": [0.0, 0.0, 0.0]}
    rail = {"type": "prismatic", "between": ["ground", "block.root"], "axis": [1.0, 0.0, 0.0], "motor": False}
    rough = rail | {"name": "rough", "viscous_friction": d}
    joints = [rail | {"name": "smooth"}, rough] if closes else [rough]
    fall = {"name": "fall", "kind": "forward", "end": 0.5, "output_step": 0.05, "tolerance": 1e-9}
    start = {"joint_rates": {joint["name"]: v0 for joint in joints}}
    results = solved(scene([block], joints, gravity=[0.0, 0.0, -10.0], initial=start), [fall])
    time, shares = results.time("fall"), 2 if closes else 1
    np.testing.assert_allclose(
        results["fall/bodies/block/position"][:, 0], v0 * m / d * (1 - np.exp(-d * time / m)), atol=1e-7
    )
    expected = np.tile([0.0, 0.0, 10.0 * m / shares], (len(time), 1))
    for joint in joints:
        np.testing.assert_allclose(results[f"fall/joints/{joint['name']}/reaction"], expected, atol=1e-8)


def test_a_weld_carries_a_robot_that_cannot_move():
    """Its weight, at a lever: without a joint that moves or a link that bends no equation is left to solve."""
    kinds = [{"name": "rest", "kind": "static"}, {"name": "about", "kind": "linear"}]
    kinds += [{"name": "on", "kind": "forward", "end": END, "output_step": STEP}]
    weld = {"name": "W", "type": "weld", "between": ["ground", "b.root"]}
    with solved(scene([body("b", [0.3, 0.0, 0.0])], [weld]), kinds) as results:
        for kind in ("rest", "on"):
            force, moment = (results[f"{kind}/joints/W/{key}"] for key in ("reaction", "reaction_moment"))
            np.testing.assert_allclose(force, np.tile([0.0, 0.0, 0.7 * 9.81], (len(force), 1)), atol=1e-12)
            lever = np.cross([0.1, 0.02, -0.01], [0.0, 0.0, 0.7 * 9.81])
            np.testing.assert_allclose(moment, np.tile(lever, (len(force), 1)), atol=1e-12)
        assert results["about/linear/A"].shape == (1, 0, 0)
