"""What forces on paths do on each body alone, in the core, against the virtual work of constraint equations."""

import numpy as np
import pytest
import tree_oracle
from beam_links import beam_link, rectangle
from tables_3d import Y, Z, joint, revolute, scene
from tree_oracle import Motion, action, motion, pose, value_and_gradient

import ffrobot
from ffrobot.common.rotations import skew
from ffrobot.mbs.model.system import path_forces_on_bodies
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

MODES = {"count": 4, "family": "all", "attachment_modes": False}


def beam(name, condition):
    link = beam_link(0.35, rectangle(0.009, 0.014), 8, condition=condition, name=name, modes=MODES)
    return {"name": name, "link": link}


def arm(trajectories):
    """Links on a revolute, a universal and a prismatic joint; every second joint is named from the outside in."""
    joints = [
        revolute("base", "ground", "b0.root", [0.0, 0.6, 0.8]),
        joint("elbow", "universal", "b1.root", "b0.tip", axis=Z, second_axis=Y),
        joint("slide", "prismatic", "b1.tip", "b2.root", axis=Y),
    ]
    bodies = [beam("b0", "cantilever"), beam("b1", "simply-supported"), beam("b2", "cantilever")]
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01}
    initial = {"joints": {"base": 0.1, "elbow": [0.2, 0.4], "slide": 0.05}}
    tables = scene(bodies, joints, inverse, trajectory=trajectories, initial=initial)
    return prepare_scene(ffrobot.make_scene(**tables), Watcher()).model


PATHS = {
    "points and turns": [
        {"name": "tip", "point": "b2.tip", "x": "t", "y": "1", "z": "0", "rotation_vector": ["t", "0.1", "0"]}
    ],
    "tools": [{"name": "tip", "point": "b2.tip", "x": "t", "tool_axis": [1.0, 0.0, 0.0], "direction": ["1", "t", "0"]}],
    "joints": [{"name": "j", "joint": "base", "value": "t"}, {"name": "s", "joint": "slide", "value": "t"}],
}


def by_its_body(tree, section, q, frames):
    """Motion of a section by what its body does alone: L (T, 6, 6 + n) by velocities along the frame's axes, and ṗ."""
    at, frame, node = motion(tree, section, q, frames), frames[section.body], tree.nodes[section.body]
    to_section, axes = np.tile(np.eye(6), (2, len(q), 1, 1))
    to_section[:, :3, 3:] = -skew(at.r - frame.r)
    axes[:, :3, :3] = axes[:, 3:, 3:] = frame.F
    of_modes = at.L[..., node.p_v] - to_section @ frame.L[..., node.p_v]
    return Motion(at.r, at.F, np.concatenate([to_section @ axes, of_modes], axis=2))


def still(at, columns):
    return Motion(at.r, at.F, np.zeros((len(at.r), 6, columns)))


def gradient(tree, row, a, b, q, times):
    """(T, columns of a and b); along a coordinate, of the outer section against the inner one at the same place."""
    if row.kind != "coordinate":
        return value_and_gradient(tree, row, a, b, q, times)[1]
    node = tree.nodes[row.b.body]
    of_b = b.L - a.L
    of_b[:, :3] += skew(b.r - a.r) @ a.L[:, 3:]
    acting = row.sign * action(node.joint, q[:, node.q])[:, :, row.coordinate - node.v.start]
    F = pose(tree, node.inner, q, tree_oracle.frames(tree, q)).F
    return sum(np.einsum("tij,tj,tik->tk", F, acting[:, of], of_b[:, of]) for of in (slice(3), slice(3, 6)))


@pytest.mark.parametrize("paths", PATHS)
def test_forces_are_those_of_the_virtual_work(paths):
    model, rng = arm(PATHS[paths]), np.random.default_rng(37)
    tree, times = model.tree, np.array([0.0, 0.03, 0.1])
    rest = tree.at_rest({})
    q = np.array([tree.integrate(rest, 0.3 * rng.standard_normal(tree.n_v)) for _ in times])
    multipliers, frames = rng.standard_normal((len(times), len(model.rows))), tree_oracle.frames(tree, q)
    expected = {node.body.name: np.zeros((len(times), 6 + node.body.n_modes)) for node in tree.nodes}
    for row, size in zip(model.rows, -multipliers.T, strict=True):
        for moves in (row.a, row.b):
            if moves.body >= 0:
                of_one = by_its_body(tree, moves, q, frames)
                sides = [
                    of_one if side is moves else still(motion(tree, side, q, frames), of_one.L.shape[2])
                    for side in (row.a, row.b)
                ]
                expected[tree.nodes[moves.body].body.name] += size[:, None] * gradient(tree, row, *sides, q, times)
    found = path_forces_on_bodies(model, times, q, multipliers)
    for body, forces in expected.items():
        np.testing.assert_allclose(found[body], forces, rtol=0, atol=1e-12 * max(np.abs(forces).max(), 1.0))
    touched = {body for body, forces in expected.items() if np.abs(forces).max() > 0.1}
    assert touched == ({"b0", "b1", "b2"} if paths == "joints" else {"b2"})
