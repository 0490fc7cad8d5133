"""Inverse dynamics by the equations of each body, energies and momentum, against the recursion: random trees."""

import numpy as np
import pytest
from body_equations import (
    Accelerated,
    absolute_accelerations,
    accelerated,
    body_forces,
    energies,
    mechanism_of,
    momentum,
    required_forces,
)
from checkpoint_scenes import as_scene, tree_model
from moving_trees import NOW, SMALL, moving
from random_mechanisms import TYPES, random_tree
from tree_reactions import carried, needed

from ffrobot.mbs import _core
from ffrobot.mbs.model.drives import Drive, Drives
from ffrobot.mbs.model.gears import gear_forces, with_compliance
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.quantities.motion import RobotMotion, totals
from ffrobot.mbs.quantities.reactions import reactions
from ffrobot.mbs.solve.integrators import METHODS

ONE = _core.TimeFunction.constant(1.0)


@pytest.mark.parametrize("turned", [False, True])
def test_gears_that_give_take_no_force(turned):
    """Outputs of gears hang on sections that modes move and turn, and carry the spin of their rotors alone."""
    rng, keys = np.random.default_rng(5), {"rotor_inertia": 0.02, "gear_ratio": 7.0, "stiffness": 9.0, "damping": 0.6}
    for kinds in (("rigid",), ("beam",), ("solid",), ("supported beam",)):
        plain, tables = as_scene(random_tree(rng, ["revolute"] * 3, kinds, chain=True, size=SMALL), turned)
        model = with_compliance(tree_model(plain, [table | keys for table in tables]))
        tree = model.tree
        q, v = SMALL * rng.standard_normal(tree.n_q), rng.standard_normal(tree.n_v)
        system, load = MultibodySystem(model), rng.standard_normal(tree.n_v)
        of_gears = gear_forces(tree, q[None], v[None])[0]
        a, _ = system.core.evaluate(q, v, np.zeros(0), load + of_gears, None)
        state = Accelerated(tree, q[None], v[None], a[None], tree.frames(q[None]))
        left = required_forces(model, state, NOW)[0] - load
        np.testing.assert_allclose(left, 0, atol=1e-10 * np.abs(a).max())
        assert len(tree.gears) == 3
        assert np.abs(of_gears).max() > 0.1
        controls = _core.IntegrationControls(
            tolerance=1e-6, max_steps=1, methods=[(METHODS["dop853"], 1.0, 0.0)], spectral_radius=0.8
        )
        scene = MultibodySystem(model, Drives(along=(Drive(load, ONE),))).scene
        run = _core.tree_motion(system.core, scene, [0.0], q, v, controls, lambda t: True)
        np.testing.assert_allclose(run.accelerations[0], a, atol=1e-12 * np.abs(a).max())


FRICTION = {"viscous_friction": 0.3, "coulomb_friction": 0.2, "friction_speed": 0.5}
ROTOR = {"rotor_inertia": 0.02, "gear_ratio": 7.0}


@pytest.mark.parametrize(
    ("joint", "as_built"),
    [
        ("screw", {}),
        ("cylindrical", {}),
        ("prismatic", ROTOR),
        ("revolute", ROTOR),
        ("revolute", ROTOR | {"stiffness": 9.0, "damping": 0.6}),
    ],
    ids=["screw", "cylindrical", "prismatic with rotor", "revolute with rotor", "compliant gear"],
)
def test_the_core_finds_the_same_forces(joint, as_built):
    """Rotors, gears and friction, at accelerations that nothing makes: the equations of each body against the core."""
    rng = np.random.default_rng(TYPES.index(joint))
    for kinds in (("rigid",), ("beam",), ("solid",), ("supported beam",)):
        plain, tables = as_scene(random_tree(rng, [joint] * 3, kinds, chain=True, size=SMALL), False)
        model = with_compliance(tree_model(plain, [table | FRICTION | as_built for table in tables]))
        tree, system = model.tree, MultibodySystem(model)
        q, v, a = SMALL * rng.standard_normal(tree.n_q), *rng.standard_normal((2, tree.n_v))
        state = Accelerated(tree, q[None], v[None], a[None], tree.frames(q[None]))
        expected = required_forces(model, state, NOW)
        found = system.core.required_forces(system.scene, NOW, q[None], v[None], a[None])
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


AS_BUILT = {
    "revolute": FRICTION | ROTOR | {"stiffness": 9.0, "damping": 0.6},
    "prismatic": FRICTION | ROTOR,
    "cylindrical": FRICTION,
    "screw": FRICTION,
}
LOAD = {"x": "3", "y": "t - 2", "mz": "0.7"}  # N, N·m


def anything_moving(rng, joint, turned):
    """A loaded tree of bodies of all kinds with what joints of this type have, at accelerations that nothing makes."""
    kinds = ("rigid", "beam") if joint == "free" else ("rigid", "solid", "beam", "supported beam")
    plain, tables = as_scene(random_tree(rng, [joint] * 4, kinds, size=SMALL), turned)
    body = plain.bodies[2]
    load = {"point": f"{body.name}.{next(iter(body.points))}"} | LOAD
    tables = [table | AS_BUILT.get(joint, {}) for table in tables]
    model = with_compliance(tree_model(plain, tables, load=[load]))
    tree, times = model.tree, np.array([0.0, 0.4])
    q = tree.integrate(np.tile(tree.at_rest({}), (2, 1)), SMALL * rng.standard_normal((2, tree.n_v)))
    return RobotMotion(model, times, q, *rng.standard_normal((2, 2, tree.n_v)), np.zeros((2, 0)))


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
@pytest.mark.parametrize("joint", TYPES)
def test_energies_and_momentum_are_those_of_the_bodies(joint, turned):
    motion = anything_moving(np.random.default_rng(50 + TYPES.index(joint)), joint, turned)
    of_core, expected = totals(motion), (energies(motion), momentum(motion))
    for found, wanted in zip(of_core, expected, strict=True):
        for key, values in vars(wanted).items():
            np.testing.assert_allclose(vars(found)[key], values, rtol=0, atol=1e-12 * np.abs(values).max(), err_msg=key)


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
@pytest.mark.parametrize("joint", TYPES)
def test_joints_carry_what_bodies_need(joint, turned):
    check_carried(anything_moving(np.random.default_rng(70 + TYPES.index(joint)), joint, turned))


@pytest.mark.parametrize("seed", range(4))
def test_loops_carry_what_bodies_need(seed):
    motion, _ = moving(np.random.default_rng(seed), ["revolute"] * 3, ("rigid", "solid", "beam"), loops=1)
    check_carried(motion)


def check_carried(motion):
    found, expected = reactions(motion), carried(motion)
    assert set(found) == set(expected)
    for part in ("force", "moment"):
        size = max(np.abs(getattr(of_body, part)).max() for of_body in needed(motion))
        for name, of_joint in expected.items():
            values = getattr(found[name], part)
            np.testing.assert_allclose(values, getattr(of_joint, part), rtol=0, atol=1e-12 * size, err_msg=name)


@pytest.mark.parametrize("joint", [type_ for type_ in TYPES if type_ != "free"])
def test_loads_at_points_are_what_bodies_need(joint):
    """All that acts at the points of a body moves it, and its frame and modes as they do."""
    motion = anything_moving(np.random.default_rng(90 + TYPES.index(joint)), joint, turned=True)
    tree, state = motion.model.tree, accelerated(motion)
    of_bodies = body_forces(state, motion.model.scene.gravity)
    mechanism = mechanism_of(tree, np.zeros(3))
    of_all = absolute_accelerations(mechanism, state)
    for number, (node, expected) in enumerate(zip(tree.nodes, of_bodies, strict=True)):
        force, moment = 0.0, 0.0
        for section, acting in motion.forces.at_points[number]:
            place = tree.motion(section, motion.q, motion.frames)
            at_frame = acting.seen_from(place.r - motion.frames[number].r)
            force, moment = force + at_frame.force, moment + at_frame.moment
        size = np.abs(expected.force).max() + np.abs(expected.moment).max()
        np.testing.assert_allclose(force, expected.force, rtol=0, atol=1e-11 * size)
        np.testing.assert_allclose(moment, expected.moment, rtol=0, atol=1e-11 * size)
        modal = motion.forces.found.modal[:, node.p_v]
        np.testing.assert_allclose(modal, expected.modal, rtol=0, atol=1e-12 * np.abs(expected.modal).max(initial=1.0))
        of_body = motion.forces.of_body(number)
        a, alpha, _ = np.split(of_all[:, mechanism.coordinates.columns(node.body.name)], [3, 6], axis=1)
        alpha = np.einsum("tij,tj->ti", motion.frames[number].F, alpha)
        for found, wanted in ((of_body.a, a), (of_body.alpha, alpha)):
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-11 * np.abs(wanted).max(initial=1.0))
