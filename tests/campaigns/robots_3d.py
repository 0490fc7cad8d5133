"""Random scenes in 3D by seed and number: arms along lines and joint paths, swinging chains, closed loops.

Lengths in m, angles in rad; steel and aluminium beams with bending in two planes, torsion and, at times, axial modes.
"""

import numpy as np
from drawn_robot import DrawnRobot
from scipy.spatial.transform import Rotation

import ffrobot

UP = np.array([0.0, 0.0, 1.0])
ALONG = np.array([1.0, 0.0, 0.0])  # links, in their axes


def random_keys(seed, number):
    """Kind of that number, what is drawn of the robot, and its keys without analyses."""
    kind = list(KINDS)[number % len(KINDS)]
    robot = Robot(np.random.default_rng([seed, number]))
    return kind, robot, KINDS[kind](robot)


def random_scene_in_3d(seed, number, runs, most_steps):
    """Kind and scene of that number, analysed once for each of `runs` (name, tolerance, integrator)."""
    kind, robot, keys = random_keys(seed, number)
    one = {"kind": "pcid" if "trajectory" in keys else "forward", "end": robot.end, "output_step": robot.end / 300}
    one["max_steps"] = most_steps
    analyses = [one | {"name": name, "tolerance": tolerance, "integrator": by} for name, tolerance, by in runs]
    scene = ffrobot.make_scene(
        name=f"robot{number}", space="spatial", gravity=[0.0, 0.0, -9.81], analysis=analyses, **keys
    )
    return kind, scene


class Robot(DrawnRobot):
    """What all kinds have in common."""

    def __init__(self, rng):
        super().__init__(rng, 0.03, 0.15)

    def axis(self):
        """A unit vector of any direction."""
        vector = self.rng.normal(size=3)
        return vector / np.linalg.norm(vector)

    def link(self, name, length):
        """With two to seven modes of all families."""
        table = self.beam(length, 1.5) | {"reference": self.reference()}
        modes = {"count": int(self.rng.integers(2, 8)), "family": "all", "attachment_modes": False}
        return {"name": name, "link": table | {"modes": modes}}

    def serial(self, count):
        """Keys of links one after the other, their joint angles, and where the tip is."""
        names = [f"b{k + 1}" for k in range(count)]
        lengths = [self.between(0.3, 0.7) for _ in names]
        ends = ["ground", *(f"{name}.tip" for name in names)]
        angles = [self.between(0.3, 1.5) * self.rng.choice([-1, 1]) for _ in names]
        # The first axis is upright, those after it cross the links: all can move, and nothing is parallel.
        axes = [UP, *(np.cross(ALONG, self.axis()) for _ in names[1:])]
        axes = [axis / np.linalg.norm(axis) for axis in axes]
        place, turned = np.zeros(3), Rotation.identity()
        for axis, angle, length in zip(axes, angles, lengths, strict=True):
            turned = turned * Rotation.from_rotvec(angle * axis)
            place = place + turned.apply(length * ALONG)
        joints = [
            {"name": f"j{k + 1}", "type": "revolute", "between": [ends[k], f"{name}.root"], "axis": axes[k].tolist()}
            for k, name in enumerate(names)
        ]
        keys = {
            "body": [self.link(name, length) for name, length in zip(names, lengths, strict=True)],
            "joint": joints,
            "initial": {"state": self.start, "joints": {f"j{k + 1}": a for k, a in enumerate(angles)}},
        }
        if self.rng.random() < 0.5:
            keys["payload"] = [{"point": f"{names[-1]}.tip", "mass": self.between(0.05, 0.5)}]
        return keys, angles, place


def arm_along_a_line(robot):
    keys, _, tip = robot.serial(3)
    way = min(robot.reach(), 0.05) * robot.axis()
    line = {name: robot.path(start, change) for name, start, change in zip("xyz", tip, way, strict=True)}
    return keys | {"trajectory": [{"name": "line", "point": "b3.tip", **line}]}


def joints_of_an_arm(robot):
    keys, angles, _ = robot.serial(int(robot.rng.integers(1, 4)))
    ways = [robot.between(-1, 1) * robot.reach() for _ in angles]
    paths = [
        {"name": f"p{k + 1}", "joint": f"j{k + 1}", "value": robot.path(angle, way)}
        for k, (angle, way) in enumerate(zip(angles, ways, strict=True))
    ]
    return keys | {"trajectory": paths}


def swinging_chain(robot):
    """No path: a moment on the first joint and a force at the tip; all joints but the first are of any kind."""
    robot.start = "undeformed"
    keys, *_ = robot.serial(int(robot.rng.integers(2, 4)))
    kinds = robot.rng.choice(["revolute", "spherical", "universal"], size=len(keys["joint"]) - 1)
    for joint, kind in zip(keys["joint"][1:], kinds, strict=True):
        if kind != "revolute":
            del keys["initial"]["joints"][joint["name"]]
            first = np.array(joint.pop("axis"))
            joint["type"] = str(kind)
            if kind == "universal":
                joint |= {"axis": first.tolist(), "second_axis": np.cross(ALONG, first).tolist()}
    omega, moment, force = (robot.between(*limits) for limits in ((10, 60), (0.5, 2), (0.5, 2)))
    tip = f"{keys['body'][-1]['name']}.tip"
    load = [
        {"joint": "j1", "moment": f"{moment!r}*sin({omega!r}*t)"},
        {"point": tip, "x": f"{force!r}*cos({omega!r}*t)", "y": f"{force!r}"},
    ]
    return keys | {"load": load}


def slider_crank(robot):
    """A crank with an inclined axis, a rod between a universal and a spherical joint, a slider off the crank's axis."""
    r = robot.between(0.08, 0.2)
    length, turn, offset = r * robot.between(2.5, 4.0), robot.between(0.3, 2.5), robot.between(-0.3, 0.3) * r
    axis = UP + 0.4 * np.array([robot.between(-1, 1), robot.between(-1, 1), 0.0])
    axis /= np.linalg.norm(axis)
    turned = Rotation.from_rotvec(turn * axis)
    tip = turned.apply(r * ALONG)
    guide = np.array([0.0, offset, 0.5 * offset])
    gap = guide - tip
    slide = -gap[0] + np.sqrt(length**2 - gap[1] ** 2 - gap[2] ** 2)
    rod = (np.array([slide, 0.0, 0.0]) + gap) / length
    thin = {"mass": 0.05, "center": [r / 2, 0.0, 0.0], "inertia": (0.05 * r**2 / 12 * np.diag([0.1, 1, 1])).tolist()}
    crank = {"name": "crank", "rigid": thin | {"points": {"root": [0.0] * 3, "tip": [r, 0.0, 0.0]}}}
    pin = {"mass": robot.between(0.1, 0.5), "center": [0.0] * 3, "inertia": [1e-3] * 3, "points": {"pin": [0.0] * 3}}
    first = turned.inv().apply(rod)  # in the crank's axes, as the universal joint measures it
    angles = [float(np.arctan2(first[1], first[0])), float(-np.arcsin(first[2]))]
    return {
        "body": [crank, robot.link("rod", length), {"name": "slider", "rigid": pin}],
        "joint": [
            {"name": "O", "type": "revolute", "between": ["ground", "crank.root"], "motor": True, "at": [0.0] * 3,
             "axis": axis.tolist()},
            {"name": "A", "type": "universal", "between": ["crank.tip", "rod.root"], "motor": False,
             "axis": [0.0, 0.0, 1.0], "second_axis": [0.0, 1.0, 0.0]},
            {"name": "B", "type": "spherical", "between": ["rod.tip", "slider.pin"], "motor": False},
            {"name": "guide", "type": "prismatic", "between": ["ground", "slider.pin"], "motor": False,
             "at": guide.tolist(), "axis": [1.0, 0.0, 0.0]},
        ],
        "initial": {"state": robot.start, "joints": {"O": turn, "A": angles}},
        "trajectory": [{"name": "turn", "joint": "O", "value": robot.path(turn, min(robot.reach() / r, 3.0))}],
    }  # fmt: skip


KINDS = {
    "arm along a line": arm_along_a_line,
    "joints of an arm": joints_of_an_arm,
    "swinging chain": swinging_chain,
    "slider-crank": slider_crank,
}
