"""Where the joints of a planar mechanism stand at t = 0, for the same mechanism in space."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..model.model import Model
from ..model.system import MechanismSystem
from .initial_state import undeformed_state


def start_in_space(model: Model) -> dict[str, dict[str, float]]:
    """`joints` and `joint_rates` of [initial] for all joints that move, with undeformed links and without trajectories.

    Loops are closed here: from joints that do, space finds the same posture, whichever way it would close them itself.

    Raises `InputError` where the scene has no such posture.
    """
    state = undeformed_state(MechanismSystem(model, model.joints))
    coordinates = {joint.name: joint.coordinate("section") for joint in model.scene.joint}
    moving = {name: measure for name, measure in coordinates.items() if measure is not None}
    assembly = MechanismSystem(model, model.joints, (), list(moving.values()))
    along = [(measure, order) for order in (0, 1) for measure in assembly.motor_measures]
    q, v = state.q[None], state.v[None]
    readings = _core.Sensing(assembly.system, along, []).read(q, v, np.zeros_like(v))[0].tolist()
    places, rates = readings[: len(moving)], readings[len(moving) :]
    return {key: dict(zip(moving, of, strict=True)) for key, of in (("joints", places), ("joint_rates", rates))}
