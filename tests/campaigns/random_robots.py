"""Random scenes of flexible arms, chains and closed loops by seed and number; lengths in m, angles in rad."""

import numpy as np
from drawn_robot import DrawnRobot

import ffrobot

PATCHES = {"length": 0.05, "width": 0.015, "thickness": 5e-4, "modulus": 63e9, "d31": 1.1e-10}


def random_scene(seed, number):
    """Kind and scene of that number: the kinds take turns."""
    kind = list(KINDS)[number % len(KINDS)]
    robot = Robot(np.random.default_rng([seed, number]))
    keys = KINDS[kind](robot)
    return kind, ffrobot.make_scene(name=f"robot{number}", **keys, **robot.common("trajectory" in keys))


class Robot(DrawnRobot):
    """What all kinds have in common."""

    def __init__(self, rng):
        super().__init__(rng, 0.1, 0.5)
        self.modes, self.widths = {}, {}  # of each link

    def common(self, follows_path):
        """Keys of the scene that do not depend on its kind."""
        last, count = list(self.modes.items())[-1]
        patches = follows_path and self.rng.random() < 0.5
        width = min(PATCHES["width"], self.widths[last])
        step = self.end / int(self.rng.integers(100, 600))
        kind = "pcid" if follows_path else "forward"
        return {
            "gravity": [0.0, -9.81],
            "pzt": [{"body": last, "count": count, **PATCHES, "width": width}] if patches else [],
            "analysis": [{"name": "a", "kind": kind, "end": self.end, "output_step": step}],
        }

    def link(self, name, length):
        """With one to five modes in the plane."""
        table = self.beam(length, 2.0)
        section = table["geometry"]["section"]
        self.widths[name] = section.get("width", PATCHES["width"])
        self.modes[name] = int(self.rng.integers(1, 6))
        modes = {"count": self.modes[name], "family": "in-plane-bending", "attachment_modes": False}
        return {"name": name, "link": table | {"reference": self.reference(), "modes": modes}}

    def serial(self, count):
        """Keys of links hinged one to the next, the first to the ground; their turns, angles, and where the tip is."""
        lengths = {f"b{k + 1}": self.between(0.4, 1.0) for k in range(count)}
        bodies = [self.link(name, length) for name, length in lengths.items()]
        ends = ["ground", *(f"{name}.tip" for name in lengths)]
        turns = [self.between(-1.5, 0.5), *(self.between(0.6, 1.6) * self.rng.choice([-1, 1]) for _ in bodies[1:])]
        angles = np.cumsum(turns)
        tip = np.array(list(lengths.values())) @ np.column_stack([np.cos(angles), np.sin(angles)])
        keys = {
            "body": bodies,
            "joint": [revolute(f"j{k + 1}", ends[k], f"{name}.root") for k, name in enumerate(lengths)],
            "initial": {"state": self.start, "angles": dict(zip(lengths, angles.tolist(), strict=True))},
        }
        if self.rng.random() < 0.5:
            keys["payload"] = [{"point": f"b{count}.tip", "mass": self.between(0.05, 0.5)}]
        return keys, turns, angles, tip, sum(lengths.values())

    def tip_path(self, body, tip, size):
        way, turn = min(self.reach(), 0.08 * size), self.between(0, 2 * np.pi)
        x, y = self.path(tip[0], way * np.cos(turn)), self.path(tip[1], way * np.sin(turn))
        return {"name": "tip", "point": f"{body}.tip", "x": x, "y": y}

    def turn(self, angle, radius):
        """The path of a crank."""
        return {"name": "turn", "joint": "O", "value": self.path(angle, min(self.reach() / radius, 12.0))}


def revolute(name, first, second, **keys):
    return {"name": name, "type": "revolute", "between": [first, second], **keys}


def two_link_arm(robot):
    keys, _, _, tip, size = robot.serial(2)
    return keys | {"trajectory": [robot.tip_path("b2", tip, size)]}


def three_link_arm(robot):
    keys, _, angles, tip, size = robot.serial(3)
    hand = {"name": "hand", "angle": "b3", "value": robot.path(angles[-1], 0.3 * robot.reach() / size)}
    return keys | {"trajectory": [robot.tip_path("b3", tip, size), hand]}


def joints_of_an_arm(robot):
    keys, turns, _, _, size = robot.serial(int(robot.rng.integers(2, 4)))
    ways = [robot.between(-1, 1) * robot.reach() / size for _ in turns]
    paths = [
        {"name": f"p{k}", "joint": f"j{k + 1}", "value": robot.path(turn, way)}
        for k, (turn, way) in enumerate(zip(turns, ways, strict=True))
    ]
    return keys | {"trajectory": paths}


def hanging_chain(robot):
    """No path: loads on the first joint and at the tip swing it."""
    robot.start = "undeformed"
    keys, *_ = robot.serial(int(robot.rng.integers(2, 4)))
    omega, moment, force = (robot.between(*limits) for limits in ((10, 60), (1, 5), (1, 5)))
    moment_of_time = f"{moment!r}*sin({omega!r}*t)" if robot.shape == "quintic" else f"{moment!r}"
    tip = f"{keys['body'][-1]['name']}.tip"
    return keys | {
        "load": [{"joint": "j1", "moment": moment_of_time}, {"point": tip, "x": f"{force!r}*cos({omega!r}*t)"}]
    }


def slider_crank(robot):
    r = robot.between(0.1, 0.25)
    length, turn = r * robot.between(2.0, 4.0), robot.between(0.3, 2.5)
    pin = {"mass": robot.between(0.1, 0.5), "inertia": 1e-3, "center": [0.0, 0.0], "points": {"pin": [0.0, 0.0]}}
    rigid = {"mass": 0.05, "inertia": 0.05 * r**2 / 12, "center": [r / 2, 0.0]}
    rigid["points"] = {"root": [0.0, 0.0], "tip": [r, 0.0]}
    crank = robot.link("crank", r) if robot.rng.random() < 0.5 else {"name": "crank", "rigid": rigid}
    angles = {"crank": turn, "rod": float(-np.arcsin(r * np.sin(turn) / length))}
    return {
        "body": [crank, robot.link("rod", length), {"name": "slider", "rigid": pin}],
        "joint": [
            revolute("O", "ground", "crank.root", motor=True),
            revolute("A", "crank.tip", "rod.root"),
            revolute("B", "rod.tip", "slider.pin"),
            {"name": "guide", "type": "prismatic", "between": ["ground", "slider.pin"], "axis": [1.0, 0.0]},
        ],
        "initial": {"state": robot.start, "angles": angles},
        "trajectory": [robot.turn(turn, r)],
    }


def four_bar(robot):
    size = robot.between(0.5, 1.0)
    crank, coupler, rocker = size * robot.between(0.2, 0.3), size * robot.between(0.8, 1.0), 0.75 * size
    turn = robot.between(0.5, 2.5)
    A = crank * np.array([np.cos(turn), np.sin(turn)])
    to_C = np.array([size, 0.0]) - A
    d = np.hypot(*to_C)
    angle = np.arctan2(to_C[1], to_C[0]) + np.arccos((coupler**2 + d**2 - rocker**2) / (2 * coupler * d))
    B = A + coupler * np.array([np.cos(angle), np.sin(angle)])
    angles = {"crank": turn, "coupler": float(angle), "rocker": float(np.arctan2(B[1], B[0] - size))}
    return {
        "body": [robot.link("crank", crank), robot.link("coupler", coupler), robot.link("rocker", rocker)],
        "joint": [
            revolute("O", "ground", "crank.root", motor=True),
            revolute("A", "crank.tip", "coupler.root"),
            revolute("B", "coupler.tip", "rocker.tip"),
            revolute("C", "ground", "rocker.root", at=[size, 0.0]),
        ],
        "initial": {"state": robot.start, "angles": angles},
        "trajectory": [robot.turn(turn, crank)],
    }


KINDS = {
    "two-link arm": two_link_arm,
    "three-link arm": three_link_arm,
    "joints of an arm": joints_of_an_arm,
    "hanging chain": hanging_chain,
    "slider-crank": slider_crank,
    "four-bar": four_bar,
}
