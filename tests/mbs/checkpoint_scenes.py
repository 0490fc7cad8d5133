"""Scenes in 3D for tests: those of the checkpoints, and random ones with the joints of a `random_mechanisms.Tree`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from checkpoint_mechanisms import FOLDER
from random_mechanisms import Tree
from rotations import logarithm
from scipy.spatial.transform import Rotation

from ffrobot.mbs import _core
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.drives import Command, Drives, Replayed
from ffrobot.mbs.scene.mechanism import MechanismScene
from ffrobot.scene.load import load_scene

UNDIRECTED = ("spherical", "weld", "free")
PLACEHOLDER = {"mass": 1.0, "inertia": [1.0, 1.0, 1.0], "center": [0.0, 0.0, 0.0]}  # bodies are passed beside the scene


def checkpoint_scene(name):
    return load_scene(FOLDER / f"{name}.toml")


def rpy(C):
    """Roll, pitch, yaw of C = R_z R_y R_x."""
    return Rotation.from_matrix(C).as_euler("xyz").tolist()


def joint_table(joint, turned):
    """The keys of a joint of the oracle, by its triads; `turned`: its sides named from the outside in."""

    def side(at):
        return "ground" if at.body is None else f"{at.body}.{at.point}"

    ends = (joint.b, joint.a) if turned else (joint.a, joint.b)
    first, second = (end.triad for end in ends)
    keys = {
        "name": joint.name,
        "type": joint.type,
        "between": tuple(side(end) for end in ends),
        "rpy": rpy(first @ second.T),
    }
    ground = next((end for end in ends if end.body is None), None)
    if ground is not None:
        keys["at"] = ground.position.tolist()
    if joint.type == "universal":
        x, y = (1, 0) if turned else (0, 1)
        keys |= {"axis": first[:, x].tolist(), "second_axis": second[:, y].tolist()}
    elif joint.type not in ("spherical", "weld", "free"):
        keys["axis"] = first[:, 2].tolist()
    if joint.type == "screw":
        keys["lead"] = 2 * np.pi * joint.h
    return keys


def tree_model(tree, joints, initial=None, trajectory=(), load=()):
    """The model of a scene with these tables of joints, and the bodies of a `Tree`."""
    scene = MechanismScene(
        name="test",
        space="spatial",
        gravity=(0.4, -1.1, -9.5),
        body=tuple({"name": body.name, "rigid": as_tuples(PLACEHOLDER)} for body in tree.bodies),
        joint=tuple(as_tuples(joint) for joint in joints),
        trajectory=tuple(trajectory),
        load=tuple(load),
        initial=as_tuples(initial or {}),
        path=Path("scene.toml"),
        text="",
    )
    return build_model(scene, tree.bodies)


def as_tuples(value):
    """Strict records take tuples, not lists."""
    if isinstance(value, dict):
        return {key: as_tuples(item) for key, item in value.items()}
    return tuple(as_tuples(item) for item in value) if isinstance(value, list | tuple) else value


def as_scene(tree, turned):
    """The tree with triads that a scene can say: without an axis they are the axes of the first side."""
    joints = [_along_the_first(joint, turned) if joint.type in UNDIRECTED else joint for joint in tree.joints]
    plain = Tree(tree.bodies, joints, tree.loops, tree.poses, tree.p)
    tables = [joint_table(joint, turned) for joint in (*joints, *tree.loops)]
    return plain, tables


def _along_the_first(joint, turned):
    a, b = joint.a.triad, joint.b.triad
    if turned:
        return replace(joint, a=replace(joint.a, triad=a @ b.T), b=replace(joint.b, triad=np.eye(3)))
    return replace(joint, a=replace(joint.a, triad=np.eye(3)), b=replace(joint.b, triad=b @ a.T))


def coordinates(model, tree, turned):
    """By joint, in the order of the sides that the scene has."""
    found = {}
    joints = {joint.name: joint for joint in (*tree.joints, *tree.loops)}
    for node in model.tree.nodes:
        joint, record, pose = joints[node.joint.name], node.joint, tree.poses[node.joint.name]
        numbers = pose.coordinates
        if joint.type in ("spherical", "free"):
            numbers = np.concatenate([pose.d, logarithm(pose.C)])[-len(record.guess_units) :]
        elif record.axes[:2] == (0, 1):  # the smallest turn chooses x and y
            turn = node.inner.triad[:, :2].T @ joint.a.triad[:, :2]
            numbers = np.concatenate([turn @ numbers[:2], numbers[2:]])
        found[joint.name] = record.turned_around(numbers) if turned else numbers
    return found


def motor_on_frames(model, body, size):
    """`Drives` with a moment `size`(t) on the frames at the joint that carries a body."""
    direction = np.zeros(model.tree.n_v)
    direction[model.tree.nodes[body].v] = 1.0
    return Drives(replayed=Replayed(_core.ForcesOfTime([size]), (Command(direction, (body, 1.0)),)))
