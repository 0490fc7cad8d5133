"""The tree of a scene in 3D against the oracle: places, coordinates, gradients, loops, both orders of sides."""

from dataclasses import replace

import numpy as np
import pytest
import tree_oracle
from checkpoint_scenes import as_scene, coordinates, tree_model
from random_mechanisms import TYPES, random_tree
from rotations import random_rotation
from tree_oracle import row_values, target_rates
from trees_in_a_plane import TYPES as IN_PLANE
from trees_in_a_plane import planar_model

from ffrobot.common.rotations import skew
from ffrobot.mbs import _core
from ffrobot.mbs.fields.orientations import OrientationLaw
from ffrobot.mbs.model.nodes import ConstraintRow, Section, rows_of_joint
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.posture import mobilities

CLOSE = 1e-12
GROUND = Section(-1, "", np.eye(3), np.zeros(3))
JOINT = (tree_oracle.motion_of_joint, tree_oracle.action)


def built(tree, turned=False):
    """The tree with joints along their axes, its model, and coordinates without modes."""
    plain, tables = as_scene(tree, turned)
    model = tree_model(plain, tables)
    return plain, model, model.tree.at_rest(coordinates(model, plain, turned))


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
@pytest.mark.parametrize("seed", range(6))
def test_bodies_stand_where_the_oracle_has_them(seed, turned):
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, rng.permutation(TYPES)[:6], size=0.1)
    plain, model, q = built(tree, turned)
    for node in model.tree.nodes:
        q[node.p_q] = tree.p[node.body.name]
    expected = plain.placed()
    for node, frame in zip(model.tree.nodes, tree_oracle.frames(model.tree, q[None]), strict=True):
        for found, wanted in zip((frame.r[0], frame.F[0]), expected[node.body.name], strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-13)


def every_row(rng, model):
    """Rows of all kinds between random sections, with targets and orientations that move, for each body."""
    number, axes = _core.TimeFunction.polynomial, np.eye(3)
    moving = [number(np.array([-1.0, 1.0]), rng.standard_normal((1, 4))) for _ in range(6)]
    laws = [OrientationLaw(kind, tuple(moving[:3]), (0.1, 0.2, 0.3)) for kind in ("rotation_vector", "direction")]
    for k, node in enumerate(model.tree.nodes):
        a, b = (Section(body, "tip", random_rotation(rng), np.zeros(3)) for body in (int(rng.integers(-1, k)), k))
        a = a if a.body >= 0 else Section(-1, "", a.triad, rng.standard_normal(3))
        f, g = rng.standard_normal((2, 3))
        for kind in ("point", "slide", "dot"):
            yield ConstraintRow("path", kind, a, b, f, g, target=None if kind == "dot" else moving[3])
        yield ConstraintRow("path", "turn", a, b, axes[0], axes[1], target=moving[4])
        yield from (ConstraintRow("path", "rotation", GROUND, b, e, e, law=laws[0]) for e in axes)
        yield from (ConstraintRow("path", "dot", b, GROUND, e, axes[2], law=laws[1]) for e in axes[:2])
        if node.joint.units and node.joint.type != "planar":
            yield from rows_of_joint("path", node, np.r_[node.v][:1], moving[5:6], -1.0)
            if node.joint.units[0] == "rad":
                yield ConstraintRow("loop", "turn", a, b, axes[2], axes[0], coordinate=node.v.start)


def states_of(rng, model):
    """Random q and v of three states."""
    q = np.tile(model.tree.at_rest({}), (3, 1))
    q = tree_oracle.integrate(model.tree, q, rng.standard_normal((3, model.tree.n_v)))
    for node in model.tree.nodes:
        q[:, node.p_q] = 0.1 * rng.standard_normal((3, node.body.n_modes))
    return q, rng.standard_normal((3, model.tree.n_v))


@pytest.mark.parametrize("turned", [False, True], ids=["outwards", "inwards"])
@pytest.mark.parametrize("seed", range(4))
def test_core_moves_trees_and_measures_rows_as_numpy_does(seed, turned):
    """Frames, sections, increments, C, C_v, Ċ and what joints carry, of all types of joints with loops."""
    rng = np.random.default_rng(100 + seed)
    kinds = ("rigid", "solid", "beam", "supported beam") if seed % 2 else ("stiffened solid", "stiffened beam", "rigid")
    tree = random_tree(rng, rng.permutation(TYPES), kinds, chain=seed > 1, loops=3 * (seed % 2))
    assert_core_is_the_oracle(rng, built(tree, turned)[1])


@pytest.mark.parametrize("seed", range(3))
def test_core_moves_trees_in_a_plane_as_numpy_does(seed):
    rng = np.random.default_rng(seed)
    assert_core_is_the_oracle(rng, planar_model(rng, rng.permutation(IN_PLANE * 2)))


def placed(tree, q):
    """Axes and places (bodies, T, 3, 4) of the frames of all bodies."""
    return np.array([np.dstack([at.F, at.r]) for at in tree_oracle.poses(tree, q)])


def assert_core_is_the_oracle(rng, model):
    tree, (q, v) = model.tree, states_of(rng, model)
    places, frames = tree.places(q, v), tree_oracle.frames(tree, q)
    sections = [side for node in tree.nodes for side in (node.inner, node.outer)]
    sections += [tree.section(f"{node.body.name}.{point}", random_rotation(rng)) for node in tree.nodes
                 for point in node.body.points]  # fmt: skip
    found = [places.frame(number) for number in range(len(frames))] + [places.at(section) for section in sections]
    expected = frames + [tree_oracle.motion(tree, section, q, frames) for section in sections]
    for at, of in zip(found, expected, strict=True):
        rates = np.einsum("tij,tj->ti", of.L, v)
        for ours, numpys in zip(at, (of.r, of.F, rates[:, :3], rates[:, 3:]), strict=True):
            np.testing.assert_allclose(ours, numpys, rtol=0, atol=CLOSE * max(1.0, np.abs(numpys).max()))
    of_differences = tree_oracle.rate(lambda q, _: placed(tree, q), tree, q, v)
    for of, rate in zip(frames, of_differences, strict=True):
        velocity, omega = np.split(np.einsum("tij,tj->ti", of.L, v), 2, axis=1)
        exact = np.dstack([skew(omega) @ of.F, velocity])
        np.testing.assert_allclose(rate, exact, rtol=0, atol=1e-10 * max(1.0, np.abs(exact).max()))
    moved = tree_oracle.integrate(tree, q, 0.3 * v)
    np.testing.assert_allclose(tree.integrate(q, 0.3 * v), moved, rtol=0, atol=CLOSE * np.abs(moved).max())
    model, times = replace(model, rows=(*model.rows, *every_row(rng, model))), np.array([0.0, 0.2, 0.5])
    C, C_v = model.constraints.values(q, times)
    for ours, numpys in zip((C, C_v), row_values(model, q, times), strict=True):
        np.testing.assert_allclose(ours, numpys, rtol=0, atol=CLOSE * np.abs(numpys).max())
    rates = np.einsum("tij,tj->ti", C_v, v) - target_rates(model, q, times)
    np.testing.assert_allclose(model.constraints.rates(q, v, times), rates, rtol=0, atol=CLOSE * np.abs(rates).max())
    assert_joints_carry_what_does_no_work(rng, model, q, frames)


def assert_joints_carry_what_does_no_work(rng, model, q, frames):
    tree, forces = model.tree, rng.standard_normal((len(q), 6 * len(model.tree.nodes)))
    found = MultibodySystem(replace(model, rows=())).core.without_work(q, forces)
    for number, node in enumerate(tree.nodes):
        F, of = tree_oracle.motion(tree, node.inner, q, frames).F, slice(6 * number, 6 * number + 6)
        axes = np.zeros((len(q), 6, 6))
        axes[:, :3, :3] = axes[:, 3:, 3:] = F
        S, acts = (axes @ of_joint(node.joint, q[:, node.q]) for of_joint in JOINT)
        left = forces[:, of] - np.einsum("tik,tjk,tj->ti", acts, S, forces[:, of])
        np.testing.assert_allclose(found[:, of], left, rtol=0, atol=CLOSE)


@pytest.mark.parametrize("types", [("revolute", "universal", "spherical"), ("cylindrical", "revolute", "planar")])
def test_postures_keep_to_loops(types):
    """Where Newton's method converges in the core, NumPy's C is zero, and modes are where they were."""
    rng = np.random.default_rng(5)
    tree = random_tree(rng, types, ("rigid", "solid"), chain=True, loops=1)
    _, model, q = built(tree)
    q = tree_oracle.integrate(model.tree, np.tile(q, (5, 1)), 0.1 * rng.standard_normal((5, model.tree.n_v)))
    found, is_met = model.constraints.postures(q, np.zeros(5))
    assert is_met.any()
    np.testing.assert_allclose(row_values(model, found[is_met], np.zeros(5)[is_met])[0], 0.0, atol=1e-11)
    for node in model.tree.nodes:
        np.testing.assert_array_equal(found[:, node.p_q], q[:, node.p_q])


@pytest.mark.parametrize("seed", range(3))
def test_mobility_is_that_of_numpys_gradients(seed):
    """Ranks, freedoms and singular ratios of loops and of a path through them, by singular values of NumPy's C_v."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, ("prismatic", "spherical", "revolute", "cylindrical", "universal", "revolute"), ("solid",),
                       chain=True, loops=1)  # fmt: skip
    model = built(tree)[1]
    last = len(model.tree.nodes) - 1
    path = [ConstraintRow("path", "point", GROUND, Section(last, "tip", np.eye(3), np.zeros(3)), e, e,
                          target=_core.TimeFunction.polynomial(np.array([-1.0, 1.0]), rng.standard_normal((1, 4))))
            for e in np.eye(3)[:2]]  # fmt: skip
    model, (q, _), times = replace(model, rows=(*model.rows, *path)), states_of(rng, model), np.array([0.0, 0.2, 0.5])
    scaled = row_values(model, q, times)[1] * model.joint_sizes / model.row_sizes[:, None]
    for J, at in zip(scaled[:, :, model.tree.joint_columns], mobilities(model, q, times), strict=True):
        _, of_loops, V = np.linalg.svd(J[model.loop_rows])
        rank = np.count_nonzero(of_loops > 1e-6 * max(of_loops[0], 1.0))
        free, followed = V[rank:].T, J[~model.loop_rows]
        _, sizes, V = np.linalg.svd(followed @ free)
        left = free @ V[2:].T
        assert (at.loop_rank, at.followed) == (rank, 2)
        np.testing.assert_allclose(at.loop_ratio, of_loops[rank - 1] / of_loops[0], rtol=1e-9)
        np.testing.assert_allclose(at.ratio, sizes[-1] / sizes[0], rtol=1e-9)
        np.testing.assert_allclose(at.free @ at.free.T, free @ free.T, atol=1e-9)
        np.testing.assert_allclose(at.left @ at.left.T, left @ left.T, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(followed @ at.hardest), sizes[-1], rtol=1e-9)
