"""Motions in the layout of ROS 2's trajectory_msgs/JointTrajectory, as JSON with the message's own names."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ...common.arrays import as_list, as_rows
from .joints import RobotMotion

NANO = 1_000_000_000


def joint_trajectory(motion: RobotMotion) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The message, of joints with a motor; and remarks on what it leaves out.

    Accelerations stay empty, as the message allows: results have none of joints. Where no joint has a motor, all are
    taken, without effort.
    """
    driven = [joint for joint in motion.joints if joint.moment is not None]
    moments = [joint.moment for joint in motion.joints if joint.moment is not None]
    joints, left = driven or list(motion.joints), [joint.name for joint in motion.joints if joint.moment is None]
    remarks = list(motion.remarks)
    if driven and left:
        remarks.append(f"joints without motor left out: {', '.join(left)}")
    if not driven:
        remarks.append("no joint has a motor: effort is left empty")
    positions, velocities = (
        np.stack([getattr(joint, key) for joint in joints], axis=1) for key in ("coordinate", "rate")
    )
    efforts = np.stack(moments, axis=1) if moments else np.zeros((len(motion.time), 0))
    points = [
        {
            "positions": position,
            "velocities": velocity,
            "accelerations": [],
            "effort": effort,
            "time_from_start": _duration(time),
        }
        for position, velocity, effort, time in zip(
            as_rows(positions), as_rows(velocities), as_rows(efforts), as_list(motion.time), strict=True
        )
    ]
    message = {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": [joint.name for joint in joints],
        "points": points,
    }
    return message, tuple(remarks)


def joint_trajectory_text(motion: RobotMotion) -> tuple[str, tuple[str, ...]]:
    """The message as JSON, a line for each point; and remarks."""
    message, remarks = joint_trajectory(motion)
    points = ",\n".join(json.dumps(point) for point in message.pop("points"))
    head = json.dumps(message, ensure_ascii=False)
    return f'{head[:-1]}, "points": [\n{points}\n]}}\n', remarks


def _duration(time: float) -> dict[str, int]:
    """builtin_interfaces/Duration, to the nearest nanosecond."""
    sec, nanosec = divmod(round(time * NANO), NANO)
    return {"sec": sec, "nanosec": nanosec}
