"""Free bodies in 3D: an independent code's motion, and what cannot change: momentum and energy."""

import numpy as np
import tree_oracle
from checkpoint_mechanisms import load
from checkpoint_scene_files import FOLDER, close
from tables_3d import ORIGIN, joint, rigid, scene

import ffrobot
from ffrobot.common.rotations import of_quaternion
from ffrobot.mbs.analysis.forward import Forward
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.known_motion import State
from ffrobot.mbs.quantities.motion import body_motion
from ffrobot.mbs.quantities.supply import totals
from ffrobot.mbs.run.drive import drive_robot
from ffrobot.mbs.run.record import Run
from ffrobot.run.bodies import load_bodies
from ffrobot.scene.load import validated_scene


def test_rigid_top():
    """Euler's equations; joint_rates of a free joint are in the axes of its body."""
    data = load("top_rigid")
    samples = data["samples"]
    spin = {"name": "spin", "kind": "forward", "end": 4.0, "output_step": 0.1, "tolerance": 1e-8}
    rates = {"joint_rates": {"floats": [0.0, 0.0, 0.0, *samples[0]["angular_velocity_body"]]}}
    floats = joint("floats", "free", "ground", "top.root")
    tables = scene([rigid("top", data["mass"], data["inertia"])], [floats], spin, gravity=ORIGIN, initial=rates)
    with ffrobot.solve(ffrobot.make_scene(**tables)) as results:
        group = {key: results[f"spin/bodies/top/{key}"] for key in ("quaternion", "angular_velocity")}
        e, expected = group["quaternion"], np.array([sample["quaternion"] for sample in samples])
        np.testing.assert_allclose(np.abs(np.sum(e * expected, axis=1)), 1, atol=1e-12)
        spin = np.einsum("tji,tj->ti", of_quaternion(e), group["angular_velocity"])
        close(spin, [sample["angular_velocity_body"] for sample in samples])
        close(results["spin/momentum/angular"], [sample["angular_momentum"] for sample in samples])
        np.testing.assert_allclose(results["spin/energy/kinetic"], samples[0]["energy"], rtol=1e-8)


def motion_of(model, times, q, v):
    state = {"time": np.array(times), "q": q, "v": v, "a": 0 * v, "multipliers": np.zeros((len(q), 0))}
    return Run(analysis=Forward(name="state", kind="forward", end=1.0, output_step=1.0), model=model, **state)


def test_flexible_top():
    """A free link in all families, from the state of the first sample on, its centre of mass at rest."""
    tables = {
        "name": "spinner", "space": "spatial", "gravity": (0.0, 0.0, 0.0),
        "body": ({"name": "spinner", "link": "links/spinner.toml"},),
        "analysis": ({"name": "spin", "kind": "forward", "end": 1.0, "output_step": 1.0},),
    }  # fmt: skip
    scene = validated_scene(tables, FOLDER / "scene.toml", "")
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])
    samples, (node,) = load("top_flexible")["samples"], model.tree.nodes
    sample = samples[0]
    q, v = np.zeros(model.tree.n_q), np.zeros(model.tree.n_v)
    q[node.q], q[node.p_q] = [*sample["position"], *sample["quaternion"]], sample["modal"]
    v[3:6] = sample["angular_velocity_body"]
    v[:3] = -totals(motion_of(model, [0.0], q[None], v[None]))[1].linear[0] / node.body.mass
    times = {"end": samples[-1]["t"], "output_step": samples[1]["t"]}
    run = drive_robot(model, Forward(name="spin", kind="forward", tolerance=1e-8, **times), State(q, v), lambda _: True)
    assert run.status == "completed"
    motion = motion_of(model, run.time, run.q, run.v)
    body = body_motion(motion, "spinner")
    modal = np.array([sample["modal"] for sample in samples])
    for found, expected in zip(body.modal.T, modal.T, strict=True):
        close(found, expected)
    spin = np.einsum("tji,tj->ti", tree_oracle.frames(motion.model.tree, motion.q)[0].F, body.angular_velocity)
    close(spin, [sample["angular_velocity_body"] for sample in samples])
    close(body.position - body.position[0], np.array([x["position"] for x in samples]) - samples[0]["position"], 0.1)
