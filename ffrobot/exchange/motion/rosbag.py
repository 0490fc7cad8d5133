"""Motions as a rosbag2 of one trajectory_msgs/JointTrajectory, by `rosbags` (extra "ros"); ROS itself is not needed."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...common.extras import extras
from .joint_trajectory import joint_trajectory
from .joints import RobotMotion

TOPIC = "/joint_trajectory"
TYPE = "trajectory_msgs/msg/JointTrajectory"
BAG = "joint_trajectory"  # name of the files in it
VERSION = 8  # of the metadata: what ROS 2 Iron and later write, and Humble reads


def joint_trajectory_bag(motion: RobotMotion) -> tuple[Mapping[str, bytes], tuple[str, ...]]:
    """Files of the bag by name, SQLite storage, with the message at time zero; and remarks.

    Raises:
        SolveError: `rosbags` is not installed.
    """
    with extras():
        from rosbags.rosbag2 import Writer
        from rosbags.typesys import Stores, get_typestore
    types = get_typestore(Stores.ROS2_HUMBLE)
    message, remarks = joint_trajectory(motion)
    with tempfile.TemporaryDirectory(prefix="ffrobot-bag-") as temporary:
        folder = Path(temporary) / BAG
        with Writer(folder, version=VERSION) as writer:
            connection = writer.add_connection(TOPIC, TYPE, typestore=types)
            writer.write(connection, 0, types.serialize_cdr(_ros(message, types.types), TYPE))
        return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}, remarks


def _ros(message: Mapping[str, Any], types: Mapping[str, Any]) -> Any:  # noqa: ANN401 (classes are made at run time)
    """The message as an object of ROS's class."""
    stamp = types["builtin_interfaces/msg/Time"](**message["header"]["stamp"])
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=message["header"]["frame_id"])
    points = [_point(point, types) for point in message["points"]]
    return types[TYPE](header=header, joint_names=message["joint_names"], points=points)


def _point(point: Mapping[str, Any], types: Mapping[str, Any]) -> Any:  # noqa: ANN401
    values = {key: np.array(point[key], dtype=float) for key in ("positions", "velocities", "accelerations", "effort")}
    since = types["builtin_interfaces/msg/Duration"](**point["time_from_start"])
    return types["trajectory_msgs/msg/JointTrajectoryPoint"](**values, time_from_start=since)
