"""The sign of a mode is a convention: nothing physical may depend on it."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import zoo
from bodies_by_invariants import PlanarPoint
from links import arm, arm_links
from mechanisms import pcid, relative
from oracle_runs import energies, evaluated, joint_forces, point_motion, random_tree_state, run, trajectory_force


def with_signs(body, signs):
    """The same body in modal coordinates signs · p."""
    S = np.diag(signs)
    points = {
        label: PlanarPoint(point.position, point.translation @ S, point.rotation @ S)
        for label, point in body.points.items()
    }
    return replace(
        body,
        damping=S @ body.damping @ S,
        S_bar=body.S_bar @ S,
        h=body.h @ S,
        j=body.j @ S,
        S_tilde=S @ body.S_tilde @ S,
        m_xy=S @ body.m_xy @ S,
        points=MappingProxyType(points),
    )


def test_a_whole_run_does_not_depend_on_the_signs():
    links = arm_links(damping_ratio=0.01)
    flipped = [with_signs(body, signs) for body, signs in zip(links, ([-1, 1, -1], [1, -1, -1]), strict=True)]
    one, other = (run(arm(bodies), pcid(tolerance=1e-8)) for bodies in (links, flipped))
    quantities = {
        "tip": lambda o: point_motion(o, "link2.tip").position,
        "deflection of link 1": lambda o: point_motion(o, "link1.mid").deflection,
        "deflection of link 2": lambda o: point_motion(o, "link2.tip").deflection,
        "frame angle": lambda o: o.q[:, o.coordinates("link2")][:, 2],
        "force": lambda o: trajectory_force(o, "tip"),
        "reaction": lambda o: joint_forces(o, "A").reaction,
        "moment": lambda o: joint_forces(o, "O").motor,
        "strain energy": lambda o: energies(o)["strain"],
        "power of modal forces": lambda o: np.column_stack(
            [o.F_p[:, o.modal_columns(n)] * o.v[:, o.coordinates(n)][:, 3:] for n in ("link1", "link2")]
        ),
    }
    for name, quantity in quantities.items():
        assert relative(quantity(other), quantity(one)) < 1e-9, name
    assert relative(other.F_p, one.F_p) > 0.1  # the signs did change


def test_general_modes_do_not_depend_on_the_signs():
    """One evaluation with S̃, j, m_xy and dense damping."""
    rng = np.random.default_rng(0)
    bodies = zoo.clouds(rng, 2)
    signs = [np.array([1, -1, -1, 1]), np.array([-1, -1, 1, 1])]
    tables = {"joint": zoo.serial_joints(2), "trajectory": [zoo.tip_path("b2")]}
    flipped = [with_signs(body, own) for body, own in zip(bodies, signs, strict=True)]
    robots = [zoo.make_model(each, **tables) for each in (bodies, flipped)]
    tree, flip = robots[0].model.tree, np.ones(robots[0].model.tree.n_v)
    for node, own in zip(tree.nodes, signs, strict=True):
        flip[node.p_v] = own
    q, v = random_tree_state(rng, robots[0])
    one, other = (evaluated(robot, 0.0, k * q, k * v) for robot, k in zip(robots, (1.0, flip), strict=True))
    assert relative(flip * other.outcome.a, one.outcome.a) < 1e-12
    assert relative(other.lambda_, one.lambda_) < 1e-12
