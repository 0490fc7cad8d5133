"""Four-bar linkages of rigid bars: in the plane, as a planar scene and as one in 3D, and out of it."""

import numpy as np
import tables_3d
from beam_links import beam_link, rectangle
from scenes_in_3d import joint_keys, rigid_keys
from tables_3d import Y, Z, revolute

from ffrobot.mbs.fields.spelling import place

LENGTHS = {"crank": 0.2, "coupler": 0.5, "rocker": 0.4}
BASE = 0.5  # m, between the two joints on the ground
SIDES = {
    "A": ["ground", "crank.root"], "B": ["crank.tip", "coupler.root"], "C": ["coupler.tip", "rocker.tip"],
    "D": ["ground", "rocker.root"],
}  # fmt: skip


def closed(crank):
    """Coordinates of all joints where the crank stands at an angle: triangles, the coupler's above."""
    tip = LENGTHS["crank"] * np.array([np.cos(crank), np.sin(crank)])
    way = np.array([BASE, 0.0]) - tip
    a, b, d = LENGTHS["coupler"], LENGTHS["rocker"], np.linalg.norm(way)
    coupler = np.arctan2(way[1], way[0]) + np.arccos((a**2 + d**2 - b**2) / (2 * a * d))
    end = tip + a * np.array([np.cos(coupler), np.sin(coupler)]) - [BASE, 0.0]
    rocker = np.arctan2(end[1], end[0])
    found = {"A": crank, "B": coupler - crank, "C": rocker - coupler, "D": rocker}
    return {name: float(angle) for name, angle in found.items()}


def planar(of_joints, analyses, **tables):
    """Tables of the planar scene; `of_joints`: keys by joint, which stand in the file in this order."""
    places = {"A": {"motor": True}, "D": {"at": [BASE, 0.0]}}
    at = closed(1.0)
    angles = {"crank": at["A"], "coupler": at["A"] + at["B"], "rocker": at["D"]}
    bodies = [
        {
            "name": name,
            "rigid": {"mass": 1.0, "center": [length / 2, 0.01], "inertia": 0.02,
                      "points": {"root": [0.0, 0.0], "tip": [length, 0.0]}},
        }
        for name, length in LENGTHS.items()
    ]  # fmt: skip
    joints = [
        {"name": name, "type": "revolute", "between": SIDES[name]} | places.get(name, {}) | own
        for name, own in of_joints.items()
    ]
    follows = {"trajectory": [{"name": "turn", "joint": "A", "value": "1 + 0.3*(1 - cos(3*t))"}]}
    return {
        "name": "four bars", "gravity": [0.0, -9.81], "body": bodies, "joint": joints, "initial": {"angles": angles},
        "analysis": analyses,
    } | follows | tables  # fmt: skip


def in_3d(of_joints, analyses, **tables):
    """Tables of the same in 3D."""
    found = planar(of_joints, analyses, **tables)
    return found | {
        "space": "spatial",
        "gravity": place(found["gravity"]),
        "body": [body | {"rigid": rigid_keys(body["rigid"])} for body in found["body"]],
        "joint": [joint_keys(joint) for joint in found["joint"]],
        "initial": {"joints": closed(1.0)},
    }


def out_of_plane(value, *analyses, unit=1.0, **of_joints):
    """Tables of a loop of revolute, universal, spherical and revolute joints, driven at A; lengths in a unit.

    `of_joints`: more keys by joint.
    """
    lengths = {"crank": 0.1 * unit, "rod": 0.4 * unit, "rocker": 0.35 * unit}
    bodies = [
        tables_3d.rigid(name, 0.3, [0.02 * length**2] * 3, [0.4 * length, 0.01 * unit, 0.0], tip=[length, 0.0, 0.0])
        for name, length in lengths.items()
    ]
    at = [0.35 * unit, 0.05 * unit, 0.1 * unit]
    joints = [
        revolute("A", "ground", "crank.root", motor=True),
        tables_3d.joint("B", "universal", "crank.tip", "rod.root", axis=Z, second_axis=Y, motor=False),
        revolute("D", "ground", "rocker.root", [0.2, -0.1, 1.0], at=at, motor=False),
        tables_3d.joint("C", "spherical", "rod.tip", "rocker.tip"),
    ]
    return tables_3d.scene(
        bodies, [joint | of_joints.get(joint["name"], {}) for joint in joints], *analyses,
        gravity=[0.0, -9.81 * unit, 0.0], initial={"joints": {"A": 0.7, "B": [-0.4, 0.0], "D": 1.8}},
        trajectory=[{"name": "turn", "joint": "A", "value": value}],
    )  # fmt: skip


BAUCHAU = {"crank": (0.12, 16e-3), "coupler": (0.24, 16e-3), "rocker": (0.12, 8e-3)}  # length, side, m


def bauchau(tilt, path, analysis, **of_links):
    """Tables of four bars whose hinge C is tilted, so that rigid ones lock it: it moves as they bend.

    Bauchau et al., Multibody Syst. Dyn. 37 (2016). Elastic bars, with more keys of beams.
    """
    links = {name: beam_link(length, rectangle(side, side), 8, **of_links) for name, (length, side) in BAUCHAU.items()}
    axis = [0.0, -float(np.sin(tilt)), float(np.cos(tilt))]
    joints = [
        revolute("A", "ground", "crank.root", motor=True),
        revolute("B", "crank.tip", "coupler.root", motor=False),
        revolute("C", "coupler.tip", "rocker.root", axis, rpy=[0.0, 0.0, -np.pi / 2], motor=False),
        revolute("D", "ground", "rocker.tip", at=[0.24, 0.0, 0.0], motor=False),
    ]
    return tables_3d.scene(
        [{"name": name, "link": link} for name, link in links.items()], joints, analysis, gravity=[0.0, 0.0, 0.0],
        initial={"joints": {"A": np.pi / 2, "B": -np.pi / 2, "C": 0.0, "D": -np.pi / 2}},
        trajectory=[{"name": "turn", "joint": "A", "value": path}],
    )  # fmt: skip
