"""The recursion in 3D against d'Alembert's principle over material points: all joints, trees, loops, rows, loads.

Points of bodies with geometric stiffening move to second order by an affine field, of which the core has all.
"""

import numpy as np
import pytest
from points_3d import J, Mechanism, r
from random_bodies import (
    GRAVITY,
    JOINTS,
    check_balance,
    ground,
    random_body,
    random_tree,
    row,
    rows_of_every_kind,
    with_rows,
)

curved_or_not = pytest.mark.parametrize("curved", [False, True], ids=["", "stiffened"])
FAR = {False: 0.1, True: 0.3}  # modal coordinates


KINDS = {  # modes, modal coordinates, keys of bodies
    "rigid": (0, 0.1, {}),
    "flexible": (3, 0.1, {}),
    "clamped": (3, 0.1, {"clamped": True}),
    "stiffened line of mass": (3, 0.3, {"curved": True, "line": True}),
    "stiffened, clamped": (3, 0.3, {"curved": True, "clamped": True}),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("joint", JOINTS, ids=[joint.name for joint in JOINTS])
def test_each_joint_at_the_ground_and_between_bodies(joint, kind):
    """Three bodies, the joint in question on the first and the last; forces along coordinates and at markers."""
    rng, (modes, deflection, keys) = np.random.default_rng(1), KINDS[kind]
    bodies = [
        random_body(rng, modes, joint, **keys),
        random_body(rng, modes and 4, J.revolute, parent=0, parent_marker=1, **keys),
        random_body(rng, modes, joint, parent=1, parent_marker=2, **keys),
    ]
    mechanism = Mechanism(bodies, ground(rng), GRAVITY, wrenches=[(2, 2), (1, 1), (0, 2)])
    check_balance(mechanism, rng, force=True, deflection=deflection)


def test_rows_in_several_blocks():
    """Six bodies, free in the tree, that 18 rows of points hold to each other, one along an axis that turns."""
    rng = np.random.default_rng(3)
    bodies = [random_body(rng, 1, J.revolute if k == 4 else J.free, parent=-1 if k < 4 else 3) for k in range(6)]
    rows = [
        row(r.ConstraintKind.point, (k - 1, 1), (k, 2), axis, name=f"{k}")
        for k in range(6)
        for axis in np.eye(3)[: 3 if k else 2]
    ]
    rows.append(row(r.ConstraintKind.slide, (-1, 0), (5, 1), (0.6, 0.8, 0.0)))
    check_balance(with_rows(rng, bodies, rows), rng)


@pytest.mark.parametrize("points", [1, 2, 3])
@pytest.mark.parametrize("joint", [J.weld, J.prismatic], ids=["welded", "sliding"])
@pytest.mark.parametrize("outboard", [1, 2])
def test_bodies_without_inertia_about_an_axis(joint, points, outboard):
    """Point masses, one or some on a line, beside sections that modes move: their articulated inertia is singular."""
    rng = np.random.default_rng(8)
    small = [random_body(rng, 0, joint, line=True, parent=1, parent_marker=k + 1) for k in range(outboard)]
    for body in small:
        body.mass, body.x, body.Phi = body.mass[:points], body.x[:points], body.Phi[:points]
    link = random_body(rng, 4, J.universal, parent=0, parent_marker=1)
    mechanism = Mechanism([random_body(rng, 3, J.revolute), link, *small], ground(rng), GRAVITY)
    check_balance(mechanism, rng)


@pytest.mark.parametrize("curved", [False, None], ids=["", "some stiffened"])
@pytest.mark.parametrize("seed", range(6))
def test_trees(seed, curved):
    rng = np.random.default_rng(seed)
    check_balance(random_tree(rng, curved=curved), rng, deflection=0.1 if curved is False else 0.3)


@curved_or_not
def test_rows_of_every_kind(curved):
    rng = np.random.default_rng(4)
    check_balance(rows_of_every_kind(rng, curved=curved), rng, deflection=FAR[curved])


@pytest.mark.parametrize(("modes", "curved"), [(0, False), (3, False), (3, True)])
def test_a_loop(modes, curved):
    """Two arms of different length on the ground, closed by a spherical joint; the first driven."""
    rng, keys = np.random.default_rng(5), {"curved": curved}
    bodies = [
        random_body(rng, modes, J.revolute, **keys),
        random_body(rng, modes, J.spherical, parent=0, parent_marker=1, **keys),
        random_body(rng, modes, J.universal, parent_marker=1, **keys),
        random_body(rng, modes, J.cylindrical, parent=2, parent_marker=2, **keys),
    ]
    rows = [row(r.ConstraintKind.point, (3, 1), (1, 2), axis) for axis in np.eye(3)]
    check_balance(with_rows(rng, bodies, rows), rng, deflection=FAR[curved])
