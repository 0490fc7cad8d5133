"""Random closed chains in 3D with friction and loads along all joints, cut at the one that a scene lists last."""

from dataclasses import dataclass

import numpy as np
import tree_oracle
from checkpoint_scenes import as_scene, coordinates, rpy, tree_model
from moving_trees import state_of
from random_mechanisms import Tree, random_tree

from ffrobot.mbs import _core
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.scene.loads import Load

FRICTION = {"viscous_friction": 0.4, "coulomb_friction": 0.7, "friction_speed": 0.3}
ROTOR = {"rotor_inertia": 3e-3, "gear_ratio": 4.0}
COUNT = {"revolute": 1, "prismatic": 1, "cylindrical": 2, "universal": 2, "planar": 3}
NOW = 0.3


@dataclass
class ClosedChain:
    """Tables of its joints, the last one from the ground to the last body, and a state that closes it.

    Attributes:
        tree: bodies, and the joints but the last.
        tables: of all joints, by name.
        joints: their coordinates by name.
        p: modal coordinates by body.
    """

    tree: Tree
    tables: dict
    joints: dict
    p: dict

    def model(self, cut):
        """Cut at a joint, by name."""
        order = [*(name for name in self.tables if name != cut), cut]
        loads = [Load(joint=name, moment=_moments(table["type"])) for name, table in self.tables.items()]
        initial = {"joints": {name: values.tolist() for name, values in self.joints.items()}}
        model = tree_model(self.tree, [self.tables[name] for name in order], initial, load=loads)
        assert [joint.name for joint in model.tree.loops] == [cut]
        return model

    def position(self, model):
        """The state's q for a model of it."""
        q = model.tree.at_rest(self.joints)
        for node in model.tree.nodes:
            q[node.p_q] = self.p.get(node.body.name, ())  # none of outputs of rotors
        return q


def closed_chain(rng, types, kinds, size=0.01, rotors=False):
    """Bodies b1, b2, … on joints j1, j2, … of `types`, the last of which stands on the ground at coordinate 0.

    With `rotors` all joints have one.
    """
    tree = random_tree(rng, types[:-1], kinds, chain=True, size=size)
    plain, tables = as_scene(tree, False)
    model = tree_model(plain, tables)
    joints = coordinates(model, plain, False)
    q = model.tree.at_rest(joints)
    for node in model.tree.nodes:
        q[node.p_q] = tree.p[node.body.name]
    end = f"b{len(tree.bodies)}.tip"
    tip = tree_oracle.motion(
        model.tree, model.tree.section(end, np.eye(3)), q[None], tree_oracle.frames(model.tree, q[None])
    )
    name, type_, axis = f"j{len(types)}", types[-1], rng.standard_normal(3)
    R = tip.F[0]
    last = {"name": name, "type": type_, "between": ("ground", end), "at": tip.r[0].tolist(), "rpy": rpy(R)}
    last["axis"] = axis.tolist()
    if type_ == "universal":
        last["second_axis"] = (R.T @ np.cross(axis, rng.standard_normal(3))).tolist()
    found = {table["name"]: table | FRICTION | (ROTOR if rotors else {}) for table in (*tables, last)}
    return ClosedChain(plain, found, {**joints, name: np.zeros(COUNT[type_])}, tree.p)


def _moments(type_):
    sizes = [f"{k}.5 + {k}*t" for k in range(1, COUNT[type_] + 1)]
    return sizes[0] if len(sizes) == 1 else tuple(sizes)


def evaluated(model, q, v):
    """The motion of one instant at q, v, as the core finds it under friction and loads."""
    system = MultibodySystem(model)
    run = _core.tree_outputs(system.core, system.scene, [NOW], np.concatenate([q, v])[None])
    multipliers = run.multipliers * system.model.row_signs
    return state_of(model, np.array([NOW]), q[None], v[None], run.accelerations, multipliers)
