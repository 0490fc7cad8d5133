"""Prescribed motion and the forces of motors in 3D: the core against NumPy on random trees and loops."""

import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import tree_oracle
from body_equations import Accelerated, Motor, required_forces, row_accelerations, unmet
from closed_chains import closed_chain
from moving_trees import SMALL, moving
from random_mechanisms import TYPES
from rotations import random_rotation
from scipy.linalg import qr
from tree_oracle import row_values, target_rates

from ffrobot.mbs import _core
from ffrobot.mbs.fields.functions import state_function
from ffrobot.mbs.inversion.servo import Servo
from ffrobot.mbs.model.drives import Command
from ffrobot.mbs.model.nodes import ConstraintRow, Section
from ffrobot.mbs.model.system import MultibodySystem, turning_motors
from ffrobot.mbs.scene.loads import Load

TIMES = np.array([0.0, 0.01, 0.01, 0.05])
GROUND = Section(-1, "", np.eye(3), np.zeros(3))
FAMILIES = ("rigid", "solid", "beam", "supported beam")


def polynomial(value, rate, acceleration):
    """A function of time with these at t = 0, from t = −1 on."""
    second, first = acceleration / 2, rate - acceleration
    return _core.TimeFunction.polynomial(np.array([-1.0, 1.0]), np.array([[second, first, value - first - second]]))


def candidates(rng, model, q):
    """Rows of all kinds that may follow a path, which measure 0 at q (n_q,): several for each body."""
    tree = model.tree
    frames = tree_oracle.frames(tree, q[None])
    for number, node in enumerate(tree.nodes):
        for label in ("tip", "side"):
            section = Section(number, label, np.eye(3), np.zeros(3))
            yield from (ConstraintRow("path", "point", GROUND, section, f, f) for f in rng.standard_normal((3, 3)))
            for f in rng.standard_normal((3, 3)):
                g = tree_oracle.motion(tree, section, q[None], frames).F[0].T @ np.cross(f, rng.standard_normal(3))
                yield ConstraintRow("path", "dot", GROUND, section, f, g)
        if number:
            a, f = Section(number - 1, "side", np.eye(3), np.zeros(3)), rng.standard_normal(3)
            yield ConstraintRow("path", "slide", a, section, f, f)
        yield from coordinate_rows(node, range(node.v.start, node.v.stop))


def angles(rng, model):
    """Rows of the angles of all bodies against the one before, about any axes."""
    for number in range(len(model.tree.nodes)):
        a = Section(number - 1, "side", np.eye(3), np.zeros(3)) if number else GROUND
        f, g, _ = random_rotation(rng)
        yield ConstraintRow("path", "turn", a, Section(number, "tip", np.eye(3), np.zeros(3)), f, g)


def coordinate_rows(node, coordinates):
    """Of a joint whose coordinates are numbers; the core has none of planar joints."""
    zero = np.zeros(3)
    for k in coordinates if node.joint.q_count == node.joint.freedoms and node.joint.type != "planar" else ():
        yield ConstraintRow("path", "coordinate", node.inner, node.outer, zero, zero, coordinate=k)


def following(rng, model, q, count_more=0, pool=()):
    """The model with as many path rows as it has freedom, targets that move, and equations that only repeat others."""
    pool = tuple(pool or candidates(rng, model, q))
    at, joints = np.zeros(1), model.tree.joint_columns
    free = freedom(model, q)
    values, gradients = (found[0] for found in row_values(replace(model, rows=pool), q[None], at))
    chosen = qr((gradients[:, joints] @ free).T, pivoting=True)[2][: free.shape[1]]
    path = [
        pool[k] if pool[k].kind == "dot" else replace(pool[k], target=polynomial(values[k], *rng.standard_normal(2)))
        for k in chosen
    ]
    return replace(model, rows=(*model.rows, *model.rows[:count_more], *path, *path[:count_more]))


def freedom(model, q):
    """Orthonormal columns (joint coordinates, k) of what loops leave of the joints at q (n_q,)."""
    joints = model.tree.joint_columns
    if not model.rows:
        return np.eye(np.count_nonzero(joints))
    _, values, V = np.linalg.svd(row_values(model, q[None], np.zeros(1))[1][0][:, joints])
    return V[np.count_nonzero(values > 1e-9 * values[0]) :].T


def motors_of(rng, model, q):
    """As many motors as the loops leave freedom; those along single angles may turn frames."""
    coordinates = np.flatnonzero(model.tree.joint_columns)
    free = freedom(model, q)
    chosen = coordinates[qr(free.T, pivoting=True)[2][: free.shape[1]]]
    angles = {node.v.start for node in model.tree.nodes if node.joint.type == "revolute"}
    return [Motor(int(k), rng.choice([-1.0, 1.0]), k in angles and bool(rng.integers(2))) for k in chosen]


def in_core(model, motors):
    """The model in the core with motors."""
    moved = np.isin(np.arange(model.tree.n_v), [motor.coordinate for motor in motors])
    system = MultibodySystem(model, commands=[Command(moved.astype(float))])
    driven = _core.SpatialDriven(system.core, system.scene, (~model.loop_rows).tolist())
    for motor in motors:
        driven.add_motor(*motor)
    return driven


def drawn(seed, types, loops=0, count_more=0, pool=lambda *_: ()):
    """A random robot on its path, its motors, modes (3, T, n), and postures near (T, n_q)."""
    rng = np.random.default_rng(seed)
    while True:
        motion, _ = moving(rng, types, FAMILIES, loops=loops)
        q = motion.q[0]
        if freedom(motion.model, q).shape[1] + len(motion.model.rows) == sum(motion.model.tree.joint_columns):
            break  # loops that rigid links can close, too
    motors = motors_of(rng, motion.model, q)
    model = following(rng, motion.model, q, count_more, tuple(pool(rng, motion.model)))
    modal = modal_columns(model.tree)
    sizes = np.array([0.03 * SMALL, 1.0, 1.0])[:, None, None]
    modes = sizes * rng.standard_normal((3, len(TIMES), len(modal)))
    modes[0] += q[modal]
    return model, motors, modes, np.tile(q, (len(TIMES), 1))


def check(found, model, motors, modes):
    """Modes move as told; rows, d'Alembert's principle and the motors' share of forces hold as they do in NumPy."""
    tree, joints = model.tree, model.tree.joint_columns
    state = Accelerated(tree, found.q, found.v, found.a, tree_oracle.frames(tree, found.q))
    C, C_v = row_values(model, found.q, TIMES)
    required, of_rows = required_forces(model, state, TIMES), np.einsum("tji,tj->ti", C_v, found.multipliers)
    for p, told in zip((found.q[:, modal_columns(tree)], found.v[:, ~joints], found.a[:, ~joints]), modes, strict=True):
        np.testing.assert_array_equal(p, told)
    rates = np.einsum("tij,tj->ti", C_v, found.v) - target_rates(model, found.q, TIMES)
    fast, faster = 1 + np.abs(found.v).max(), 1 + np.abs(found.a).max() + np.abs(found.v).max() ** 2
    forces = max(np.abs(x).max(initial=0.0) for x in (required, of_rows, found.loops, found.tau))
    for left, size in (
        (C, 1.0), (rates, fast), (row_accelerations(model, state, TIMES), faster), (found.required - required, forces),
        ((required + of_rows)[:, joints], forces), (found.left - unmet(model, found, motors), forces),
        (found.left[:, joints], forces),
    ):  # fmt: skip
        np.testing.assert_allclose(left, 0, atol=1e-11 * size)


def modal_columns(tree):
    """Of q."""
    return np.concatenate([np.r_[node.p_q] for node in tree.nodes]).astype(int)


@pytest.mark.parametrize("types", [["revolute"] * 3, ["revolute", "screw", "revolute"]])
def test_angles_between_sections_follow_targets(types):
    """Of one direction about one axis each, however the sections turn otherwise."""
    model, motors, modes, near = drawn(12, types, pool=angles)
    assert [row.kind for row in model.rows] == ["turn"] * 3
    motion = _core.SpatialPrescribedMotion(in_core(model, motors), near[0])
    check(motion.motion(TIMES.tolist(), *modes, near), model, motors, modes)


CASES = [([joint] * 3, 0, 0) for joint in TYPES if joint != "weld"]
CASES += [(["revolute", "weld", "spherical", "universal"], 0, 0), (["planar", "prismatic", "screw"], 0, 2)]
CASES += [(["revolute"] * 6, 1, 0), (["revolute", "prismatic", "spherical", "revolute"], 1, 1)]


@pytest.mark.parametrize(("types", "loops", "count_more"), CASES, ids=str)
@pytest.mark.parametrize("seed", [0, 2])
def test_the_core_finds_the_motion_and_forces_of_numpy(seed, types, loops, count_more):
    model, motors, modes, near = drawn(seed, types, loops, count_more)
    driven = in_core(model, motors)
    found = _core.SpatialPrescribedMotion(driven, near[0]).motion(TIMES.tolist(), *modes, near)
    check(found, model, motors, modes)


@pytest.mark.parametrize(
    ("types", "loops"), [(["revolute"] * 3, 0), (["universal", "screw"], 0), (["revolute"] * 6, 1)]
)
def test_motors_of_a_redefined_output_are_those_of_less_deflection(types, loops):
    """The motors' coordinates, rates and accelerations are those on the path with the deflections a p + p_e.

    Loops stay closed with all of the deflections, by the other joints.
    """
    model, motors, modes, near = drawn(3, types, loops)
    factor, shift = 0.6, 0.3 * modes[0, 0]
    path, offset = in_core(model, motors), [_core.TimeFunction.constant(float(p)) for p in shift]
    still = replace(model, rows=tuple(row for row in model.rows if not row.is_trajectory)) if loops else model
    driven = in_core(with_motors_held(still, motors), motors) if loops else path
    motion = _core.SpatialRedefinedMotion(driven, path, near[0], factor, offset)
    found = motion.motion(TIMES.tolist(), *modes, near)
    seen = factor * modes
    seen[0] += shift
    on_path = _core.SpatialPrescribedMotion(path, near[0]).motion(TIMES.tolist(), *seen, near)
    for motor in motors:
        _, place = tree_oracle.of_coordinate(model.tree, motor.coordinate)
        np.testing.assert_allclose(found.q[:, place], on_path.q[:, place], atol=1e-11)
        for x, y in ((found.v, on_path.v), (found.a, on_path.a)):
            of_path = y[:, motor.coordinate]
            np.testing.assert_allclose(x[:, motor.coordinate], of_path, atol=1e-11 * max(1.0, np.abs(y).max()))
    check_loops(found, model, modes, 1e-11)
    state = Accelerated(model.tree, found.q, found.v, found.a, tree_oracle.frames(model.tree, found.q))
    required = required_forces(model, state, TIMES)
    left = unmet(model, SimpleNamespace(q=found.q, required=required, tau=found.tau, loops=found.loops), motors)
    np.testing.assert_allclose(found.left, left, atol=1e-11 * np.abs(required).max())


def check_loops(found, model, modes, bound):
    """Modes are where they are told to be; loops stay closed, also by their rates."""
    np.testing.assert_allclose(found.q[:, modal_columns(model.tree)], modes[0], atol=1e-14)
    C, C_v = row_values(model, found.q, TIMES)
    rates = np.einsum("tij,tj->ti", C_v, found.v)
    assert np.abs(C[:, model.loop_rows]).max(initial=0.0) < bound
    assert np.abs(rates[:, model.loop_rows]).max(initial=0.0) < 10 * bound


def with_motors_held(model, motors):
    """The model with coordinates of motors that stand still for its path."""
    rows = list(model.rows)
    for motor in motors:
        (row,) = coordinate_rows(tree_oracle.of_coordinate(model.tree, motor.coordinate)[0], [motor.coordinate])
        rows.append(replace(row, target=_core.TimeFunction.constant(0.0)))
    return replace(model, rows=tuple(rows))


def test_motion_ends_where_a_path_leaves_the_reach():
    """From one posture to the next up to the first time without any; with postures near, all others are found."""
    model, motors, modes, near = drawn(0, ["revolute"] * 3)
    k = next(k for k, row in enumerate(model.rows) if row.target is not None)
    rows, away = list(model.rows), polynomial(model.rows[k].target(0.0)[0], 1e4, 0.0)
    rows[k] = replace(rows[k], target=away)
    motion = _core.SpatialPrescribedMotion(in_core(replace(model, rows=tuple(rows)), motors), near[0])
    times, modes = [0.0, 0.04, 0.0], np.repeat(modes[:, :1], 3, axis=1)
    one_by_one, apart = (motion.motion(times, *modes, start).q for start in (near[:1], near[:3]))
    np.testing.assert_array_equal(np.isfinite(one_by_one).all(axis=1), [True, False, False])
    np.testing.assert_array_equal(np.isfinite(apart).all(axis=1), [True, False, True])
    np.testing.assert_allclose(apart[2], one_by_one[0], atol=1e-13)


def with_friction(model):
    """In all joints that have one coordinate."""
    friction, tree = {"viscous_friction": 0.3, "coulomb_friction": 0.2, "friction_speed": 0.5}, copy.copy(model.tree)
    tree.nodes = tuple(
        replace(node, joint=node.joint.model_copy(update=friction)) if len(node.joint.units) == 1 else node
        for node in tree.nodes
    )
    return replace(model, tree=tree)


def pulled(model):
    """By a cubic spring and a damper at a point of the last body."""

    def pull(t, position, velocity):
        return -30.0 * (position - 0.2) * (1 + position @ position) - (2 + position[1] ** 2) * velocity

    body = model.tree.nodes[-1].body
    load = Load(point=f"{body.name}.{list(body.points)[-1]}", force=state_function(pull, is_planar=False))
    return replace(model, scene=model.scene.model_copy(update={"load": (load,)}))


@pytest.mark.parametrize(
    ("types", "loops", "factor"),
    [
        (["revolute"] * 3, 0, 1.0),
        (["revolute"] * 3, 0, 0.6),
        (["spherical", "universal"], 0, 1.0),
        (["planar", "cylindrical"], 0, 1.0),
        (["revolute"] * 6, 1, 1.0),
    ],
    ids=str,
)
def test_derivatives_of_what_motors_leave_are_those_of_differences(types, loops, factor):
    """And of torques: by p, ṗ and p̈, with friction along coordinates and a force of the motion; of fourth order."""
    model, motors, modes, near = drawn(2, types, loops, count_more=1 if loops else 0)
    model = pulled(with_friction(model))
    motors = [motor._replace(turns_frames=False) for motor in motors]
    driven = in_core(model, motors)
    motion = _core.SpatialPrescribedMotion(driven, near[0])
    if factor != 1.0:
        motion = _core.SpatialRedefinedMotion(driven, driven, near[0], factor, [])
    times, modes, n = TIMES[:1], modes[:, :1], modes.shape[2]
    found = [x.reshape(-1, n) for x in motion.derivatives(times.tolist(), *modes, near[:1])]

    def forces(p, v, a):
        at = [0.0] * len(p), p, v, a, np.repeat(near[:1], len(p), axis=0)
        return np.hstack([motion.left_on_modes(*at)[1], motion.motion(*at).tau])

    check_slopes(found, forces, modes)


def check_slopes(found, forces, modes):
    """Derivatives (rows, n) of `forces` by p̈, ṗ and p at `modes` (3, 1, n) against differences of fourth order."""
    n = modes.shape[2]
    for order, (exact, size) in enumerate(zip(found[::-1], (2e-5, 1e-3, 0.1), strict=True)):
        steps = size * np.array([-2.0, -1.0, 1.0, 2.0])
        moved = np.repeat(modes, 4 * n, axis=1)
        moved[order] += np.kron(np.eye(n), steps[:, None])
        of_moved = forces(*moved).reshape(n, 4, -1)
        by_differences = np.einsum("k,jki->ij", np.array([1.0, -8.0, 8.0, -1.0]) / (12 * size), of_moved)
        for rows in (slice(0, n), slice(n, None)):
            largest = np.abs(by_differences[rows]).max()
            np.testing.assert_allclose(exact[rows], by_differences[rows], rtol=0, atol=1e-8 * largest)


def check_slopes_of_servo(servo, modes):
    def forces(*moved):
        return np.hstack(servo.forces(np.full(len(moved[0]), TIMES[0]), *moved))

    check_slopes([x[0] for x in servo.slopes(TIMES[:1], *modes[:, :1])], forces, modes[:, :1])


@pytest.mark.parametrize("factor", [1.0, 0.6])
def test_derivatives_of_what_motors_on_frames_leave(factor):
    """Their moments act on modes beside, along axes that turn with the sections."""
    model, _, modes, near = drawn(2, ["revolute"] * 3)
    model = replace(model, scene=model.scene.model_copy(update={"motors": "frame"}))
    servo = Servo(model, 1.0, factor, TIMES, near, lambda: True)
    assert len(turning_motors(model)) == 3
    check_slopes_of_servo(servo, modes)


@pytest.mark.parametrize("cut", ["j2", "j4"])
def test_motors_of_planar_joints_in_loops_go_with_the_redefined_output(cut):
    """Their coordinates are those on the path with a share of the deflections; loops stay closed."""
    rng, factor = np.random.default_rng(4), 0.6
    chain = closed_chain(rng, ("planar", "universal", "cylindrical", "universal"), ("beam",), size=SMALL)
    chain.tables["j1"]["motor"] = True
    model = chain.model(cut)
    q = chain.position(model)
    model = following(rng, model, q)
    near, tree, modal = np.tile(q, (len(TIMES), 1)), model.tree, modal_columns(model.tree)
    modes = np.array([0.03 * SMALL, 1.0, 1.0])[:, None, None] * rng.standard_normal((3, len(TIMES), len(modal)))
    modes[0] += q[modal]
    servo = Servo(model, 1.0, factor, TIMES, near, lambda: True)
    found = servo.motion.motion(TIMES, *modes, near)
    on_path = _core.SpatialPrescribedMotion(in_core(model, []), q).motion(TIMES.tolist(), *factor * modes, near)
    node = tree.nodes[tree.carried["j1"]]
    assert len(model.motors["j1"]) == 3
    for name, columns in (("q", node.q), ("v", node.v), ("a", node.v)):
        expected = getattr(on_path, name)[:, columns]
        np.testing.assert_allclose(getattr(found, name)[:, columns], expected, atol=1e-10 * np.abs(expected).max())
    check_loops(found, model, modes, 1e-10)
    assert np.abs(found.q - on_path.q).max() > 1e-3
    check_slopes_of_servo(servo, modes)
