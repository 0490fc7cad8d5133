"""Friction and loads along the joint at which a loop is cut are those of a joint of the tree."""

import numpy as np
import pytest
import tree_oracle
from body_equations import accelerated, accelerations_of_bodies, residuals
from closed_chains import NOW, closed_chain, evaluated
from equal_steps import controls
from moving_trees import differences
from tree_oracle import row_values

from ffrobot.mbs import _core
from ffrobot.mbs.model.known_motion import State
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.quantities.motion import joint_motion
from ffrobot.mbs.quantities.reactions import reactions
from ffrobot.mbs.quantities.supply import totals
from ffrobot.mbs.run.integrators import stiffness_of

CHAINS = [
    (("revolute", "universal", "cylindrical", "universal"), ("rigid",)),
    (("planar", "universal", "prismatic", "revolute"), ("rigid",)),
    (("revolute", "cylindrical", "universal"), ("beam",)),
    (("prismatic", "revolute", "planar"), ("solid", "beam")),
]  # fmt: skip


def case(number):
    types, kinds = CHAINS[number]
    return closed_chain(np.random.default_rng(number), types, kinds)


def free_velocity(rng, model, q):
    """One that closes the loop."""
    v = rng.standard_normal(model.tree.n_v)
    C_v = row_values(model, q[None], np.zeros(1))[1][0]
    return v - np.linalg.pinv(C_v, rcond=1e-10) @ (C_v @ v)


def moving_chains(chain):
    """The same instant of a chain that is cut at each of its joints in turn, by this joint."""
    found, seen = {}, None
    for cut in chain.tables:
        model = chain.model(cut)
        q = chain.position(model)
        frames = tree_oracle.frames(model.tree, q[None])
        L = {node.body.name: frame.L[0] for node, frame in zip(model.tree.nodes, frames, strict=True)}
        modes = {node.body.name: np.eye(model.tree.n_v)[node.p_v] for node in model.tree.nodes}
        along = np.vstack([np.vstack([L[body.name], modes[body.name]]) for body in chain.tree.bodies])
        if seen is None:
            seen = along @ free_velocity(np.random.default_rng(7), model, q)
        C_v = row_values(model, q[None], np.zeros(1))[1][0]
        v = np.linalg.lstsq(np.vstack([along, C_v]), np.append(seen, np.zeros(len(C_v))), rcond=None)[0]
        np.testing.assert_allclose(along @ v, seen, atol=1e-9)
        found[cut] = evaluated(model, q, v)
    return found


@pytest.mark.parametrize("number", range(len(CHAINS)))
def test_it_does_not_matter_where_a_loop_is_cut(number):
    """Accelerations, what joints carry, where they are and what friction takes: with the same friction in all."""
    check_cuts(case(number))


@pytest.mark.parametrize("kinds", [("rigid",), ("beam", "rigid")])
def test_it_does_not_matter_where_a_loop_with_rotors_in_all_joints_is_cut(kinds):
    """Nor whether the rotor of the joint is one of the tree or beside it: with geared rotors in all, too."""
    types = ("revolute", "revolute", "prismatic", "revolute", "revolute", "prismatic", "revolute")
    check_cuts(closed_chain(np.random.default_rng(8), types, kinds, rotors=True))


def check_cuts(chain):
    (_, one), *others = moving_chains(chain).items()
    joints = [joint.name for joint in one.model.scene.joint]

    def accelerations(motion):
        found = accelerations_of_bodies(accelerated(motion))
        return np.array([found[motion.model.tree.index[body.name]][0, :6] for body in chain.tree.bodies])

    expected = accelerations(one)
    assert totals(one)[0].dissipated_power[0] > 0.05
    for _, other in others:
        np.testing.assert_allclose(accelerations(other), expected, rtol=0, atol=1e-8 * np.abs(expected).max())
        powers = (totals(motion)[0].dissipated_power for motion in (other, one))
        np.testing.assert_allclose(*powers, rtol=1e-9)
        carried, known = reactions(other), reactions(one)
        size = max(np.abs(known[joint]).max() for joint in joints)
        for joint in joints:
            np.testing.assert_allclose(carried[joint], known[joint], rtol=0, atol=1e-7 * size, err_msg=joint)
            for found, wanted in zip(joint_motion(other, joint), joint_motion(one, joint), strict=True):
                np.testing.assert_allclose(found, wanted, atol=1e-9, err_msg=joint)


@pytest.mark.parametrize("number", range(len(CHAINS)))
def test_forces_balance(number):
    """By inverse dynamics, which asks no core: M v̇ − Q + C_vᵀλ = 0."""
    for motion in moving_chains(case(number)).values():
        assert residuals(motion)[0] < 1e-9


@pytest.mark.parametrize("number", range(len(CHAINS)))
def test_derivatives(number):
    """Exact ones against differences of evaluations, cut at the last joint and at another."""
    chain = case(number)
    for cut in list(chain.tables)[1::2]:
        model = chain.model(cut)
        tree, system, q = model.tree, MultibodySystem(model), chain.position(model)
        v = free_velocity(np.random.default_rng(1), model, q)
        force = np.random.default_rng(2).standard_normal(tree.n_v)
        scene = system.scene
        for direction in np.eye(tree.n_v):
            scene.add_load(direction, _core.TimeFunction.constant(float(force @ direction)))
        found = system.core.derivatives(system.scene, NOW, q, v, np.zeros(tree.n_v))

        def a(dq=0.0, dv=0.0, of=(system.core, scene), q=q, v=v, tree=tree):
            states = np.concatenate([tree.integrate(q, np.zeros(tree.n_v) + dq), v + dv])[None]
            return _core.tree_outputs(*of, [NOW], states).accelerations[0]

        for derivative, by in ((found.a_q, "dq"), (found.a_v, "dv")):
            expected = differences(lambda x, by=by, a=a: a(**{by: x}), tree.n_v, 1e-5)
            np.testing.assert_allclose(derivative, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


STICKS = {"viscous_friction": 0.1, "coulomb_friction": 5.0, "friction_speed": 1e-4}


def swung(system, q, method):
    """From rest at q, in at most 3000 steps."""
    rest, of_run = np.zeros(system.model.tree.n_v), controls(method, 1e-5, max_steps=3000)
    return _core.tree_motion(system.core, system.scene, [0.0, 0.05], q, rest, of_run, lambda t: True)


def test_a_joint_that_sticks_where_the_loop_is_cut():
    """A stiff damper to a light link: Newton's method of implicit steps knows it, explicit ones end.

    Its rate, by which integrators are chosen, is the same wherever the loop is cut.
    """
    chain, ends, rates = case(2), [], []
    for table in chain.tables.values():
        table.update(STICKS)
    for cut in chain.tables:
        model = chain.model(cut)
        system, q = MultibodySystem(model), chain.position(model)
        rates.append(stiffness_of(system, State(q, np.zeros(model.tree.n_v))).friction)
        implicit, explicit = (swung(system, q, method) for method in ("radau", "dop853"))
        assert implicit.status == _core.IntegrationStatus.completed != explicit.status
        end = implicit.states[-1:]
        q, v = np.split(end, [model.tree.n_q], axis=1)
        ends.append(system.core.states_totals(system.scene, q, v)[0, :3])
    np.testing.assert_allclose(ends, np.broadcast_to(ends[0], np.shape(ends)), rtol=1e-4)
    np.testing.assert_allclose(rates, rates[0], rtol=1e-9)
