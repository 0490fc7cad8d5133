"""Motors that turn frames of bodies, not sections, as the core takes them: core/recursion/motion/frame_motor.h."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...common.arrays import Array
from .. import _core
from .drives import Command
from .model import Model
from .parts import rows_of


def turning_motors(model: Model) -> list[str]:
    """Joints with one angle, that of sections, whose motors turn frames in place of these."""
    if model.scene.motors != "frame":
        return []
    tree = model.tree
    return [
        joint.name
        for joint in model.scene.motor_joints
        if joint.units == ("rad",) and not tree.nodes[tree.carried[joint.name]].inner.still
    ]


def motor_commands(model: Model) -> Iterator[Command]:
    """What a unit of each motor does, in the order of `Model.motors`, on the second side of its joint."""
    turning = turning_motors(model)
    for joint, columns in model.motors.items():
        frame = (model.tree.carried[joint], model.sign(joint)) if joint in turning else None
        yield from (Command(direction, frame) for direction in model.sign(joint) * np.eye(model.tree.n_v)[columns])


def zero_order_hold(model: Model, commands: Sequence[Command]) -> _core.ZeroOrderHold:
    """Forces of commands that are held, in their order."""
    found = _core.ZeroOrderHold(np.reshape([c.direction for c in commands], (len(commands), model.tree.n_v)).T)
    for number, command in enumerate(commands):
        for share in _shares(model, *command.frame) if command.frame is not None else ():
            found.add_frame_motor(number, *share)
    return found


def _shares(model: Model, body: int, sign: float) -> Iterator[tuple[int, int, Array, Array]]:
    """Of the motor on frames along the joint that carries a body, for each side with modes.

    Where the modes are in q and in v, Φ_r (3, n) of the section and the joint's axis there.
    """
    node = model.tree.nodes[body]
    for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
        if section.body >= 0 and (of := model.tree.nodes[section.body]).body.n_modes:
            axis = sign * side * section.triad[:, 2]
            yield of.p_q.start, of.p_v.start, rows_of(of.body, section)[0][3:], axis
