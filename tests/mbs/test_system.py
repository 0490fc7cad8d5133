"""The recursion, as scenes in 3D make it, against the oracle in absolute coordinates: random trees, all joints."""

import numpy as np
import pytest
from body_equations import Accelerated, absolute_accelerations, absolute_states
from checkpoint_scenes import as_scene, coordinates, tree_model
from random_mechanisms import TYPES, placed, random_tree
from triad_measures import UNIT, About, Along, Ground, Section, Spinning

from ffrobot.mbs import _core
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.joints.joint import Friction
from ffrobot.mbs.model.known_motion import required_forces
from ffrobot.mbs.model.system import MultibodySystem

SMALL = 0.01  # modal coordinates: sections turn by about 0.1 rad


AT = 0.4  # s


def systems(tree, turned=False, joint_keys=None, loads=(), acting=lambda plain: {}):
    """V̇ of all bodies by the scene's core and by the oracle, in a state with random velocities; its size; energies.

    `turned`: joints named from the outside in; `joint_keys`: further keys by joint; `acting`: what the oracle has
    besides, by the keys of its `Mechanism`.
    """
    plain, tables = as_scene(tree, turned)
    tables = [table | (joint_keys or {}).get(table["name"], {}) for table in tables]
    model = tree_model(plain, tables, load=loads)
    mechanism = plain.mechanism(**acting(plain))
    system = MultibodySystem(model)
    q = model.tree.at_rest(coordinates(model, plain, turned))
    bent = {body.name: mechanism.coordinates.parts(tree.q, body.name)[2] for body in tree.bodies}
    for node in model.tree.nodes:
        q[node.p_q] = bent[node.body.name]
    absolute = placed(plain, list(bent.values()))
    v = np.random.default_rng(0).standard_normal(model.tree.n_v)
    found = _core.tree_outputs(system.core, system.scene, [AT], np.concatenate([q, v])[None])
    state = Accelerated(model.tree, q[None], v[None], found.accelerations, model.tree.frames(q[None]))
    ((_, _, velocity, _),) = absolute_states(mechanism, state)
    pair = absolute_accelerations(mechanism, state)[0], mechanism.solve(AT, absolute, velocity)[0]
    left = required_forces(model, state, np.array([AT]))  # nothing, where nothing is prescribed
    moved = required_forces(model, state._replace(a=np.zeros_like(state.a)), np.array([AT]))
    assert np.abs(left).max(initial=0) < 1e-10 * np.abs(moved).max(initial=1)
    energies = system.core.states_totals(system.scene, q[None], v[None])[0, :3]
    return pair, np.abs(state.a).max(initial=1.0), (energies, mechanism.energies(absolute, velocity))


def assert_same(pair, scale, close=1e-11):
    """Accelerations of modes and of the frames, `close` to each other against the largest along the tree."""
    np.testing.assert_allclose(*pair, rtol=0, atol=close * scale)


@pytest.mark.parametrize("joint", TYPES)
def test_modes_accelerate_as_the_oracle_says(joint):
    kinds = ("rigid", "beam") if joint == "free" else ("rigid", "solid", "beam", "supported beam")
    rng = np.random.default_rng(TYPES.index(joint))
    for _ in range(6):
        pair, scale, _ = systems(random_tree(rng, [joint] * 2, kinds, chain=True, size=SMALL))
        assert_same(pair, scale)


STIFFENED = ("stiffened solid", "stiffened beam", "stiffened supported beam")


@pytest.mark.parametrize("seed", range(5))
def test_trees_of_stiffened_bodies(seed):
    """Beside plain and rigid ones."""
    rng = np.random.default_rng(seed)
    types = [joint for joint in TYPES if joint != "free"]
    chosen = [types[k] for k in rng.integers(len(types), size=4)]
    tree = random_tree(rng, chosen, ("rigid", "solid", *STIFFENED), size=SMALL)
    pair, scale, (energies, expected) = systems(tree)
    np.testing.assert_allclose(energies, expected, rtol=1e-11)
    assert_same(pair, scale)


def test_forces_and_moments_at_points_over_time():
    """Along global axes, two loads on one section, where modes move and turn it."""
    rng = np.random.default_rng(11)
    texts = {"x": "3*sin(2*t)", "z": "1-t", "mx": "0.7", "my": "t**2", "mz": "-0.4*cos(t)"}
    loads = [
        {"point": "b2.tip"} | {key: parse_expression(text) for key, text in texts.items()},
        {"point": "b2.tip", "y": parse_expression("5*t")},
        {"point": "b1.side", "y": parse_expression("-2")},
    ]

    def acting(plain):
        found = []
        for load in loads:
            section = Section(*load["point"].split("."))
            for key, size in load.items():
                if key != "point":
                    kind = About if key.startswith("m") else Along
                    row = kind(Ground(), section, UNIT["xyz".index(key[-1])])
                    found.append((row, lambda t, size=size: size(t)[0]))
        return {"loads": found}

    for kinds in (("solid",), ("beam",), ("supported beam",), ("rigid",)):
        tree = random_tree(rng, ["revolute", "spherical"], kinds, chain=True, size=SMALL)
        pair, scale, _ = systems(tree, loads=loads, acting=acting)
        assert_same(pair, scale, 1e-10)  # moments on light beams: accelerations of 5000 1/s²


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("joint", ["revolute", "prismatic", "screw", "cylindrical", "universal"])
def test_friction_along_coordinates(joint, turned):
    rng = np.random.default_rng(TYPES.index(joint))
    keys = {"viscous_friction": 0.7, "coulomb_friction": 0.3, "friction_speed": 0.2}

    def acting(plain):
        rows = [row for of_one in plain.joints for row in of_one.coordinates()]
        return {"frictions": [(row, Friction(0.7, 0.3, 0.2)) for row in rows]}

    for _ in range(3):
        tree = random_tree(rng, [joint] * 2, ("rigid", "beam", "solid"), chain=True, size=SMALL)
        pair, scale, _ = systems(tree, turned, {"j1": keys, "j2": keys}, acting=acting)
        assert_same(pair, scale)


@pytest.mark.parametrize("turned", [False, True])
def test_geared_rotors(turned):
    """On a chain of three that turns in all directions: their angular momentum turns with the body they sit on."""
    rng = np.random.default_rng(3)
    keys = {"rotor_inertia": 0.02, "gear_ratio": 7.0}

    def acting(plain):
        sides = [(joint.b, joint.a) if turned else (joint.a, joint.b) for joint in plain.joints]
        return {"rotors": [(Spinning(*of_one, 7.0), 0.02) for of_one in sides]}

    for kinds in (("rigid",), ("beam",), ("solid",), ("supported beam",)):
        tree = random_tree(rng, ["revolute"] * 3, kinds, chain=True, size=SMALL)
        pair, scale, (energies, expected) = systems(
            tree, turned, dict.fromkeys(("j1", "j2", "j3"), keys), acting=acting
        )
        assert_same(pair, scale)
        assert energies[0] == pytest.approx(expected[0], rel=1e-12)


@pytest.mark.parametrize("kind", ["beam", "solid", "supported beam"])
def test_free_joint_at_a_section_that_modes_turn(kind):
    """Its coordinates are those of the section."""
    tree = random_tree(np.random.default_rng(0), ["free", "revolute"], (kind,), chain=True, size=SMALL)
    pair, scale, _ = systems(tree)
    assert_same(pair, scale)
