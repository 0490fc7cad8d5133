"""Linear equations by dual numbers in joint coordinates: equal to those by differences in absolute coordinates."""

from dataclasses import replace

import numpy as np
import pytest
import zoo
from mechanisms import core_run, make_model, relative, revolute

from ffrobot.mbs.analysis.elastic_joints import with_compliance
from ffrobot.mbs.model.system import MechanismSystem
from ffrobot.mbs.solve.initial_state import undeformed_state
from ffrobot.mbs.solve.linearisation import Linearisation

ABSOLUTE = ("stiffened", "stiffened, driven", "stiffened, as built", "driven, as built", "free-flying")
"""With moments on sections that geometric stiffening turns, or places of frames among the coordinates."""


def motion_of(model, seed=1):
    """q, v and a with closed joints: modes of any size and rate, accelerations as loads and forces along s have it."""
    assembly, rng = MechanismSystem(model, model.joints, model.loads), np.random.default_rng(seed)
    start, is_mode = undeformed_state(assembly), np.ones(assembly.system.coordinates, dtype=bool)
    is_mode[assembly.frame_coordinates] = False
    q = start.q + 0.05 * rng.standard_normal(len(start.q)) * is_mode
    run = core_run(assembly, q, start.v + rng.standard_normal(len(q)), [0.0])
    return run.q[0], run.v[0], run.a[0]


def compare(model, bound):
    """Both about a motion that some forces along s drive beside the loads."""
    q, v, a = motion_of(model)
    linearisation = Linearisation(model, q)
    assert linearisation.tree is not None
    H = linearisation.at(0.0, q, v, a).transformation
    a = a + H @ np.random.default_rng(2).standard_normal(H.shape[1])
    found = linearisation.at(0.0, q, v, a)
    expected = linearisation.absolute.at(0.0, q, v, a, found.transformation, found.transformation_rate)
    assert relative(found.D, expected.D) < bound
    assert relative(found.K, expected.K) < bound


@pytest.mark.parametrize("name", [name for name in zoo.ALL if name not in ABSOLUTE])
def test_zoo(name):
    """Forces of a motion have errors of its mass matrix' condition, 3e7 for the longest chain."""
    compare(replace(zoo.build(name), trajectories=()), 1e-9 if name == "chain of 24" else 5e-12)


@pytest.mark.parametrize("name", ["stiffened", "stiffened, as built"])
def test_geometric_stiffening(name):
    """That leaves the angles of sections linear in p, as in beams."""
    model = zoo.build(name)
    turn = np.array([1.0, 1.0, 0.0])[:, None, None]
    bodies = []
    for body in model.bodies:
        points = {point: turn * K for point, K in body.stiffening.K_points.items()}
        bodies.append(replace(body, stiffening=replace(body.stiffening, K_points=points)))
    compare(replace(model, bodies=tuple(bodies), trajectories=()), 5e-12)


@pytest.mark.parametrize("damping", [0.0, 0.4])
def test_gears_that_give(damping):
    """On a body that is kept at an angle, behind a loaded motor, beside a rigid gear."""
    gives = {"gear_ratio": 5.0, "rotor_inertia": 0.02, "stiffness": 40.0, "damping": damping}
    joints = [
        {"name": "rail", "type": "prismatic", "between": ("ground", "b1.root"), "axis": (1.0, 0.5)},
        revolute("j2", "b1.tip", "b2.root", **gives),
        revolute("j3", "b2.tip", "b3.root", **gives),
        revolute("j4", "b3.tip", "b4.root", gear_ratio=3.0, rotor_inertia=0.03, viscous_friction=0.2),
    ]
    load = [{"joint": "j2", "moment": "2.0"}, {"point": "b4.tip", "x": "3.0"}, {"point": "b4.tip", "moment": "1.0"}]
    angles = {"b1": 0.4, "b2": 1.0, "b3": -0.3, "b4": 0.8}
    bodies = zoo.clouds(np.random.default_rng(7), 4)
    compare(with_compliance(make_model(bodies, joint=joints, load=load, initial={"angles": angles})), 5e-12)


@pytest.mark.parametrize("name", ABSOLUTE)
def test_what_stays_in_absolute_coordinates(name):
    model = replace(zoo.build(name), trajectories=())
    assert Linearisation(model, motion_of(model)[0]).tree is None
