"""Damping wanted of the vibrations of the assembled robot, made one of its links: docs/theory.md, Damping."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...common.arrays import Array, as_floats
from ..model.model import Model
from ..model.system import MechanismSystem
from .initial_state import undeformed_state
from .vibration import vibrations


def with_robot_damping(model: Model, ratios: Mapping[str, float]) -> Model:
    """The robot with links so damped that its vibrations have the damping ratios ζ, given by body, where all agree.

    At the initial posture, motors free. Bodies not named keep the damping that they have.
    """
    if not ratios:
        return model
    wanted, bodies, first = unit_damping(model), [], 0
    for body in model.bodies:
        block = slice(first, first + body.n_modes)
        first = block.stop
        if body.name in ratios:
            body = replace(body, damping=ratios[body.name] * wanted[block, block])
        bodies.append(body)
    return replace(model, bodies=tuple(bodies))


def unit_damping(model: Model) -> Array:
    """D (modes of all bodies)², 1/s, under which all vibrations have the damping ratio 1: ΦᵀDΦ = diag(2ω).

    Φ are the rows p of their shapes. Rigid motion is free of it; motion of p that the joints do not allow, too.
    """
    start = undeformed_state(MechanismSystem(model, [*model.joints, *model.trajectories]))
    assembly = MechanismSystem(model, model.joints)
    modes = vibrations(assembly, start)
    inverse = np.linalg.pinv(np.delete(modes.shape, assembly.frame_coordinates, axis=0))
    return as_floats(inverse.T @ (2 * modes.frequency[:, None] * inverse))
