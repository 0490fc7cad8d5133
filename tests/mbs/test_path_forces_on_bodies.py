"""What forces on paths do on each body alone, in the core, against the wrenches of constraint equations in NumPy."""

import numpy as np
import pytest
import tree_oracle
from beam_links import beam_link, rectangle
from row_wrenches import on_body, row_wrenches
from tables_3d import Y, Z, joint, revolute, scene

import ffrobot
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


@pytest.mark.parametrize("paths", PATHS)
def test_forces_are_those_of_the_wrenches(paths):
    model, rng = arm(PATHS[paths]), np.random.default_rng(37)
    tree, times = model.tree, np.array([0.0, 0.03, 0.1])
    rest = tree.at_rest({})
    q = np.array([tree.integrate(rest, 0.3 * rng.standard_normal(tree.n_v)) for _ in times])
    multipliers, frames = rng.standard_normal((len(times), len(model.rows))), tree_oracle.frames(tree, q)
    expected = {node.body.name: np.zeros((len(times), 6 + node.body.n_modes)) for node in tree.nodes}
    for row, size in zip(model.rows, -multipliers.T, strict=True):
        sides = row_wrenches(tree, row, size, q, times, frames)
        for section, wrench in zip((row.a, row.b), sides, strict=True):
            if section.body >= 0:
                expected[tree.nodes[section.body].body.name] += on_body(model, q, frames, section, wrench)
    found = path_forces_on_bodies(model, times, q, multipliers)
    for body, forces in expected.items():
        np.testing.assert_allclose(found[body], forces, rtol=0, atol=1e-12 * max(np.abs(forces).max(), 1.0))
    touched = {body for body, forces in expected.items() if np.abs(forces).max() > 0.1}
    assert touched == ({"b0", "b1", "b2"} if paths == "joints" else {"b2"})
