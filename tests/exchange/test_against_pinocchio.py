"""Equations of motion of rigid trees against Pinocchio's algorithms: accelerations, required moments, mass matrices."""

import re
from typing import NamedTuple

import numpy as np
import pytest
from other_codes import pinocchio_dynamics, python_with_pinocchio
from rigid_robots import ROBOTS, random_urdf

from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.known_motion import KnownStates, required_forces
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.run.bodies import load_bodies
from ffrobot.scene.load import load_scene

STATES = 5
CLOSE = 1e-12  # of the largest


class Motion(NamedTuple):
    """Of the joints of a tree, (STATES, n) each; moments of motors beside a."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    tau: np.ndarray


@pytest.fixture(
    scope="module",
    params=["ur5", "panda", *(pytest.param(k, marks=[pytest.mark.nightly] * (k % 4 > 0)) for k in range(20))],
)
def robot(request, tmp_path_factory, ffrobot):
    """The file of a robot or of a random tree, its scene, and random motions."""
    folder, urdf = tmp_path_factory.mktemp("robot"), ROBOTS / f"{request.param}.urdf"
    rng = np.random.default_rng(7)
    if isinstance(request.param, int):
        rng, urdf = np.random.default_rng(request.param), folder / "random.urdf"
        urdf.write_text(random_urdf(rng))
    ffrobot.ok("import", urdf, "-o", folder / "out")
    path = folder / "out" / "scene.toml"
    text = re.sub(r"^(viscous|coulomb)_friction = .*\n", "", path.read_text(), flags=re.MULTILINE)
    path.write_text(
        text + '[[analysis]]\nname = "falls"\nkind = "forward"\nend = 1.0\noutput_step = 1.0\ntolerance = 1e-6\n'
    )
    scene = load_scene(path)
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])
    motion = Motion(*rng.uniform(-1, 1, (4, STATES, model.tree.n_v)))
    return urdf, MultibodySystem(model), motion


def close(found, expected):
    """Relative to the largest of each state."""
    found, expected = np.asarray(found), np.asarray(expected)
    scale = np.abs(expected).reshape(STATES, -1).max(axis=1).reshape(STATES, *[1] * (expected.ndim - 1))
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0, atol=CLOSE)


@pytest.fixture(scope="module")
def python_of_pinocchio(pytestconfig, tmp_path_factory):
    """Its interpreter; the environment is kept in pytest's cache if there is one."""
    cache = getattr(pytestconfig, "cache", None)
    return python_with_pinocchio(tmp_path_factory.mktemp("pinocchio") if cache is None else cache.mkdir("pinocchio"))


def test_accelerations_moments_and_mass_matrices(robot, python_of_pinocchio):
    urdf, system, motion = robot
    tree = system.model.tree
    names = [node.joint.name for node in sorted(tree.nodes, key=lambda node: node.v.start)]
    assert len(names) == tree.n_v
    expected = pinocchio_dynamics(python_of_pinocchio, urdf, names, **motion._asdict())

    def accelerations(q, v, force):
        return system.core.evaluate(q, v, np.zeros(0), force, None)[0]

    close([accelerations(q, v, tau) for q, v, _, tau in zip(*motion, strict=True)], expected["aba"])
    moving = KnownStates(motion.q, motion.v, motion.a)
    close(required_forces(system, moving, np.zeros(STATES)), expected["rnea"])
    for q, v, M in zip(motion.q, motion.v, expected["crba"], strict=True):
        free = accelerations(q, v, np.zeros(tree.n_v))
        inverse = np.array([accelerations(q, v, unit) - free for unit in np.eye(tree.n_v)])
        condition = np.linalg.cond(M)
        np.testing.assert_allclose(inverse @ M, np.eye(tree.n_v), rtol=0, atol=CLOSE * condition)
