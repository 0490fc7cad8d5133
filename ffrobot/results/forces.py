"""Forces along trajectories and in joints in results files, and how a path was inverted for motors alone."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from ..mbs.analysis.inverted_path import is_minimum_phase
from ..mbs.analysis.motors_only import InvertedPath, path_error
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.quantities.joint_motion import joint_motions, motor_motion
from ..mbs.quantities.observation import joint_forces, trajectory_force, trajectory_target
from ..mbs.scene.spatial.trajectories import SpatialTrajectory
from ..mbs.scene.trajectories import Trajectory
from ..mbs.solve.stable_inversion import Inversion


def write_forces(group: h5py.Group, outcome: PlanarOutcome) -> None:
    """Of an analysis: trajectories/ that hold in it, and joints/."""
    held = {c.owner for c in outcome.assembly.constraints if c.is_trajectory}
    for trajectory in outcome.assembly.model.scene.trajectory:
        if trajectory.name in held:
            entry = group.create_group(f"trajectories/{trajectory.name}")
            entry["force"] = trajectory_force(outcome, trajectory.name)
            entry["target"] = trajectory_target(outcome, trajectory.name)
            entry.attrs["components"] = list(trajectory.components)
            write_path(entry, trajectory)
    motions = joint_motions(outcome)
    for joint in outcome.assembly.model.scene.joint:
        forces = joint_forces(outcome, joint.name)
        entry = group.create_group(f"joints/{joint.name}")
        entry.attrs["type"] = joint.type
        if joint.name in motions:
            entry["coordinate"], entry["rate"] = motions[joint.name].coordinate, motions[joint.name].rate
        entry["reaction"] = forces.reaction
        if forces.reaction_moment is not None:
            entry["reaction_moment"] = forces.reaction_moment
        if forces.motor is not None:
            entry["moment"] = forces.motor
            if joint.given_gear_ratio is not None:
                entry["motor_moment"] = forces.motor / joint.given_gear_ratio
        if (motor := motor_motion(outcome, joint.name)) is not None:
            entry["motor_angle"], entry["motor_rate"] = motor.coordinate, motor.rate
        if (gear := outcome.gears.get(joint.name)) is not None:
            entry["gear_moment"] = gear.gear_moment
            entry.attrs["unresolved"] = gear.unresolved


def write_inversion(group: h5py.Group, outcome: PlanarOutcome, found: InvertedPath) -> None:
    """Of motors-only inverse dynamics: no force acts on the path's points, which may be off it."""
    inversion = found.inversion
    error, column = path_error(inversion, outcome.time, outcome.q), 0
    for trajectory in outcome.assembly.model.scene.trajectory:
        entry, count = group.create_group(f"trajectories/{trajectory.name}"), len(trajectory.components)
        entry["target"] = trajectory_target(outcome, trajectory.name)
        entry["error"] = error[:, column : column + count]
        entry.attrs["components"] = list(trajectory.components)
        write_path(entry, trajectory)
        column += count
    write_zero_dynamics(group, inversion)


def write_zero_dynamics(group: h5py.Group, inversion: Inversion[Any]) -> None:
    """Of motors-only inverse dynamics: zero_dynamics/."""
    entry = group.create_group("zero_dynamics")
    entry["time"] = inversion.linearisation.times
    entry["zeros"] = np.stack([inversion.linearisation.zeros.real, inversion.linearisation.zeros.imag], axis=2)
    entry.attrs["columns"] = ["real", "imaginary"]
    entry.attrs["factor"] = inversion.servo.factor
    entry.attrs["minimum_phase"] = is_minimum_phase(inversion.linearisation)
    entry.attrs["unmet_force"] = inversion.unmet
    entry.attrs["off_rest"] = inversion.off_rest


def write_path(entry: h5py.Group, trajectory: Trajectory | SpatialTrajectory) -> None:
    """When a path made of legs begins and is over, and what was found for it."""
    if trajectory.path is None:
        return
    entry.attrs["begin"], entry.attrs["end"] = trajectory.path.begin, trajectory.path.end
    entry.attrs["stretch"] = trajectory.stretch
    if trajectory.shaper is not None and trajectory.shaper.frequency is not None:
        entry.attrs["shaper_frequency"] = np.atleast_1d(trajectory.shaper.frequency)
