"""Planar mechanisms in joint coordinates have the numbers of their systems: every mechanism of the zoo, and others."""

import numpy as np
import pytest
import zoo
from links import ritz_link
from mechanisms import always, assemble, core_run, make_model, relative, revolute

from ffrobot.mbs import _core
from ffrobot.mbs.model.planar_tree import PlanarTree
from ffrobot.mbs.model.tree_layout import NotInTreeError
from ffrobot.mbs.solve.initial_state import undeformed_state

T = 0.0
NOT_IN_TREE = {
    "chain of 1": "a body that is joined to no other",
    "stiffened": "geometric stiffening",
    "stiffened, driven": "geometric stiffening",
    "stiffened, as built": "geometric stiffening",
    "driven, as built": "geometric stiffening",
    "slider-crank, as built": r'friction along a coordinate that is none of the tree \(joint "rail"',
}


def bent_state(assembly, seed=1):
    """q and v at T on all constraints, with modes of any size and rate; a and multipliers there."""
    start, rng = undeformed_state(assembly), np.random.default_rng(seed)
    modal = np.ones(assembly.system.coordinates, dtype=bool)
    modal[assembly.frame_coordinates] = False
    q, v = start.q + 0.05 * rng.standard_normal(len(start.q)) * modal, start.v + rng.standard_normal(len(start.v))
    return core_run(assembly, q, v, [T])


def outputs(tree, q, v):
    return _core.tree_outputs(tree.core, tree.scene, [T], np.concatenate([q, v])[None])


def compare(assembly):
    """Accelerations of frames and modes, multipliers of trajectories and of joints that close loops."""
    expected, tree = bent_state(assembly), PlanarTree(assembly)
    found = outputs(tree, *tree.state(expected.q[0], expected.v[0]))
    a, scale = expected.a[0], np.abs(expected.a).max()
    frames = found.frames.reshape(-1, 6)
    modes = {number: first for number, (_, _, _, first) in zip(tree.bodies, tree.core.first, strict=True)}
    for k, number in enumerate(tree.bodies):
        first, n = assembly.first[number], assembly.model.bodies[number].n_modes
        assert relative(frames[k, [0, 1, 5]], a[first : first + 3], scale) < 1e-11
        if n:
            p = found.accelerations[0, modes[number] : modes[number] + n]
            assert relative(p, a[first + 3 : first + 3 + n], scale) < 1e-11
    rows = [k for k, constraint in enumerate(assembly.constraints) if constraint in tree.constraints]
    if rows:
        multipliers = found.multipliers[0] * tree.row_signs
        assert relative(multipliers, expected.multipliers[0, rows], np.abs(expected.multipliers).max()) < 1e-11
    return tree


@pytest.mark.parametrize("name", [name for name in zoo.ALL if name not in NOT_IN_TREE])
def test_zoo(name):
    compare(assemble(zoo.build(name)))


@pytest.mark.parametrize("name", NOT_IN_TREE)
def test_what_stays_in_absolute_coordinates(name):
    with pytest.raises(NotInTreeError, match=NOT_IN_TREE[name]):
        PlanarTree(assemble(zoo.build(name)))


def test_friction_where_a_loop_is_cut():
    joints = [joint.model_dump(exclude_unset=True) for joint in zoo.build("four-bar").scene.joint]
    joints[3] |= {"viscous_friction": 0.1}
    with pytest.raises(NotInTreeError, match=r'that is none of the tree .joint "j4", angle'):
        PlanarTree(assemble(zoo.four_bar(np.random.default_rng(0), joint=joints)))


@pytest.mark.parametrize("motors", ["section", "frame"])
def test_coordinates_of_frames_and_sections_are_followed(motors):
    """Where links bend those of frames are others, which are rows between frames."""
    path = {"name": "turn", "joint": "j2", "value": "-0.7+0.2*t"}
    model = zoo.chain(np.random.default_rng(3), 2, motors=motors, trajectory=[path])
    tree = compare(assemble(model))
    assert len(tree.constraints) == 1


def driven_four_bar(driven, **keys):
    """A joint between simply supported links, which turn their sections, follows its own angle."""
    crank, coupler, rocker, turn = 0.25, 0.9, 0.75, 1.1
    to_foot = 1.0 - crank * np.exp(1j * turn)
    angle = np.angle(to_foot) + np.arccos((coupler**2 + abs(to_foot) ** 2 - rocker**2) / (2 * coupler * abs(to_foot)))
    head = crank * np.exp(1j * turn) + coupler * np.exp(1j * angle)
    angles = {"b1": turn, "b2": float(angle), "b3": float(np.angle(1.0 - head))}
    joints = [
        revolute("j1", "ground", "b1.root"),
        revolute("j2", "b1.tip", "b2.root"),
        revolute("j3", "b2.tip", "b3.root"),
        revolute("j4", "b3.tip", "ground", at=(1.0, 0.0)),
    ]
    value = {"j1": turn, "j2": angles["b2"] - turn}[driven]
    path = {"name": "turn", "joint": driven, "value": f"{value!r}+0.2*t+t**2"}
    lengths = {"b1": crank, "b2": coupler, "b3": rocker}
    links = [ritz_link(name, "simply-supported", length, 0.5, modes=6) for name, length in lengths.items()]
    return assemble(make_model(links, joint=joints, trajectory=[path], initial={"angles": angles}, **keys))


@pytest.mark.parametrize("driven", ["j1", "j2"])
def test_driven_sections_that_modes_turn(driven):
    compare(driven_four_bar(driven))


def scatter(assembly):
    """Of the multipliers, relative to the largest, where q and v are rounded otherwise."""
    start, tree = undeformed_state(assembly), PlanarTree(assembly)
    state, rng = np.concatenate(tree.state(start.q, start.v)), np.random.default_rng(4)
    shifts = np.finfo(float).eps * rng.integers(-1, 2, (100, len(state)))
    half = len(state) // 2
    found = np.array([outputs(tree, *np.split(state * (1 + shift), [half])).multipliers[0] for shift in shifts])
    return np.ptp(found, axis=0).max() / np.abs(found).max()


@pytest.mark.parametrize("driven", ["j1", "j2"])
def test_rounding_where_a_section_is_driven(driven):
    """It hardly has inertia to turn by: rounding of what it is free to do must not get into the loop (1.4e-15)."""
    assert scatter(driven_four_bar(driven)) < 5e-15


def test_states_there_and_back():
    """Angles count full turns."""
    for name in ("mixed", "mixed backwards", "four-bar", "free-flying", "backwards"):
        assembly = assemble(zoo.build(name))
        expected, tree = bent_state(assembly), PlanarTree(assembly)
        q, v = expected.q[0].copy(), expected.v[0]
        q[assembly.first + 2] += 6 * np.pi
        if name.startswith("mixed") or name == "four-bar":  # prismatic joints and the ground keep angles
            q = expected.q[0]
        start_q, start_v = tree.state(q, v)
        controls = _core.IntegrationControls(
            tolerance=1e-6, max_steps=0, methods=[(_core.MethodKind.dop853, 1.0, 0.0)], spectral_radius=0.8
        )
        run = _core.run_tree(
            system=assembly.system, tree=tree.core, scene=tree.scene, bodies=tree.bodies, drives=tree.drives,
            times=[T], q=start_q, v=start_v, controls=controls, carry_on=always,
        )  # fmt: skip
        np.testing.assert_allclose(run.q[0], q, rtol=0, atol=1e-12)
        np.testing.assert_allclose(run.v[0], v, rtol=0, atol=1e-11)


def test_more_rows_than_the_core_has():
    joints = [revolute("j1", "ground", "b1.root"), revolute("j2", "b1.tip", "b2.root")]
    joints += [revolute(f"g{k}", "b2.tip", "ground", at=(0.1 * k, 0.0)) for k in range(8)]
    model = make_model(zoo.clouds(np.random.default_rng(0), 2), joint=joints)
    with pytest.raises(NotInTreeError, match="16 components of trajectories and loops, more than 15"):
        PlanarTree(assemble(model))
