"""Inverse dynamics in 3D by the equations of each body (Kane), an oracle of the core's Newton–Euler algorithm."""

import numpy as np

from ffrobot.mbs.model.spatial_inverse import body_forces, given_forces
from ffrobot.mbs.model.spatial_transmission import gear_forces, resistance, rotor_forces


def required_forces(model, state, times):
    """M v̇ − Q (T, n_v) along v: what gravity, elasticity, friction and given loads leave for others to supply."""
    gravity = np.array(model.scene.gravity)
    found = resistance(model, state.q, state.v, state.frames) + rotor_forces(state)
    found -= given_forces(model, state.q, state.frames, times)
    found -= gear_forces(model.tree, state.q, state.v)
    for node, frame, of_frame in zip(model.tree.nodes, state.frames, state.of_frames(), strict=True):
        needed = body_forces(node, state, of_frame, gravity)
        found += np.einsum("tij,ti->tj", frame.L[:, :3], needed.force)
        found += np.einsum("tij,ti->tj", frame.L[:, 3:], needed.moment)
        found[:, node.p_v] += needed.modal
    return found
