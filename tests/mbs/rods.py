"""Rigid rods, and a slider-crank of them."""

import numpy as np
from mechanisms import make_model, revolute

from ffrobot.mbs.fields.spelling import place
from ffrobot.mbs.model import body as bodies
from ffrobot.scene.load import make_scene

CRANK, ROD = 0.2, 0.5


def rigid_body(name, mass, inertia, center, points):
    """A body without modes, `inertia` about its center."""
    places = {label: place(position) for label, position in points.items()}
    return bodies.rigid_body(name, mass, place(center), inertia * np.eye(3), places)


def rod(name, length, mass):
    points = {"root": (0.0, 0.0), "tip": (length, 0.0)}
    return rigid_body(name, mass, mass * length**2 / 12, (length / 2, 0.0), points)


def slider_crank(path=None, coupler=None, **keys):
    """With a motor at the crank; `coupler` in place of a rod of 1.5 kg."""
    joints = [
        revolute("O", "ground", "crank.root", motor=True),
        revolute("A", "crank.tip", "rod.root"),
        revolute("B", "rod.tip", "slider.pin"),
        {"name": "rail", "type": "prismatic", "between": ("ground", "slider.pin"), "axis": (1.0, 0.0)},
    ]
    slider = rigid_body("slider", 0.4, 0.01, (0.0, 0.0), {"pin": (0.0, 0.0)})
    bodies = [rod("crank", CRANK, 1.0), coupler or rod("rod", ROD, 1.5), slider]
    initial = {"initial": {"angles": {"crank": 0.9, "rod": -0.3}}}
    return make_model(bodies, joint=joints, trajectory=[path] if path else [], **(initial | keys))


def arm_of_rods(rods, joints=("O", "A"), of_joints=(), **keys):
    """The scene of uniform rods by name (kg, m), hinged one to the next on the ground; `of_joints`: keys of each."""
    ends, found = ["ground", *(f"{name}.tip" for name in rods)], []
    for name, (mass, length) in rods.items():
        points = {"root": [0.0, 0.0], "tip": [length, 0.0]}
        rigid = {"mass": mass, "inertia": mass * length**2 / 12, "center": [length / 2, 0.0], "points": points}
        found.append({"name": name, "rigid": rigid})
    between = zip(joints, ends[:-1], rods, strict=True)
    hinges = [revolute(joint, end, f"{name}.root", **dict(of_joints)) for joint, end, name in between]
    return make_scene(**{"name": "arm", "gravity": [0.0, -9.81], "body": found, "joint": hinges} | keys)
