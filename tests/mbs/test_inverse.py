"""Random trees in 3D: forces, accelerations and energies of the core against the equations of each body."""

import numpy as np
import pytest
import tree_oracle
from body_equations import (
    accelerated,
    accelerations_of_bodies,
    body_forces,
    energies,
    momentum,
    required_forces,
    residuals,
)
from checkpoint_scenes import as_scene, tree_model
from moving_trees import SMALL, state_of
from random_mechanisms import TYPES, random_tree

from ffrobot.mbs import _core
from ffrobot.mbs.model.gears import with_compliance
from ffrobot.mbs.quantities.motion import acting_forces, system_of
from ffrobot.mbs.quantities.supply import totals

FRICTION = {"viscous_friction": 0.3, "coulomb_friction": 0.2, "friction_speed": 0.5}
ROTOR = {"rotor_inertia": 0.02, "gear_ratio": 7.0}
GEAR = {"stiffness": 9.0, "damping": 0.6}
AS_BUILT = {
    "revolute": FRICTION | ROTOR,
    "prismatic": FRICTION | ROTOR,
    "cylindrical": FRICTION,
    "screw": FRICTION,
    "universal": FRICTION,
}
LOAD = {"x": "3", "y": "t - 2", "mx": "0.2*t", "mz": "0.7"}  # N, N·m
KINDS = ("rigid", "solid", "beam", "supported beam", "stiffened solid", "stiffened beam")


def anything_moving(rng, joint, turned, gear):
    """A loaded tree of bodies of all kinds with what joints of this type have, at accelerations that nothing makes."""
    kinds = ("rigid", "beam") if joint == "free" else KINDS
    plain, tables = as_scene(random_tree(rng, [joint] * 4, kinds, size=SMALL), turned)
    body = plain.bodies[2]
    load = {"point": f"{body.name}.{next(iter(body.points))}"} | LOAD
    tables = [table | AS_BUILT.get(joint, {}) | gear for table in tables]
    model = with_compliance(tree_model(plain, tables, load=[load]))
    tree, times = model.tree, np.array([0.0, 0.4])
    q = tree.integrate(np.tile(tree.at_rest({}), (2, 1)), SMALL * rng.standard_normal((2, tree.n_v)))
    return state_of(model, times, q, *rng.standard_normal((2, 2, tree.n_v)), np.zeros((2, 0)))


EVERY = [*((joint, {}) for joint in TYPES), ("revolute", GEAR)]


@pytest.mark.parametrize(
    ("joint", "gear", "turned"),
    [
        pytest.param(*of, turned, marks=[pytest.mark.nightly] * (turned == k % 2))
        for k, of in enumerate(EVERY)
        for turned in (0, 1)
    ],
)
def test_trees_of_every_joint(joint, gear, turned):
    motion = anything_moving(np.random.default_rng(50 + TYPES.index(joint)), joint, turned, gear)
    check_equations(motion)
    for found, wanted in zip(totals(motion), (energies(motion), momentum(motion)), strict=True):
        for key, values in vars(wanted).items():
            np.testing.assert_allclose(vars(found)[key], values, rtol=0, atol=1e-12 * np.abs(values).max(), err_msg=key)
    if joint != "free":
        check_points(motion)


def check_equations(motion):
    """Forces that the motion takes; accelerations that the core finds instead leave none."""
    system, state = system_of(motion), (motion.q, motion.v)
    expected = required_forces(motion.model, accelerated(motion), motion.time)
    found = system.core.required_forces(system.scene, motion.time, *state, motion.a)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    run = _core.tree_outputs(system.core, system.scene, motion.time.tolist(), np.hstack(state))
    free = state_of(motion.model, motion.time, *state, run.accelerations, run.multipliers)
    assert residuals(free)[0] < 1e-12


def check_points(motion):
    """All that acts at the points of a body moves it, and its frame and modes as they do."""
    tree, state = motion.model.tree, accelerated(motion)
    of_bodies = body_forces(state, motion.model.scene.gravity)
    of_all = accelerations_of_bodies(state)
    for number, (node, expected) in enumerate(zip(tree.nodes, of_bodies, strict=True)):
        force, moment, frame = 0.0, 0.0, state.frames[number]
        sections, wrenches = acting_forces(motion).on_sections(number)
        by_section = wrenches.reshape(len(wrenches), -1, 2, 3).transpose(1, 2, 0, 3)
        for section, (acting, turning) in zip(sections, by_section, strict=True):
            arm = tree_oracle.motion(tree, section, motion.q, state.frames).r - frame.r
            force, moment = force + acting, moment + turning + np.cross(arm, acting)
        wrench, modal = expected[:, :6], expected[:, 6:]
        size = np.abs(wrench[:, :3]).max() + np.abs(wrench[:, 3:]).max()
        np.testing.assert_allclose(np.hstack([force, moment]), wrench, rtol=0, atol=1e-11 * size)
        found = acting_forces(motion).found.modal[:, node.p_v]
        np.testing.assert_allclose(found, modal, rtol=0, atol=1e-12 * np.abs(modal).max(initial=1.0))
        a, alpha, _ = np.split(of_all[number], [3, 6], axis=1)
        alpha = np.einsum("tij,tj->ti", frame.F, alpha)
        for found, wanted in zip(acting_forces(motion).of_body(number), (a, alpha), strict=False):
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-11 * np.abs(wanted).max(initial=1.0))
