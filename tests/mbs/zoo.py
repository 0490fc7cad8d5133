"""Mechanisms of random bodies with every kind of joint, trajectory and load, on the ground's either side."""

import numpy as np
from material_points import random_cloud
from mechanisms import make_model, revolute
from random_mechanisms import stiffened as with_stiffening

from ffrobot.mbs.model.masses import with_payload

LOADS = (
    {"point": "b1.side", "x": "3*sin(t)+1", "y": "-2*cos(t)", "moment": "0.7"},
    {"joint": "j1", "moment": "1.1*t+0.4"},
)


def clouds(rng, count):
    return [random_cloud(rng, f"b{k}").body() for k in range(1, count + 1)]


def serial_joints(count):
    joints = [revolute("j1", "ground", "b1.root", at=(0.2, -0.1))]
    return joints + [revolute(f"j{k}", f"b{k - 1}.tip", f"b{k}.root") for k in range(2, count + 1)]


def tip_path(body, c=(1.0, 0.5)):
    return {"name": "tip", "point": f"{body}.tip", "x": f"{c[0]}+0.3*t-0.2*t**2", "y": f"{c[1]}-0.4*t+0.5*t**2"}


def serial(count):
    """Revolute joints only, the tip of the last link on a path."""
    angles = {f"b{k}": 1.2 * (-0.6) ** (k - 1) for k in range(1, count + 1)}
    return {"joint": serial_joints(count), "trajectory": [tip_path(f"b{count}")], "initial": {"angles": angles}}


def chain(rng, count, **keys):
    return make_model(clouds(rng, count), **(serial(count) | keys))


def swapped(joints):
    """The same joints named from the outside in: axes ride on the outer bodies, the ground comes second."""
    return [joint | {"between": joint["between"][::-1]} for joint in joints]


MIXED = (
    {"name": "j1", "type": "prismatic", "between": ("ground", "b1.root"), "at": (0.1, 0.0), "axis": (2.0, 1.0)},
    {"name": "w", "type": "weld", "between": ("b1.tip", "b2.root")},
    revolute("j2", "b2.tip", "b3.root"),
    {"name": "j3", "type": "prismatic", "between": ("b3.tip", "b4.root"), "axis": (-1.0, 0.4)},
)


def mixed(rng, **keys):
    """Prismatic to the ground, weld, revolute, prismatic between bodies; a path, a section angle, a way."""
    trajectories = [
        {"name": "way", "joint": "j3", "value": "0.3*sin(2*t)"},
        {"name": "turn", "angle": "b3.side", "value": "0.1+0.2*t"},
        {"name": "lift", "point": "b4.side", "y": "0.6*cos(t)"},
    ]
    initial = {"angles": {"b1": 0.3, "b2": 0.9, "b3": -0.4, "b4": 0.2}}
    return make_model(clouds(rng, 4), **({"joint": MIXED, "trajectory": trajectories, "initial": initial} | keys))


def mixed_backwards(rng, **keys):
    trajectories = [
        {"name": "way", "joint": "j1", "value": "0.3*sin(2*t)"},
        {"name": "frame", "angle": "b3", "value": "0.1+0.2*t"},
        {"name": "turn", "point": "b4.tip", "x": "0.4*t"},
    ]
    return mixed(rng, **({"joint": swapped(MIXED), "trajectory": trajectories} | keys))


def four_bar(rng, **keys):
    """A closed loop of revolute joints that follows an angle of its rocker; the motor sits at the crank."""
    joints = [*serial_joints(3), revolute("j4", "b3.tip", "ground", at=(1.2, 0.1))]
    joints[0]["motor"] = True
    trajectory = [{"name": "rocker", "angle": "b3.side", "value": "-1.4+0.5*t+t**2"}]
    initial = {"angles": {"b1": 1.3, "b2": 0.1, "b3": -1.4}}
    return make_model(clouds(rng, 3), **({"joint": joints, "trajectory": trajectory, "initial": initial} | keys))


def slider_crank(rng, **keys):
    """A closed loop with a slide, driven at the slider; the motor sits at the crank."""
    joints = [
        *serial_joints(2),
        revolute("j3", "b2.tip", "b3.root"),
        {"name": "rail", "type": "prismatic", "between": ("ground", "b3.root"), "axis": (1.0, 0.0)},
    ]
    joints[0]["motor"] = True
    trajectory = [{"name": "slider", "point": "b3.root", "x": "1.6-0.2*sin(3*t)"}]
    initial = {"angles": {"b1": 0.7, "b2": -0.7}}
    return make_model(clouds(rng, 3), **({"joint": joints, "trajectory": trajectory, "initial": initial} | keys))


def tree(rng, **keys):
    """Two arms on one trunk, both followed."""
    joints = [*serial_joints(2), revolute("j3", "b1.side", "b3.root")]
    trajectories = [tip_path("b2"), {"name": "other", "angle": "b3.tip", "value": "t**2"}]
    tables = {"joint": joints, "trajectory": trajectories, "initial": {"angles": {"b1": 1.2, "b2": -0.7}}}
    return make_model(clouds(rng, 3), **(tables | keys))


def loaded(rng, **keys):
    """Forces and moments on a point, a joint moment, and a payload."""
    bodies = clouds(rng, 2)
    bodies[1] = with_payload(bodies[1], "tip", 0.6, np.zeros(3), np.diag([0.0, 0.0, 0.02]))
    tables = serial(2) | {"load": LOADS, "initial": {"angles": {"b1": 1.2, "b2": -0.7}}}
    return make_model(bodies, **(tables | keys))


def stiffened(rng, **keys):
    """A chain of three bodies whose modes stiffen under every kind of load, with a payload and loads."""
    bodies = [with_stiffening(rng, body) for body in clouds(rng, 3)]
    bodies[1] = with_payload(bodies[1], "tip", 0.6, np.zeros(3), np.diag([0.0, 0.0, 0.02]))
    return make_model(bodies, **(serial(3) | {"load": LOADS} | keys))


def stiffened_and_driven(rng, **keys):
    """The same with as many trajectories as degrees of freedom."""
    turn = {"name": "turn", "angle": "b3", "value": "0.4+0.2*t"}
    return stiffened(rng, **({"trajectory": [tip_path("b3"), turn]} | keys))


def built(joints):
    """Joints with rotors and friction, each with its own."""
    return [
        joint
        if joint["type"] == "weld"
        else joint
        | {"gear_ratio": 3.0 + k, "rotor_inertia": 0.02 * (k + 1)}
        | {"viscous_friction": 0.3 * k, "coulomb_friction": 0.4, "friction_speed": 0.5}
        for k, joint in enumerate(joints)
    ]


def as_built(mechanism):
    """`mechanism` with its joints as built."""

    def build(rng, **keys):
        bare = mechanism(np.random.default_rng(0))
        return mechanism(rng, **({"joint": built(bare.tables["joint"])} | keys))

    return build


def free_flying(rng, **keys):
    """Two bodies that nothing holds, one joint between them."""
    return make_model(clouds(rng, 2), joint=[revolute("j1", "b1.tip", "b2.root")], **keys)


ALL = {
    **{f"chain of {count}": lambda rng, count=count, **keys: chain(rng, count, **keys) for count in (1, 2, 3, 24)},
    "mixed": mixed,
    "mixed backwards": mixed_backwards,
    "four-bar": four_bar,
    "slider-crank": slider_crank,
    "tree": tree,
    "loaded": loaded,
    "loaded, frame motors": lambda rng, **keys: loaded(rng, motors="frame", **keys),
    "stiffened": stiffened,
    "stiffened, driven": stiffened_and_driven,
    "free-flying": free_flying,
    "mixed, as built": as_built(mixed),
    "slider-crank, as built": as_built(slider_crank),
    "driven, as built": as_built(stiffened_and_driven),
    "driven, as built, frame motors": lambda rng, **keys: as_built(stiffened_and_driven)(rng, motors="frame", **keys),
}


def build(name, **keys):
    return ALL[name](np.random.default_rng(sum(name.encode())), **keys)
