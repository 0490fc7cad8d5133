"""Why a motion may be wrong, read off the motion itself: one text each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Array
from .motion import RobotMotion

TURN = 2 * np.pi
LEAST = 1e-9  # of the robot's size, or rad: constraints that are off by less are met


def doubts(motion: RobotMotion, tolerance: float) -> Iterator[str]:
    """Of a motion that was found to `tolerance`: constraints that are not met, turns and angles that are in doubt."""
    yield from _violated(motion, max(tolerance, LEAST))
    for one, of_cut in motion.cut:
        if not of_cut.is_counted:
            yield (
                f"{one.joint.label}: outputs are too far apart to count the turns of its coordinate, which may be off"
                " by whole turns: the loop is cut at this joint; choose a smaller output_step"
            )
    for joint in motion.model.scene.joint:
        if max(map(abs, joint.rpy)) > TURN:
            angles = ", ".join(f"{angle:g}" for angle in joint.rpy)
            yield f'{joint.label}: rpy = [{angles}] rad is more than a turn (degrees are written "90*deg")'


def _violated(motion: RobotMotion, allowed: float) -> Iterator[str]:
    """The constraint that is violated most, where that is more than `allowed`, of the robot's size or rad."""
    if not motion.model.rows or not len(motion.time):
        return
    C = np.abs(motion.rows[0])
    is_way = np.array([motion.model.measures_way(row) for row in motion.model.rows])
    share = np.where(is_way, C / _extent(motion), C)
    at, k = np.unravel_index(int(np.argmax(share)), share.shape)  # the first NaN, if there is one
    if not share[at, k] <= allowed:
        row = motion.model.rows[k]
        yield (
            f'{"trajectory" if row.is_trajectory else "joint"} "{row.owner}" is violated by {C[at, k]:.3g}'
            f" {'m' if is_way[k] else 'rad'} at t = {motion.time[at]:.6g} s: the result is not a motion of this robot;"
            " choose a smaller tolerance or another integrator"
        )


def _extent(motion: RobotMotion) -> float:
    """A length (m) of the robot: its largest body, or the space in which its bodies move."""
    places: Array = np.concatenate([frame.r for frame in motion.frames])
    bodies = [
        np.ptp([at.position for at in node.body.points.values()], axis=0)
        for node in motion.model.tree.nodes
        if node.body.points
    ]
    return max(float(np.linalg.norm(size)) for size in (*bodies, np.ptp(places, axis=0))) or 1.0
