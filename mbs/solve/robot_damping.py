"""Damping wanted of the vibrations of the assembled robot, made one of its links: docs/theory.md, Damping."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...common.arrays import Array, as_floats
from ..model.body import Body
from ..model.model import Model, without_paths
from .start import undeformed_posture
from .vibration import vibrations_of, without_rows


def with_robot_damping(model: Model, ratios: Mapping[str, float]) -> Model:
    """The robot with links so damped that its vibrations have the damping ratios ζ, given by body, where all agree.

    At the initial posture, motors free, gears rigid. Bodies not named keep the damping that they have.
    """
    if not ratios:
        return model
    start, tree = undeformed_posture(model), model.tree
    modes = vibrations_of(without_paths(model), without_rows(model), 0.0, start.q)
    wanted = unit_damping(modes.frequency, modes.shape[~tree.joint_columns])
    bodies = _damped([node.body for node in tree.nodes], wanted, ratios)
    return replace(model, tree=tree.with_bodies(bodies))


def unit_damping(frequency: Array, shape: Array) -> Array:
    """D (modes of all bodies)², 1/s, under which all vibrations have the damping ratio 1: ΦᵀDΦ = diag(2ω).

    Rigid motion is free of it; motion of p that the joints do not allow, too. `frequency` ω (n,) rad/s; `shape` Φ
    (modes of all bodies, n), the rows p of M-orthonormal shapes, body by body.
    """
    inverse = np.linalg.pinv(shape)
    return as_floats(inverse.T @ (2 * frequency[:, None] * inverse))


def _damped(bodies: Sequence[Body], wanted: Array, ratios: Mapping[str, float]) -> tuple[Body, ...]:
    """With their blocks on the diagonal of `wanted` (modes of all bodies)², ζ times; bodies not named as they are."""
    ends = np.cumsum([0, *(body.n_modes for body in bodies)])
    return tuple(
        replace(body, damping=ratios[body.name] * wanted[first:last, first:last]) if body.name in ratios else body
        for body, (first, last) in zip(bodies, pairwise(ends), strict=True)
    )
