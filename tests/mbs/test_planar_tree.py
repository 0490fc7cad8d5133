"""Planar mechanisms in joint coordinates have the numbers of the oracle: every mechanism of the zoo, and others."""

import ctypes
from dataclasses import replace
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest
import velocity_transformation
import zoo
from links import ritz_link
from mechanisms import always, assemble, make_model, on_constraints, oracle_of, relative, revolute

from ffrobot.mbs import _core
from ffrobot.mbs.analysis.elastic_joints import with_compliance
from ffrobot.mbs.fields.state_forces import state_function
from ffrobot.mbs.joints.measure import Marker
from ffrobot.mbs.model.planar_tree import PlanarTree
from ffrobot.mbs.solve.initial_state import undeformed_state

T = 0.0
RESOLVED = [
    *("chain of 2", "chain of 3", "chain of 6", "backwards", "mixed", "mixed backwards", "tree", "loaded"),
    *("four-bar", "slider-crank"),
]
AS_BUILT = [(name, side) for name in ("mixed, as built", "slider-crank, as built") for side in ("section", "frame")]


def bent_state(assembly, seed=1):
    """q and v at T on all constraints, with modes and twists of gears of any size and rate."""
    start, rng = undeformed_state(assembly), np.random.default_rng(seed)
    modal = np.ones(assembly.system.coordinates, dtype=bool)
    modal[assembly.frame_coordinates] = False
    modal[[assembly.first[assembly.index[gear.rotor]] + 2 for gear in assembly.model.gears]] = True
    q, v = start.q + 0.05 * rng.standard_normal(len(start.q)) * modal, start.v + rng.standard_normal(len(start.v))
    return on_constraints(assembly, T, q, v)


def outputs(tree, q, v):
    """What a run of the tree reports of a state of its own at T."""
    controls = _core.IntegrationControls(
        tolerance=1e-6, max_steps=0, methods=[(_core.MethodKind.dop853, 1.0, 0.0)], spectral_radius=0.8
    )
    return _core.run_tree(tree.both, times=[T], q=q, v=v, controls=controls, carry_on=always)


def at_one_state(assembly, motors=()):
    """The tree, and what it reports of a state."""
    (q, v), tree = bent_state(assembly), PlanarTree(assembly, motors)
    found = outputs(tree, *tree.state(q, v))
    for of_tree, expected in ((found.q[0], q), (found.v[0], v)):  # projected onto the rows of the tree
        np.testing.assert_allclose(of_tree, expected, rtol=0, atol=1e-10)
    return tree, found


def compare(assembly):
    """Accelerations, energies and all multipliers; those of joints come from an inverse sweep."""
    tree, found = at_one_state(assembly)
    oracle, q, v = oracle_of(assembly), found.q[0], found.v[0]
    a, multipliers = oracle.solve(T, q, v)
    assert relative(found.a[0], a) < 1e-11
    if len(multipliers):
        assert relative(found.multipliers[0], multipliers) < 1e-11
    assert found.residual.max() < 1e-12
    q_tree, v_tree, _ = tree.motion(found.q, found.v, found.a)
    energies, expected = tree.both.energies(q_tree, v_tree)[0], oracle.energies(q, v)
    np.testing.assert_allclose(energies, expected, rtol=1e-11, atol=1e-13 * np.abs(expected).max())
    return tree


def motor_forces(assembly, found):
    """(τ, F_p) by definition: −Dᵀ C_sᵀ λ_s, rates q̇ = D (ȧ, ṗ) of motors and modes."""
    oracle, q, v = oracle_of(assembly), found.q[0], found.v[0]
    C_q, is_trajectory = oracle.constraint_values(T, q, v)[2], np.array(assembly.is_trajectory)
    T_q = np.array([oracle.row(row, q, v).gradient for row in assembly.model.motors.values()])
    D = velocity_transformation.by_definition(oracle, C_q[~is_trajectory], T_q)
    force = -D.T @ C_q[is_trajectory].T @ found.multipliers[0][is_trajectory]
    return force[: len(T_q)], force[len(T_q) :]


@pytest.mark.parametrize("name", zoo.ALL)
def test_zoo(name):
    compare(assemble(zoo.build(name)))


@pytest.mark.parametrize("motors", ["section", "frame"])
@pytest.mark.parametrize("name", [*zoo.GEARED, "stiffened"])
def test_gears_that_give(name, motors):
    """Between frames, too, against which modes turn the sections at joints."""
    model = with_compliance(zoo.geared(name, motors=motors))
    assert model.gears
    compare(assemble(model))


def test_gears_that_give_in_all_joints_of_a_loop():
    """The one at which it is cut has a spring all the same."""
    tree = compare(assemble(with_compliance(zoo.geared("four-bar", motor=True, trajectory=[]))))
    assert len(tree.layout.cut) == 1


def held_at_root(rng, body, turns):
    """Stiffened, with a root elsewhere that modes leave alone but for its angle (`turns`): there the frame sits."""
    stiffening, root = zoo.random_stiffening(rng, body), body.points["root"]
    K_points = stiffening.K_points | {"root": np.zeros_like(stiffening.K_points["root"])}
    root = replace(
        root, position=rng.standard_normal(2), translation=0.0 * root.translation, rotation=turns * root.rotation
    )
    return replace(
        body, stiffening=replace(stiffening, K_points=K_points), points=MappingProxyType({**body.points, "root": root})
    )


@pytest.mark.parametrize("turns", [0.0, 1.0])
@pytest.mark.parametrize("name", ["chain of 3", "mixed", "tree", "loaded", "stiffened, driven"])
def test_stiffened_bodies_whose_frames_sit_at_joints(name, turns):
    rng, bare = np.random.default_rng(2), zoo.build(name)
    compare(assemble(replace(bare, bodies=tuple(held_at_root(rng, body, turns) for body in bare.bodies))))


NUMBERS = ctypes.POINTER(ctypes.c_double)


@ctypes.CFUNCTYPE(None, ctypes.c_double, NUMBERS, NUMBERS, NUMBERS)
def pull(t, position, rate, force):
    """A cubic spring, a damper that grows with height, a moment of the angle and its rate."""
    x, y, angle = position[:3]
    force[0] = -30.0 * x * (1 + x * x) - 2.0 * rate[0]
    force[1] = -(1 + y * y) * rate[1]
    force[2] = 4.0 * (t + 1 - angle) - 0.3 * rate[2]


@pytest.mark.parametrize("name", ["chain of 2", "backwards", "mixed backwards", "loaded", "free-flying"])
def test_forces_of_the_motion_of_points(name):
    bare, force = zoo.build(name), state_function(SimpleNamespace(address=ctypes.cast(pull, ctypes.c_void_p).value))
    points = [Marker(body.name, list(body.points)[-1]) for body in bare.bodies]
    model = replace(bare, state_forces=tuple((point, force) for point in points))
    compare(assemble(model))
    with_forces, without = (oracle_of(assemble(one)) for one in (model, bare))
    q, v = bent_state(assemble(bare))
    assert np.abs(with_forces.forces(T, q, v) - without.forces(T, q, v)).max() > 1e-2  # the forces act


@pytest.mark.parametrize("motors", ["section", "frame"])
def test_friction_in_all_joints_of_a_loop(motors):
    joints = [joint.model_dump(exclude_unset=True) for joint in zoo.build("four-bar").scene.joint]
    for k, joint in enumerate(joints):
        joint |= {"viscous_friction": 0.1 + 0.05 * k, "coulomb_friction": 0.02, "friction_speed": 0.5}
    model = zoo.four_bar(np.random.default_rng(0), joint=joints, motors=motors)
    tree = compare(assemble(model))
    assert len(tree.layout.cut) == 1


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
    """Of the multipliers of rows, relative to the largest, where q and v are rounded otherwise."""
    start, tree = undeformed_state(assembly), PlanarTree(assembly)
    state, rng = np.concatenate(tree.state(start.q, start.v)), np.random.default_rng(4)
    shifts = np.finfo(float).eps * rng.integers(-1, 2, (100, len(state)))
    found = _core.tree_outputs(tree.core, tree.scene, [T] * len(shifts), state * (1 + shifts)).multipliers
    return np.ptp(found, axis=0).max() / np.abs(found).max()


@pytest.mark.parametrize("driven", ["j1", "j2"])
def test_rounding_where_a_section_is_driven(driven):
    """It hardly has inertia to turn by: rounding of what it is free to do must not get into the loop (1.4e-15)."""
    assert scatter(driven_four_bar(driven)) < 5e-15


def test_states_there_and_back():
    """Angles count full turns."""
    models = {name: zoo.build(name) for name in ("mixed", "mixed backwards", "four-bar", "free-flying", "backwards")}
    for name in ("chain of 3", "mixed backwards"):
        models[f"{name}, geared"] = with_compliance(zoo.geared(name))
    for name, model in models.items():
        assembly = assemble(model)
        (q, v), tree = bent_state(assembly), PlanarTree(assembly)
        if not name.startswith("mixed") and name != "four-bar":  # prismatic joints and the ground keep angles
            q[assembly.first + 2] += 6 * np.pi
        run = outputs(tree, *tree.state(q, v))
        np.testing.assert_allclose(run.q[0], q, rtol=0, atol=1e-12)
        np.testing.assert_allclose(run.v[0], v, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("name", "motors"), [(name, side) for name in RESOLVED for side in ("section", "frame")] + AS_BUILT
)
def test_motor_and_modal_forces(name, motors):
    """τ and F_p in place of the forces on trajectories, of loops with a motor in the tree, too."""
    assembly = assemble(zoo.build(name, motors=motors))
    _, found = at_one_state(assembly, assembly.model.motors.values())
    tau, F_p = motor_forces(assembly, found)
    assert relative(found.tau[0], tau) < 1e-11
    assert relative(found.F_p[0], F_p) < 1e-11


@pytest.mark.parametrize("driven", range(4))
def test_loops_are_cut_where_no_motor_is(driven):
    joints = [joint.model_dump(exclude_unset=True) for joint in zoo.build("four-bar").scene.joint]
    for k, joint in enumerate(joints):
        joint["motor"] = k == driven
    assembly = assemble(zoo.four_bar(np.random.default_rng(0), joint=joints))
    tree, found = at_one_state(assembly, assembly.model.motors.values())
    assert tree.layout.cut.isdisjoint(assembly.model.motors)
    assert relative(found.tau[0], motor_forces(assembly, found)[0]) < 1e-11


@pytest.mark.parametrize("name", ["chain of 2", "mixed", "mixed backwards", "four-bar", "slider-crank", "tree"])
def test_accelerations_that_violate_a_row_are_seen(name):
    """By as much as the gradients of the rows say, which their rates are linear in."""
    assembly = assemble(zoo.build(name))
    tree = PlanarTree(assembly)
    q, v = tree.state(*bent_state(assembly))
    target = tree.row_signs * [constraint.target(T)[2] for constraint in tree.constraints]
    a = tree.core.evaluate(q, v, target, None, None)[0]
    assert tree.both.acceleration_violation(T, q, v, a) < 1e-13
    for k, unit in enumerate(np.eye(len(v))):
        felt = np.abs(tree.core.measure(q, unit)[1]).max()
        found = tree.both.acceleration_violation(T, q, v, a + 1e-3 * unit)
        assert found <= 1e-3 * felt + 1e-13, k
        assert found > 1e-8 or felt < 1e-2, k
    assert tree.both.acceleration_violation(T, q, 0.0 * v, a) > 1e-3


def driven_chain(links, **keys):
    """All joints but the last follow their coordinates."""
    angles = {link.name: 1.2 * (-0.6) ** k for k, link in enumerate(links)}
    before = [0.0, *angles.values()]
    paths = [
        {"name": f"turn {k}", "joint": f"j{k + 1}", "value": f"{angle - last!r}+0.2*t-{k}*t**2"}
        for k, (angle, last) in enumerate(zip(angles.values(), before, strict=False))
    ]
    joints = zoo.serial_joints(len(links))
    return assemble(make_model(links, joint=joints, trajectory=paths[:-1], initial={"angles": angles}, **keys))


def test_rows_in_several_blocks():
    """17 rows along coordinates, in blocks of 15, of links whose sections modes turn at pins, and of any others."""
    supported = [ritz_link(f"b{k}", "simply-supported", 0.5, 0.4, modes=1) for k in range(1, 19)]
    compare(driven_chain(supported, gravity=(1.0, -9.81)))
    compare(driven_chain(zoo.clouds(np.random.default_rng(0), 18)))
