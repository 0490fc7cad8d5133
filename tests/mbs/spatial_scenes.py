"""Scenes in space for tests: those of the checkpoints, and random ones with the joints of a `spatial_trees.Tree`."""

import tomllib
from pathlib import Path

import numpy as np
import scene_of
from spatial_checkpoints import load

from ffrobot.mbs.model.spatial_model import build_spatial_model
from ffrobot.mbs.scene.spatial.mechanism import SpatialMechanismScene
from ffrobot.scene.spatial import spatial_scene

PLACEHOLDER = {"mass": 1.0, "inertia": [1.0, 1.0, 1.0], "center": [0.0, 0.0, 0.0]}  # bodies are passed beside the scene


def checkpoint_scene(name, tolerance=1e-8):
    """The scene of a checkpoint; its links are found in the folder of the checkpoints."""
    text, _ = scene_of.scene(load(name), tolerance)
    text = text.replace('link = "', 'link = "links/')
    return spatial_scene(tomllib.loads(text), Path(scene_of.__file__).with_name("scene.toml"), text)


def rpy(C):
    """Roll, pitch, yaw of C = R_z R_y R_x."""
    return [
        float(np.arctan2(C[2, 1], C[2, 2])),
        float(-np.arcsin(np.clip(C[2, 0], -1, 1))),
        float(np.arctan2(C[1, 0], C[0, 0])),
    ]


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


def tree_model(tree, joints, initial=None, trajectory=()):
    """The model of a scene with these tables of joints, and the bodies of a `Tree`."""
    scene = SpatialMechanismScene(
        name="test",
        space="spatial",
        gravity=(0.4, -1.1, -9.5),
        body=tuple({"name": body.name, "rigid": as_tuples(PLACEHOLDER)} for body in tree.bodies),
        joint=tuple(as_tuples(joint) for joint in joints),
        trajectory=tuple(trajectory),
        initial=as_tuples(initial or {}),
        path=Path("scene.toml"),
        text="",
    )
    return build_spatial_model(scene, tree.bodies)


def as_tuples(value):
    """Strict records take tuples, not lists."""
    if isinstance(value, dict):
        return {key: as_tuples(item) for key, item in value.items()}
    return tuple(as_tuples(item) for item in value) if isinstance(value, list | tuple) else value
