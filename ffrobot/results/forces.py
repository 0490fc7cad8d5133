"""Forces along trajectories and in joints in results files, and how a path was inverted for motors alone."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from ..mbs.model.model import path_errors
from ..mbs.quantities.motion import RobotMotion
from ..mbs.scene.trajectories import Trajectory
from ..mbs.solve.stable_inversion import Inversion
from ..run.solution import AnalysisResult, Solution


def write_paths(group: h5py.Group, result: AnalysisResult) -> None:
    """Of an analysis: trajectories/ that hold in it, or that motors alone follow; at rest before and after."""
    run, motion, details = result.run, result.motion, result.run.details
    inside = np.clip(run.time, 0.0, run.analysis.last_time)
    errors = {} if details.held is None else path_errors(details.held, run.time, run.q)
    if (inversion := getattr(details, "inversion", None)) is not None:
        _write_zero_dynamics(group, inversion)
    for trajectory in motion.model.scene.trajectory if errors else motion.followed:
        entry = group.create_group(f"trajectories/{trajectory.name}")
        if errors:
            entry["error"] = errors[trajectory.name]
        else:
            entry["force"] = motion.path_force(trajectory.name)
        entry.attrs["components"] = list(trajectory.force_components)
        if functions := list(trajectory.components.values()):
            entry["target"] = np.stack([function.sample(inside)[0] for function in functions], axis=1)
        _write_path(entry, trajectory)


def _write_zero_dynamics(group: h5py.Group, inversion: Inversion[Any]) -> None:
    """Of motors-only inverse dynamics: zero_dynamics/."""
    from ..mbs.analysis.motors_only import is_minimum_phase

    entry = group.create_group("zero_dynamics")
    entry["time"] = inversion.linearisation.times
    entry["zeros"] = np.stack([inversion.linearisation.zeros.real, inversion.linearisation.zeros.imag], axis=2)
    entry.attrs["columns"] = ["real", "imaginary"]
    entry.attrs["factor"] = inversion.servo.factor
    entry.attrs["minimum_phase"] = is_minimum_phase(inversion.linearisation)
    entry.attrs["unmet_force"] = inversion.unmet
    entry.attrs["off_rest"] = inversion.off_rest


def _write_path(entry: h5py.Group, trajectory: Trajectory) -> None:
    """When a path made of legs begins and is over, and what was found for it."""
    if trajectory.path is None:
        return
    entry.attrs["begin"], entry.attrs["end"] = trajectory.path.begin, trajectory.path.end
    entry.attrs["stretch"] = trajectory.stretch
    if trajectory.shaper is not None and trajectory.shaper.frequency is not None:
        entry.attrs["shaper_frequency"] = np.atleast_1d(trajectory.shaper.frequency)


def write_joints(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Of an analysis: joints/."""
    motion, motors = result.motion, solution.scene.motor_joints
    for joint in solution.scene.joint:
        entry = group.create_group(f"joints/{joint.name}")
        entry.attrs["type"] = joint.type
        acting = result.reactions[joint.name]
        entry["reaction"] = motion.space.along(acting.force)
        if not (motion.space.is_plane and joint.type == "revolute"):  # it carries no moment about its axis
            entry["reaction_moment"] = motion.space.about(acting.moment)
        if result.sharing is not None and joint.name in result.sharing.components:
            entry.attrs["indeterminate"] = list(result.sharing.components[joint.name])
        if (found := motion.joint(joint.name)) is not None:
            entry["coordinate"], entry["rate"] = (
                np.squeeze(values, 1) if len(joint.units) == 1 else values for values in found
            )
        moment = motion.motor_moments.get(joint.name)
        if moment is not None and joint in motors:
            entry["moment"] = np.squeeze(moment, 1) if len(joint.units) == 1 else moment
            if joint.given_gear_ratio is not None:
                entry["motor_moment"] = entry["moment"][()] / joint.given_gear_ratio
        _write_gear(entry, motion, joint.name)


def _write_gear(entry: h5py.Group, motion: RobotMotion, joint: str) -> None:
    """What a compliant gear adds to a joint."""
    if (motor := motion.motor_motion(joint)) is not None:
        entry["motor_angle"], entry["motor_rate"] = motor
    if (moment := motion.gear_moment(joint)) is not None:
        entry["gear_moment"] = moment
    if (gear := motion.gears.get(joint)) is not None:
        entry.attrs["unresolved"] = gear.unresolved
