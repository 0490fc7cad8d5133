"""`ffrobot smooth`: from a scene and a recorded motion to what makes the robot vibrate."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ..common.errors import InputError, SolveError, check_known, either, quoted
from ..common.files import AnyPath, check_new_file, check_new_folder
from ..common.structs import struct
from ..exchange.export import Converted, write_content
from ..exchange.motion import (
    JointMotion,
    JointMotions,
    csv_text,
    joint_trajectory_bag,
    joint_trajectory_text,
)
from ..run.watcher import Watcher
from ..scene.load import load_robot
from .candidates import Candidate, candidates
from .diagnosis import Diagnosis, diagnose
from .recording import Limits, limits_of, planned, read_recording
from .robot import Robot
from .servo import Servo, axis_of

KINDS = ("averaged", "slower", "shaped", "inverted")


@struct
class Smoothed:
    """Result of `smooth_motion`.

    Attributes:
        robot: the simulated robot.
        before: diagnosis of the motion as it is.
        limits: of the joints.
        candidates: motions along the same path, simulated, that of `kind` first, then the best; none where the motion
            is good as it is, or nothing can vibrate.
        kind: requested kind of motion: averaged, slower, shaped, inverted; any if empty.
    """

    robot: Robot
    before: Diagnosis
    limits: Limits
    candidates: tuple[Candidate, ...]
    kind: str = ""

    @property
    def verdict(self) -> str:
        """Cause of the vibration as text."""
        return self.before.verdict(self.robot)

    @property
    def best(self) -> Candidate:
        """The motion that settles first, of the requested kind. Raises `SolveError` where there is none."""
        if not self.candidates:
            raise SolveError(f"expected a motion to be improved, found: {self.verdict}")
        if not self.candidates[0].name.startswith(self.kind):
            names = quoted(one.name for one in self.candidates)
            raise SolveError(f"expected a motion that is {self.kind}", names)
        return self.candidates[0]

    @property
    def own(self) -> Candidate:
        """The motion as it is, to compare with `candidates`."""
        of, ride = self.before.recording, self.before.ride
        shares = (np.vstack([self.before.peaks, ride.torque]) / self.limits.sizes).max(axis=1)
        return Candidate(
            "as it is",
            of.times,
            of.values,
            None,
            ride,
            off_path=0.0,
            excess=float(shares[:3].max()),
            torque=float(shares[3]),
        )

    def write(self, output: AnyPath, *, force: bool = False) -> None:
        """Write the best motion as a JointTrajectory (`.json`), a table (`.csv`) or a bag of ROS 2 (`.rosbag2`).

        Raises:
            InputError: another ending, or a file would be replaced without `force`.
            SolveError: as `best`, or `rosbags` is not installed.
        """
        path, new = Path(output), self.best
        make = maker_of(path)
        rates = np.gradient(new.command, new.times, axis=0)
        rates[[0, -1]] = 0.0  # at rest, which controllers of trajectories ask for
        torques = [None] * len(self.robot.joints) if new.moments is None else new.moments.T
        joints = map(JointMotion, self.robot.joints, new.command.T, rates.T, torques)
        motion = JointMotions("smooth", new.times, tuple(joints), ())
        write_content(path, make(motion)[0], force=force)


BAG = ".rosbag2"  # a folder
MAKERS: Mapping[str, Callable[[JointMotions], Converted]] = {
    ".json": joint_trajectory_text, ".csv": csv_text, BAG: joint_trajectory_bag
}  # fmt: skip


def maker_of(path: Path) -> Callable[[JointMotions], Converted]:
    """Return the writer for a motion file by its suffix. Raises `InputError` unless it is one of `MAKERS`."""
    if path.suffix not in MAKERS:
        raise InputError(f"{path}: expected a name that ends in {either(MAKERS)}", f'"{path.name}"')
    return MAKERS[path.suffix]


def check_target(path: Path, *, force: bool) -> None:
    """Raise `InputError` for a name to which `Smoothed.write` would not write, before any work is done."""
    maker_of(path)
    if path.suffix == BAG:
        check_new_folder(path)
    else:
        check_new_file(path, replace=force)


def smooth_motion(
    scene: AnyPath,
    path: AnyPath | None = None,
    *,
    servo: float | str | Mapping[str, float | str] = 20.0,
    damping_ratio: float = 0.8,
    point: str | None = None,
    settled: float = 1e-4,
    acceleration: float = np.inf,
    jerk: float = np.inf,
    degrees: bool = False,
    rate: float = 125.0,
    kind: str = "",
    watcher: Watcher | None = None,
) -> Smoothed:
    """Find why a robot vibrates on a recorded or planned motion, and a motion that leaves less: `ffrobot smooth`.

    Args:
        scene: a scene file; its analyses are not needed.
        path: CSV, JSON or YAML with a JointTrajectory, or a bag of ROS; None: the trajectories of the scene.
        servo: position controllers of all joints or by joint: natural frequency (Hz), "NUMERATOR / DENOMINATOR", or a
            CSV table. Polynomials have the highest power first; "/ DELAY" (s) may follow. The table is a measured
            response: frequency (Hz), magnitude, phase (degrees).
        damping_ratio: of controllers given by a frequency.
        point: "BODY.POINT" whose vibration counts; None: the tool.
        settled: m, within which of its final place the point has to stay.
        acceleration: limit of all joints, rad/s² or m/s².
        jerk: limit of all joints, rad/s³ or m/s³.
        degrees: whether angles in the file are in degrees.
        rate: of set points of the new motion, Hz.
        kind: requested kind of motion: averaged, slower, shaped, inverted; empty: the one that settles first.
        watcher: an object that observes progress and can stop the run.

    Returns:
        The diagnosis: `verdict` in words, `before.faults`, `before.residual` (m, peak to peak), …; and motions along
        the same path: `best.times` (T,) s, `best.command` (T, n) rad or m by `robot.joints`, `best.residual`, ….

    Raises:
        InputError: the file has other joints, or is no motion.
        SolveError: the robot cannot follow it.

    Example:
        found = ffrobot.smooth_motion("scene.toml", "recorded.csv", servo=15.0)
        print(found.verdict)
        found.write("smooth.json")
    """
    loaded, watcher = load_robot(Path(scene)), watcher or Watcher()
    if not loaded.motor_joints:
        raise InputError(f"{loaded.path}: expected joints with motors", "none")
    if kind:
        check_known(kind, KINDS, f"kind: expected one of {quoted(KINDS)}")
    if not 10.0 <= rate <= 10_000.0:
        raise InputError("rate: expected 10 to 10000 Hz", f"{rate:g}")
    joints = [joint.name for joint in loaded.motor_joints]
    by_joint = servo if isinstance(servo, Mapping) else dict.fromkeys(joints, servo)
    expected = f"{loaded.path}: servo: expected one controller of each of {quoted(joints)}"
    for joint in by_joint:
        check_known(joint, joints, expected)
    if missing := [joint for joint in joints if joint not in by_joint]:
        raise InputError(expected, f"none of {quoted(missing)}")
    controllers = Servo(tuple(axis_of(by_joint[joint], damping_ratio) for joint in joints))
    watcher.stage("motion")
    read = planned(loaded, 1 / rate, watcher) if path is None else read_recording(
        Path(path), loaded, is_in_degrees=degrees
    )  # fmt: skip
    robot = Robot(loaded, controllers, point, settled, watcher)
    limits = limits_of(loaded, acceleration, jerk)
    before = diagnose(robot, read, limits)
    has_rest = before.frequencies.size and before.ride.settling is not None
    needed = has_rest and (before.residual > settled or before.faults)
    new = candidates(robot, before, limits, 1 / rate, kind) if needed else ()
    return Smoothed(robot, before, limits, tuple(new), kind)
