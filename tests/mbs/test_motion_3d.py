"""What is read off a motion in 3D, at the states and path forces of independent numbers."""

import numpy as np
import pytest
from checkpoint_mechanisms import CASES, load
from checkpoint_scenes import checkpoint_scene
from moving_trees import state_of

from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.quantities.supply import actuator_forces
from ffrobot.run.bodies import load_bodies

CLOSE = 2e-9  # of the peak: the digits in which two step sizes of the numbers agree


def motion_of(name):
    """The samples of a checkpoint as a motion, its motors between frames: multipliers of paths are their forces."""
    scene, data = checkpoint_scene(name).model_copy(update={"motors": "frame"}), load(name)
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])
    tree, samples = model.tree, data["samples"]
    time = np.array([sample["t"] for sample in samples])
    q, v = np.zeros((len(time), tree.n_q)), np.zeros((len(time), tree.n_v))
    angles, rates = (np.array([sample[key] for sample in samples]) for key in ("joints", "joint_rates"))
    first = 0
    for node in tree.nodes:
        count = node.joint.freedoms
        q[:, node.q], v[:, node.v] = angles[:, first : first + count], rates[:, first : first + count]
        first += count
        if node.body.n_modes:
            q[:, node.p_q] = [sample["bodies"][node.body.name]["modal"] for sample in samples]
            v[:, node.p_v] = [sample["bodies"][node.body.name]["modal_velocity"] for sample in samples]
    forces = np.array([sample["path_force"] for sample in samples])
    multipliers = -forces[:, : len(model.rows)]
    return state_of(model, time, q, v, np.zeros_like(v), multipliers), data


def close(found, expected, scale=None):
    expected = np.array(expected)
    np.testing.assert_allclose(found, expected, atol=CLOSE * max(np.abs(expected).max(), scale or 1e-12))


@pytest.mark.parametrize("name", [name for name in CASES if name != "slider_crank_3d"])
def test_motors_between_frames(name):
    """The same moments, other modal forces: no angle, but a virtual work."""
    motion, data = motion_of(name)
    close(np.hstack(list(actuator_forces(motion).moments.values())), [sample["moments"] for sample in data["samples"]])
    for body, values in actuator_forces(motion).modal.items():
        if values.shape[1]:
            close(values, [sample["bodies"][body]["modal_force_frame"] for sample in data["samples"]])
