"""Payloads that sections of links turn: rigid bodies, welded to them.

The section turns by exp(φ~), φ = Φ_r p, and they with it: a body of its own in the tree, with the frame at the section
and no freedom, is exact, whatever inertia it has. What rigid bodies carry, and point masses on sections, are exact as
parts of their body.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..joints.weld import WeldJoint
from ..scene.bodies import Payload, tensor
from ..scene.mechanism import MechanismKeys
from .body import Body, rigid_body


def turns_as_a_body(scene: MechanismKeys, payload: Payload) -> bool:
    """Whether turning its section moves it: all but a point mass there, in the plane with its moment of inertia."""
    is_beside = payload.mass and np.any(payload.center)
    return bool(is_beside or (np.any(payload.inertia) and not scene.is_planar))


def welded_payloads(scene: MechanismKeys) -> Iterator[tuple[Body, WeldJoint]]:
    """The payloads on links that turn as bodies, each with what holds it; names that no body of a scene can have."""
    rigid = {body.name for body in scene.body if body.rigid is not None}
    for k, payload in enumerate(scene.payload, 1):
        if turns_as_a_body(scene, payload) and payload.point.partition(".")[0] not in rigid:
            name = f"payload, number {k}"
            body = rigid_body(name, payload.mass, np.array(payload.center), tensor(payload.inertia), {})
            yield body, WeldJoint.model_construct(name=name, type="weld", between=(payload.point, name))
