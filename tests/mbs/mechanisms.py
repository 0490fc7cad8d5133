"""Planar robots written in Python, of bodies of their own: as models, and as the oracle has them."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from bodies_by_invariants import in_plane
from marker_measures import (
    Kind,
    Marker,
    Measure,
    coordinate,
    friction,
    joint_constraints,
    marker_at,
    path_measures,
    rotor,
)
from oracle import Mechanism

from ffrobot.mbs import _core
from ffrobot.mbs._core import TimeFunction
from ffrobot.mbs.analysis.forward import Forward
from ffrobot.mbs.analysis.pcid import Pcid
from ffrobot.mbs.model.drives import Drive
from ffrobot.mbs.model.model import Model, build_model
from ffrobot.mbs.model.projection import projected
from ffrobot.scene.load import make_scene

PLACEHOLDER = {"mass": 1.0, "inertia": 1.0, "center": (0.0, 0.0)}  # the bodies themselves are passed beside the scene
ZERO = _core.TimeFunction.constant(0.0)


@dataclass(frozen=True)
class Constraint:
    """A measure that is held at `target`(t): `component` of the joint or trajectory `owner`."""

    measure: Measure
    target: TimeFunction
    owner: str
    component: str
    is_trajectory: bool


@dataclass(frozen=True)
class ModalLoad:
    """Modal forces `vector` (n,), N/√kg, times `magnitude`(t) on one body."""

    body: str
    vector: np.ndarray
    magnitude: TimeFunction


@dataclass(frozen=True)
class Robot:
    """A scene with `Body`s of its own: the model; and bodies and rows as the oracle has them."""

    scene: object
    own: tuple
    modal_loads: tuple = ()
    tables: object = None  # keys of the scene

    @cached_property
    def bodies(self):
        return tuple(map(in_plane, self.own))

    def body(self, name):
        return next(body for body in self.bodies if body.name == name)

    @cached_property
    def model(self) -> Model:
        model = build_model(self.scene, self.own)
        return replace(model, modal_loads=tuple(_drive(model, load) for load in self.modal_loads))

    @property
    def joints(self):
        return [
            Constraint(row, ZERO, joint.name, row.kind.name, is_trajectory=False)
            for joint in self.scene.joint
            for row in joint_constraints(joint)
        ]

    @property
    def trajectories(self):
        joints = {joint.name: joint for joint in self.scene.joint}
        return [
            Constraint(row, path.components[component], path.name, component, is_trajectory=True)
            for path in self.scene.trajectory
            for component, row in path_measures(path, self.scene.motors, joints).items()
        ]

    @property
    def motors(self):
        return {joint.name: coordinate(joint, self.scene.motors) for joint in self.scene.motor_joints}

    @property
    def rotors(self):
        return [rotor(joint, self.scene.motors) for joint in self.scene.joint if getattr(joint, "rotor_inertia", 0.0)]

    @property
    def frictions(self):
        return [
            (coordinate(joint, self.scene.motors), found)
            for joint in self.scene.joint
            if (found := friction(joint)) is not None
        ]

    @property
    def loads(self):
        joints = {joint.name: joint for joint in self.scene.joint}
        found = []
        for load in self.scene.load:
            if load.joint is not None:
                found += [(coordinate(joints[load.joint], self.scene.motors), size) for size in load.moments]
            else:
                at = path_like(load.point)
                found += [(at[component], size) for component, size in load.components.items()]
        return found

    @property
    def state_forces(self):
        return [(marker_at(load.point), load.force) for load in self.scene.load if load.force is not None]


def path_like(point):
    """What forces and moments on a point act along, by component."""
    kinds, at = {"x": Kind.x, "y": Kind.y, "mz": Kind.angle}, marker_at(point)
    return {name: Measure(f"{point}, {name}", kind, Marker(None), at) for name, kind in kinds.items()}


def _drive(model, load):
    direction = np.zeros(model.tree.n_v)
    node = model.tree.nodes[model.tree.index[load.body]]
    direction[node.p_v] = load.vector
    return Drive(direction, load.magnitude)


class Assembly:
    """A robot under some constraints, in absolute coordinates (R, θ, p) of one body after the other."""

    def __init__(self, robot, constraints):
        self.model, self.constraints = robot, list(constraints)
        sizes = [3 + body.n_modes for body in robot.bodies]
        self.first = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(int)
        self.index = {body.name: k for k, body in enumerate(robot.bodies)}
        self.size = sum(sizes)
        self.is_trajectory = [constraint.is_trajectory for constraint in self.constraints]

    @property
    def frame_coordinates(self):
        return np.concatenate([np.arange(first, first + 3) for first in self.first])


def make_model(bodies, modal_loads=(), **keys):
    """A robot of `bodies`; `keys` are those of a scene file."""
    tables = {"name": "test", "gravity": (0.0, -9.81), "analysis": [{"name": "rest", "kind": "static"}]} | keys
    tables["body"] = [
        {"name": body.name, "rigid": PLACEHOLDER | {"points": {name: (0.0, 0.0) for name in body.points}}}
        for body in bodies
    ]
    return Robot(make_scene(**tables), tuple(map(projected, bodies)), tuple(modal_loads), tables)


def checked_scene(joints, bodies=("a",)):
    """The scene of rigid bodies with these joints, checked as one in a file is."""
    rigid = PLACEHOLDER | {"points": {"root": (0.0, 0.0), "tip": (1.0, 0.0)}}
    return make_scene(
        name="test",
        gravity=(0.0, -9.81),
        body=[{"name": name, "rigid": rigid} for name in bodies],
        joint=joints,
        analysis=[{"name": "rest", "kind": "static"}],
    )


def pcid(name="inverse", end=1.0, output_step=0.01, **keys):
    return Pcid(name=name, kind="pcid", end=end, output_step=output_step, **keys)


def forward(name="forward", end=1.0, output_step=0.01, **keys):
    return Forward(name=name, kind="forward", end=end, output_step=output_step, **keys)


def revolute(name, first, second, **keys):
    return {"name": name, "type": "revolute", "between": (first, second), **keys}


def assemble(robot):
    """All joints and trajectories of the robot."""
    return Assembly(robot, [*robot.joints, *robot.trajectories])


def random_state(rng, size, modal=0.1):
    """Any q and v: positions and angles of order one, `modal` times as much in all of q."""
    return modal * rng.standard_normal(size) + 0.5, rng.standard_normal(size)


def always(_):
    """The progress of runs that nobody watches."""
    return True


def relative(got, expected, scale=None):
    """Largest difference relative to the largest expected value."""
    return np.abs(got - expected).max() / (np.abs(expected).max() if scale is None else scale)


def oracle_of(assembly):
    """The oracle's mechanism with the same bodies and rows, in the same order."""
    robot = assembly.model
    return Mechanism(
        robot.bodies,
        robot.scene.gravity[:2],
        [(constraint.measure, constraint.target) for constraint in assembly.constraints],
        robot.loads,
        [(load.body, load.vector, load.magnitude) for load in robot.modal_loads],
        robot.rotors,
        robot.frictions,
        robot.state_forces,
    )
