"""Planar scenes put into space by `mbs.scene.in_space` and solved by the recursion in the plane: the planar numbers."""

import numpy as np
import planar_in_space
import pytest
from checkpoints import CASES

from ffrobot.mbs.analysis.context import Context
from ffrobot.mbs.analysis.spatial_replay import motor_forces_of
from ffrobot.mbs.model.planar_body_in_space import planar_body_in_space
from ffrobot.mbs.model.spatial_model import build_spatial_model
from ffrobot.mbs.model.spatial_system import SpatialSystem
from ffrobot.mbs.quantities.joint_motion import joint_motions
from ffrobot.mbs.quantities.observation import energies, trajectory_force
from ffrobot.mbs.quantities.spatial_energy import totals
from ffrobot.mbs.quantities.spatial_motion import SpatialMotion
from ffrobot.mbs.scene.in_space.mechanism import mechanism_in_space
from ffrobot.mbs.solve.start_in_space import start_in_space
from ffrobot.run.solve import solve
from ffrobot.scene.load import load_scene

TIMES = {"end": 0.05, "output_step": 0.001, "tolerance": 1e-10}
ANALYSES = [{"name": "inverse", "kind": "pcid"} | TIMES, {"name": "released", "kind": "forward"} | TIMES]
AS_BUILT = {"viscous_friction": 0.3, "coulomb_friction": 0.2, "friction_speed": 0.5, "rotor_inertia": 1e-4,
            "gear_ratio": 30.0}  # fmt: skip
FRICTION = {"viscous_friction": 0.02, "coulomb_friction": 0.05, "friction_speed": 0.5}
LOADS_OF_LOOP = [
    {"joint": joint, "moment": f"{size}*sin(30*t)"} for joint, size in (("O", 0.2), ("guide", 0.1), ("B", 0.3))
]
LOADS = [{"point": "link2.mid", "x": "3*t", "moment": "0.5"}, {"joint": "A", "moment": "2*sin(30*t)"}]
CASES_OF = {
    "beams": ("two_link", {}),
    "patches that are part of their links": ("two_link_patched", {}),
    "loads and payloads with inertia": (
        "two_link", {"payload": [{"point": "link2.tip", "mass": 0.3, "inertia": 2e-3}], "load": LOADS}
    ),
    "joints as built": ("two_link", {"of joints": AS_BUILT}),
    "few modes, from equilibrium": (
        "two_link",
        {"of bodies": {"modes": 2}, "of initial": {"state": "static"}, "analysis": ANALYSES[:1]},
    ),
    "solids": ("two_link_solid", {}),
    "a loop": ("slider_crank", {}),
    "a loop, cut at a slide with friction": ("slider_crank", {"of joints": FRICTION, "load": LOADS_OF_LOOP}),
    "a loop, joints as built": (
        "slider_crank", {"of joints": FRICTION, "of joint": {"guide": AS_BUILT, "A": AS_BUILT}, "load": LOADS_OF_LOOP}
    ),
}  # fmt: skip


@pytest.fixture(scope="module", params=list(CASES_OF))
def solved(request, tmp_path_factory):
    """Outcomes of the plane, and runs on the recursion, by analysis."""
    case, changes = CASES_OF[request.param]
    tables = planar_in_space.read(CASES / case / "scene.toml") | {"analysis": ANALYSES}
    tables |= {key: value for key, value in changes.items() if not key.startswith("of ")}
    of_joint = changes.get("of joint", {})
    tables["joint"] = [
        joint | changes.get("of joints", {}) | of_joint.get(joint["name"], {}) for joint in tables["joint"]
    ]
    tables["body"] = [body | changes.get("of bodies", {}) for body in tables["body"]]
    tables["initial"] |= changes.get("of initial", {})
    scene = load_scene(planar_in_space.write(tables, tmp_path_factory.mktemp(case) / "scene.toml"))
    planar = solve(scene)
    mechanism = mechanism_in_space(scene.model_copy(update={"payload": ()}), start_in_space(planar.model))
    model = build_spatial_model(mechanism, [planar_body_in_space(body) for body in planar.model.bodies])
    assert SpatialSystem(model).plane is not None
    context = Context(model=model, outcomes={}, progress=lambda t: True)
    runs = {each.name: each.run(context) for each in scene.analysis}
    return planar.outcomes, runs


def motion_of(run):
    return SpatialMotion(run.model, run.time, run.q, run.v, run.a, run.multipliers, run.forces.required)


def close(found, expected, share=1e-8, least=0.0):
    size = max(np.abs(expected).max(initial=0.0), least)
    np.testing.assert_allclose(found, expected, rtol=0, atol=share * size)


def test_motion(solved):
    """Joints, frames and modes, in the coordinates of the equations, and energies; driven and let go."""
    for name, outcome in solved[0].items():
        compare_motions(outcome, solved[1][name])


def compare_motions(outcome, run):
    assert outcome.status == run.status == "completed"
    motion = motion_of(run)
    for joint, expected in joint_motions(outcome).items():
        found = motion.joint(joint)
        if found is not None:
            close(found[0].ravel(), expected.coordinate, least=1.0)
            close(found[1].ravel(), expected.rate, least=1.0)
    for node in run.model.tree.nodes:
        columns, of_body = outcome.coordinates(node.body.name), motion.body(node.body.name)
        q = outcome.q[:, columns]
        close(of_body.position[:, :2], q[:, :2], least=1.0)
        assert not of_body.position[:, 2].any()
        close(run.q[:, node.p_q], q[:, 3:], least=1e-9)
    expected, found = energies(outcome), vars(totals(motion)[0])
    for key in ("kinetic", "strain"):
        close(found[key], expected[key])


def test_forces(solved):
    """What the path takes, moments of motors and modal forces."""
    outcome, run = (of["inverse"] for of in solved)
    motion, forces = motion_of(run), motor_forces_of(run)
    for trajectory in run.model.scene.trajectory:
        expected = trajectory_force(outcome, trajectory.name)
        close(motion.path_force(trajectory.name)[:, : expected.shape[1]], expected)
    if outcome.tau is None:
        return
    close(np.hstack([forces.moments[joint] for joint in outcome.assembly.model.motors]), outcome.tau)
    peak = np.abs(outcome.F_p).max()
    for node in run.model.tree.nodes:
        expected = outcome.F_p[:, outcome.modal_columns(node.body.name)]
        close(forces.modal[node.body.name] @ node.body.modal_transform, expected, least=peak)
