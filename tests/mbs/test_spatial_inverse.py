"""Inverse dynamics by the equations of each body, energies and momentum, against the recursion: random trees."""

import numpy as np
import pytest
from body_equations import required_forces
from moving_trees import NOW, SMALL, moving
from spatial_scenes import as_scene, tree_model
from spatial_trees import TYPES, random_tree

from ffrobot.mbs import _core
from ffrobot.mbs.model.spatial_accelerations import Accelerated, row_accelerations
from ffrobot.mbs.model.spatial_drives import Drive, Drives
from ffrobot.mbs.model.spatial_gears import with_compliance_in_space
from ffrobot.mbs.model.spatial_motors import path_forces
from ffrobot.mbs.model.spatial_system import SpatialSystem
from ffrobot.mbs.model.spatial_transmission import gear_forces
from ffrobot.mbs.quantities.spatial_energy import energies, momentum
from ffrobot.mbs.solve.integrators import METHODS

ONE = _core.TimeFunction.constant(1.0)


@pytest.mark.parametrize("joint", TYPES)
def test_accelerations_take_no_force(joint):
    """M v̇ − Q of what the recursion finds is nothing, mode by mode and joint by joint."""
    kinds = ("rigid", "beam") if joint == "free" else ("rigid", "solid", "beam", "supported beam")
    rng = np.random.default_rng(TYPES.index(joint))
    for _ in range(5):
        motion, _ = moving(rng, [joint] * 3, kinds)
        left = required_forces(motion.model, motion.accelerated, NOW)
        still = required_forces(
            motion.model, Accelerated(motion.model.tree, motion.q, 0 * motion.v, motion.a, motion.frames), NOW
        )
        np.testing.assert_allclose(left, 0, atol=1e-10 * np.abs(motion.a).max())
        if np.abs(motion.v).max() > 0.1 and left.size > 3:
            assert np.abs(still).max() > 1e-3  # velocities matter here


@pytest.mark.parametrize("turned", [False, True])
def test_gears_that_give_take_no_force(turned):
    """Outputs of gears hang on sections that modes move and turn, and carry the spin of their rotors alone."""
    rng, keys = np.random.default_rng(5), {"rotor_inertia": 0.02, "gear_ratio": 7.0, "stiffness": 9.0, "damping": 0.6}
    for kinds in (("rigid",), ("beam",), ("solid",), ("supported beam",)):
        plain, tables = as_scene(random_tree(rng, ["revolute"] * 3, kinds, chain=True, size=SMALL), turned)
        model = with_compliance_in_space(tree_model(plain, [table | keys for table in tables]))
        tree = model.tree
        q, v = SMALL * rng.standard_normal(tree.n_q), rng.standard_normal(tree.n_v)
        system, load = SpatialSystem(model), rng.standard_normal(tree.n_v)
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
        scene = SpatialSystem(model, Drives(along=(Drive(load, ONE),))).scene
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
        model = with_compliance_in_space(tree_model(plain, [table | FRICTION | as_built for table in tables]))
        tree, system = model.tree, SpatialSystem(model)
        q, v, a = SMALL * rng.standard_normal(tree.n_q), *rng.standard_normal((2, tree.n_v))
        state = Accelerated(tree, q[None], v[None], a[None], tree.frames(q[None]))
        expected = required_forces(model, state, NOW)
        found = system.core.required_forces(system.scene, NOW, q[None], v[None], a[None])
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("seed", range(4))
def test_rows_of_loops_keep_their_accelerations(seed):
    motion, _ = moving(np.random.default_rng(seed), ["revolute"] * 3, ("rigid", "solid", "beam"), loops=1)
    assert motion.model.rows
    left = row_accelerations(motion.model, motion.accelerated, NOW)
    np.testing.assert_allclose(left, 0, atol=1e-8 * np.abs(motion.a).max())
    held = np.einsum("tij,ti->tj", motion.rows[1], motion.multipliers)
    found = required_forces(motion.model, motion.accelerated, NOW) + held
    np.testing.assert_allclose(found, 0, atol=1e-9 * max(np.abs(held).max(), np.abs(motion.a).max()))
    np.testing.assert_array_equal(path_forces(motion.model, motion.rows[1], motion.multipliers), 0)


@pytest.mark.parametrize("joint", TYPES)
def test_energies_and_momentum_are_those_of_the_recursion(joint):
    kinds = ("rigid", "beam") if joint == "free" else ("rigid", "solid", "beam", "supported beam")
    motion, system = moving(np.random.default_rng(50 + TYPES.index(joint)), [joint] * 3, kinds)
    totals = system.core.totals(motion.q[0], motion.v[0])
    found, moving_on = energies(motion), momentum(motion)
    for key in ("kinetic", "strain", "gravitational"):
        np.testing.assert_allclose(getattr(found, key)[0], getattr(totals, key), rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(moving_on.linear[0], totals.momentum, atol=1e-10)
    np.testing.assert_allclose(moving_on.angular[0], totals.angular_momentum, atol=1e-10)


def test_damping_takes_what_its_forces_do():
    motion, _ = moving(np.random.default_rng(7), ["revolute"] * 2, ("beam",))
    expected = sum(
        motion.v[0, node.p_v] @ node.body.damping @ motion.v[0, node.p_v] for node in motion.model.tree.nodes
    )
    np.testing.assert_allclose(energies(motion).dissipated_power, [expected])
    assert expected > 0
