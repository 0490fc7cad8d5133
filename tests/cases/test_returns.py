"""Forward runs in 3D under all that an inverse analysis found return to its motion: exactly, with the same steps."""

from pathlib import Path

import numpy as np
import pytest
import tables_3d
import tree_oracle
from patch_sets import amplifiers
from scipy.optimize import lsq_linear
from tables_3d import Y, Z, joint, revolute
from test_replays_3d import beam

import ffrobot
from ffrobot.mbs import _core
from ffrobot.mbs.analysis.fcid import Fcid
from ffrobot.mbs.analysis.forward import Forward
from ffrobot.mbs.analysis.pcid import Pcid
from ffrobot.mbs.fields.field_types import Steps
from ffrobot.mbs.model.system import MultibodySystem, motor_commands, motor_forces
from ffrobot.mbs.posture.path_start import path_start
from ffrobot.mbs.run.context import Context
from ffrobot.mbs.run.gears import supplied_in
from ffrobot.run.solve import prepare_scene
from ffrobot.run.watcher import Watcher

END, LENGTH, BENT = 0.2, 0.35, 1.2
SIZES = (0.08, 0.12, 0.06)  # m, of the way of the tip along x, y, z


class Patches:
    """Modal forces Φ_V (n, k) on the modes of a body's file, all of which are served; least squares within `limit`."""

    def __init__(self, body, Phi_V, limit=np.inf):
        self.Phi_V = Phi_V
        self.per_volt, self.to_reached = {body: Phi_V}, {body: np.eye(len(Phi_V))}
        self.amplifiers = amplifiers(np.broadcast_to(limit, Phi_V.shape[1]).astype(float))

    def allocation(self, *, limited):
        n, k = self.Phi_V.shape
        lower, upper = (self.amplifiers if limited else self.amplifiers.unlimited()).range
        return _core.Allocation(self.Phi_V, np.eye(n), np.linalg.pinv(self.Phi_V), lower, upper, np.ones(k))


@pytest.fixture(scope="module")
def solution():
    return prepare_scene(scene(), Watcher())


def scene(load=(), limits=({}, {})):
    """Two beams on a universal joint and a revolute one, all with motors; the tip follows a line."""
    s = f"(10*(t/{END})**3-15*(t/{END})**4+6*(t/{END})**5)"
    tip = LENGTH * np.array([1 + np.cos(BENT), 0.0, -np.sin(BENT)])
    path = {axis: f"{x:.17g}+({size})*{s}" for axis, x, size in zip("xyz", tip, SIZES, strict=True)}
    joints = [
        joint("shoulder", "universal", "ground", "b0.root", axis=Z, second_axis=Y, motor=True, **limits[0]),
        revolute("elbow", "b0.tip", "b1.root", Y, motor=True, **limits[1]),
    ]
    tables = tables_3d.scene(
        [beam("b0"), beam("b1")], joints, {"name": "inverse", "kind": "pcid", "end": END, "output_step": END / 50},
        initial={"state": "static", "joints": {"shoulder": [0.0, 0.0], "elbow": BENT}}, load=list(load),
        trajectory=[{"name": "path", "point": "b1.tip", **path}],
    )  # fmt: skip
    return ffrobot.make_scene(**tables)


def full(model):
    """Patches that supply all modal forces."""
    bodies = {node.body.name: node.body for node in model.tree.nodes}
    return {name: Patches(name, np.eye(body.on_file.shape[1])) for name, body in bodies.items()}


def always(t):
    return True


def inverse_of(model, tolerance, **keys):
    analysis = Pcid(name="inverse", kind="pcid", end=END, output_step=END / 50, tolerance=tolerance, **keys)
    return analysis.run(
        Context(model=model, outcomes={}, progress=always, path=path_start(model, END), is_replayed=True)
    )


def replay_of(model, inverse, apply, tolerance, patches=None, repeat_steps=None, **keys):
    analysis = Forward(
        name="back", kind="forward", end=END, output_step=END / 50, actuation="inverse", apply=apply,
        tolerance=tolerance, **keys,
    ).model_copy(update={"repeat_steps": repeat_steps})  # fmt: skip
    patches = full(model) if patches is None else patches
    context = Context(model=model, outcomes={"inverse": inverse}, progress=always, patches=patches)
    found = analysis.run(context)
    assert found.status == "completed"
    return found


def departure(inverse, run):
    """The largest of the tip, relative to its way."""
    tree = inverse.model.tree
    section = tree.section("b1.tip", np.eye(3))
    way, other = (tree_oracle.motion(tree, section, of.q, tree_oracle.frames(tree, of.q)).r for of in (inverse, run))
    return np.linalg.norm(other - way, axis=1).max() / np.ptp(way, axis=0).max()


@pytest.mark.parametrize("apply", ["joints+pzt", "trajectory"])
def test_with_the_steps_of_the_inverse_run_round_off_is_all_that_is_left(solution, apply):
    inverse = inverse_of(solution.model, 1e-5, integrator="dop853", keep_steps=True)
    steps = Steps(Path(), "dop853", inverse.statistics.step_ends)
    back = replay_of(solution.model, inverse, apply, 1e-5, repeat_steps=steps)
    assert back.statistics.steps == inverse.statistics.steps > 100
    assert departure(inverse, back) < 1e-12


@pytest.mark.parametrize("shape", ["zero", "static"])
def test_a_prescribed_shape(solution, shape):
    """Links that ring in PCID keep it, held by forces on their modes."""
    analysis = Fcid(name="inverse", kind="fcid", shape=shape, end=END, output_step=END / 50)
    path = path_start(solution.model, END)
    inverse = analysis.run(Context(model=solution.model, outcomes={}, progress=always, path=path))
    back = replay_of(solution.model, inverse, "joints+pzt", 1e-7)
    assert departure(inverse, back) < 1e-6
    modes = ~solution.model.tree.joint_columns
    assert np.abs((back.v - inverse.v)[:, modes]).max() < 1e-5 * np.abs(inverse.v).max()


@pytest.mark.parametrize("integrator", ["dop853", "radau"])
def test_saturated_actuators_do_what_their_limits_leave(integrator):
    """M v̇ − Q = Gᵀ clip(τ) + Φ_V V at outputs, V by SciPy's bounded least squares, τ and F_p of NumPy."""
    limited = scene(limits=({"moment_limit": [0.5, 3.0]}, {"moment_limit": 0.4}))
    model, rng = prepare_scene(limited, Watcher()).model, np.random.default_rng(3)
    bodies = {node.body.name: node.body for node in model.tree.nodes}
    patches = {
        name: Patches(name, rng.standard_normal((body.on_file.shape[1], 3)), [0.02, 0.05, 0.5])
        for name, body in bodies.items()
    }
    inverse = inverse_of(model, 1e-8)
    back = replay_of(model, inverse, "joints+pzt", 1e-8, patches, limits=True, integrator=integrator)
    found = motor_forces(inverse.model, inverse.q, supplied_in(inverse))
    tau = np.hstack(list(found.moments.values()))
    clipped = np.clip(tau, *(sign * np.array([0.5, 3.0, 0.4]) for sign in (-1, 1)))
    assert np.any(clipped != tau)
    acting = clipped @ [command.direction for command in motor_commands(model)]
    saturated = 0
    for name, of_link in patches.items():
        for k, wanted in enumerate(found.modal[name]):
            limit = np.array([0.02, 0.05, 0.5])
            V = lsq_linear(of_link.Phi_V, wanted, (-limit, limit), method="bvls", tol=1e-14).x
            saturated += np.count_nonzero(np.abs(V) >= limit)
            acting[k] += model.modal_directions({name: of_link.Phi_V @ V[:, None]})[0]
    assert saturated > 10
    system = MultibodySystem(model.without_paths())
    required = system.core.required_forces(system.scene, list(back.time), back.q, back.v, back.a)
    np.testing.assert_allclose(required, acting, rtol=0, atol=1e-6 * np.abs(acting).max())
    np.testing.assert_allclose(np.hstack(list(back.commanded.values())), clipped, rtol=0, atol=1e-7)
