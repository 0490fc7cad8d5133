"""`ffrobot smooth`: from a scene and a recorded motion to what makes the robot vibrate."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..common.errors import InputError, did_you_mean, quoted
from ..common.files import AnyPath
from ..common.structs import struct
from ..run.watcher import Watcher
from ..scene.load import load_robot
from ..scene.scene import Scene
from .diagnosis import Diagnosis, diagnose
from .recording import limits_of, planned, read_recording
from .robot import Robot
from .servo import Servo

STEP = 0.008  # s, of set points of a trajectory of the scene


@struct
class Smoothed:
    """What `smooth_motion` found: the `robot` that was simulated, and the motion as it is, `before`."""

    robot: Robot
    before: Diagnosis

    @property
    def verdict(self) -> str:
        """In words what makes the robot vibrate."""
        return self.before.verdict(self.robot)


def smooth_motion(
    scene: AnyPath,
    path: AnyPath | None = None,
    *,
    bandwidth: float | Mapping[str, float] = 20.0,
    damping_ratio: float = 0.8,
    point: str | None = None,
    settled: float = 1e-4,
    acceleration: float = np.inf,
    jerk: float = np.inf,
    degrees: bool = False,
    watcher: Watcher | None = None,
) -> Smoothed:
    """Find out why a robot vibrates that follows a recorded or planned motion: `ffrobot smooth`.

    Args:
        scene: a scene file; its analyses are not needed.
        path: CSV, JSON or YAML with a JointTrajectory, or a bag of ROS; None: the trajectories of the scene.
        bandwidth: natural frequency of position controllers, Hz, of all joints or by joint.
        damping_ratio: of these controllers, between 0 and 1.
        point: "BODY.POINT" whose vibration counts; None: the tool.
        settled: m, within which of its final place the point has to stay.
        acceleration: limit of all joints, rad/s² or m/s².
        jerk: limit of all joints, rad/s³ or m/s³.
        degrees: whether angles in the file are in degrees.
        watcher: an object that observes progress and can stop the run.

    Returns:
        The diagnosis: `verdict` in words, `before.faults`, `before.residual` (m, peak to peak), ….

    Raises:
        InputError: the file has other joints, or is no motion.
        SolveError: the robot cannot follow it.

    Example:
        found = ffrobot.smooth_motion("scene.toml", "recorded.csv", bandwidth=15.0)
        print(found.verdict)
    """
    loaded, watcher = load_robot(Path(scene)), watcher or Watcher()
    if not loaded.motor_joints:
        raise InputError(f"{loaded.path}: expected joints with motors, found none")
    servo = _servo(loaded, bandwidth, damping_ratio)
    watcher.stage("motion")
    read = planned(loaded, STEP, watcher) if path is None else read_recording(
        Path(path), loaded, is_in_degrees=degrees
    )  # fmt: skip
    robot = Robot(loaded, servo, point, settled, watcher)
    return Smoothed(robot, diagnose(robot, read, limits_of(loaded, acceleration, jerk)))


def _servo(scene: Scene, bandwidth: float | Mapping[str, float], ratio: float) -> Servo:
    """The controllers of all joints with motors."""
    joints = [joint.name for joint in scene.motor_joints]
    by_joint = bandwidth if isinstance(bandwidth, Mapping) else dict.fromkeys(joints, bandwidth)
    if by_joint.keys() != set(joints):
        wrong = next(iter(by_joint.keys() ^ set(joints)))
        raise InputError(
            f'{scene.path}: bandwidth: expected one of all of {quoted(joints)}, found "{wrong}" in only one of both'
            f"{did_you_mean(wrong, joints)}"
        )
    values = np.array([by_joint[joint] for joint in joints])
    if not (np.isfinite(values).all() and (values > 0.0).all() and 0.0 < ratio < 1.0):
        raise InputError(
            f"bandwidth: expected frequencies above 0 Hz and a damping ratio between 0 and 1, found {values.min():g} Hz"
            f" and {ratio:g}"
        )
    return Servo(2 * np.pi * values, ratio)
