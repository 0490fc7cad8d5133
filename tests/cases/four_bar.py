"""A four-bar linkage of rigid bars in the plane, as a planar scene and as one in 3D, with any keys of its joints."""

import numpy as np
from scenes_in_3d import joint_keys, rigid_keys

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
