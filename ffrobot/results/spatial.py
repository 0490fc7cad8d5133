"""Results files of scenes in space (HDF5): one group per analysis, written whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import h5py
import numpy as np

from ..actuation.control.linear_models import LinearModels
from ..actuation.control.loop_record import LoopRecord
from ..actuation.control.placing import Placed
from ..common.checksum import sealed
from ..common.files import write_atomically
from ..mbs.analysis.inverted_path import AroundPath
from ..mbs.analysis.outcome import Outcome
from ..mbs.analysis.spatial_motors_only import path_errors
from ..mbs.analysis.tracking import TrackedPath
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.spatial_motion import SpatialMotion
from ..mbs.solve.spatial_redundancy import resolving_joints
from ..run.spatial_solution import SpatialResult, SpatialSolution
from .actuators import write_placement, write_point_forces, write_structure
from .bodies import write_bending, write_stress
from .control import write_loop
from .forces import write_path, write_zero_dynamics
from .linear import write_spatial_linear
from .peaks import write_peaks
from .spatial_actuation import write_actuation, write_tracking
from .spatial_resume import write_state_in_space
from .write import (
    write_attributes,
    write_check,
    write_head,
    write_judgement,
    write_mode_errors,
    write_steps,
    write_texts,
)


def write_spatial_results(solution: SpatialSolution, path: Path) -> None:
    """Write every analysis of a solution to `path`. Raises `SolveError` where that fails; no half file is left."""
    write_atomically(path, sealed(spatial_image(solution)), "results file")


def spatial_image(solution: SpatialSolution) -> bytes:
    """The content of the results file of a solution."""
    with h5py.File("results", "w", driver="core", backing_store=False) as file:
        write_head(file, solution.scene.name, solution.scene.text, solution.bodies)
        file.attrs["space"] = solution.scene.space
        file.attrs["geometric_stiffening"] = solution.is_stiffened
        file.attrs.create("skipped", [*solution.omissions, *solution.notes], dtype=h5py.string_dtype())
        for name, result in solution.analyses.items():
            group, closer = file.create_group(name), result.closer
            _write_analysis(group, solution, result)
            write_peaks(group, None if closer is None else partial(_write_analysis, solution=solution, result=closer))
            if solution.mode_choice is not None:
                write_mode_errors(file[name], name, solution.mode_choice)
            if isinstance(result.run.details, LinearModels):
                write_spatial_linear(file[name], result.motion, result.run.details)
        if (run := solution.unread) is not None:
            _write_run(file.create_group(run.analysis.name), run, run.statistics.warnings, ())
        write_state_in_space(file, solution)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def _write_analysis(group: h5py.Group, solution: SpatialSolution, result: SpatialResult) -> None:
    run, motion = result.run, result.motion
    _write_run(group, run, result.warnings, result.notes)
    group.attrs["stiffening_effect"] = result.stiffening_effect
    write_judgement(group, result)
    if joints := resolving_joints(motion.model):
        group.attrs.update({"redundancy": motion.model.scene.redundancy, "resolved_by": joints})
    write_check(group, result.check)
    _write_bodies(group, solution, result)
    write_bending(group, result.bending)
    _write_joints(group, solution, result)
    write_structure(group, {name: body.structure for name, body in solution.bodies.items() if body.structure})
    for point, shift in result.predicted_shift.items():
        group[f"points/{point}/predicted_shift"] = motion.space.along(shift)
    for body, forces in result.point_forces.items():
        write_point_forces(group.create_group(f"actuation_points/{body}"), solution.points[body], forces, motion.space)
    for body, stress in result.stresses.items():
        write_stress(group.create_group(f"stress/{body}"), stress)
    if isinstance(run.details, LoopRecord):
        write_loop(group, run.details)
    if isinstance(run.details, TrackedPath):
        write_tracking(group, motion, run.details)
    if isinstance(run.details, Placed):
        write_placement(group, run.details)
    _write_paths(group, result)
    for key, values in vars(result.energies).items():
        group[f"energy/{key}"] = values
    group["momentum/linear"] = motion.space.along(result.momentum.linear)
    group["momentum/angular"] = motion.space.about(result.momentum.angular)
    if result.actuation is not None:
        write_actuation(group, solution, result.actuation)
    violation = group.create_dataset("constraint_violation", data=motion.violation)
    violation.attrs["columns"] = ["position", "velocity", "acceleration"]


def _write_paths(group: h5py.Group, result: SpatialResult) -> None:
    """Trajectories/ that hold in an analysis, or that motors alone follow; paths stand still before and after."""
    run, motion, details = result.run, result.motion, result.run.details
    inside, errors = np.clip(run.time, 0.0, run.analysis.last_time), {}
    if isinstance(details, AroundPath) and details.inversion is not None:
        errors = path_errors(details.inversion, run.time, run.q)
        write_zero_dynamics(group, details.inversion)
    for trajectory in motion.model.scene.trajectory if errors else motion.followed:
        entry = group.create_group(f"trajectories/{trajectory.name}")
        if errors:
            entry["error"] = errors[trajectory.name]
        else:
            entry["force"] = motion.path_force(trajectory.name)
        entry.attrs["components"] = list(trajectory.force_components)
        if functions := list(trajectory.components.values()):
            entry["target"] = np.stack([function.sample(inside)[0] for function in functions], axis=1)
        write_path(entry, trajectory)


def _write_run(group: h5py.Group, run: Outcome, warnings: Sequence[str], notes: Sequence[str]) -> None:
    """What is known of a run whether it has outputs or not."""
    write_attributes(group, run)
    write_texts(group, warnings, notes)
    group["time"] = run.time
    write_steps(group, run.statistics.step_ends, run.statistics.integrator.name)


def _write_bodies(group: h5py.Group, solution: SpatialSolution, result: SpatialResult) -> None:
    motion = result.motion
    for name, points in motion.points.items():
        body, moved = solution.bodies[name].spatial, motion.body(name)
        F_p, T = None if motion.motor_forces is None else motion.motor_forces.modal[name], body.modal_transform
        about = "modes of the modal body file"
        if motion.space.is_plane and T.shape[1] < T.shape[0]:  # of those that move in the plane
            group[f"bodies/{name}/modal_transform"] = T
            about = "modes of the modal body file are modal_transform times these"
            p, p_dot = (np.linalg.lstsq(T, values.T, rcond=None)[0].T for values in (moved.modal, moved.modal_velocity))
            F_p, moved = None if F_p is None else F_p @ T, replace(moved, modal=p, modal_velocity=p_dot)
        angle = motion.angle(name) if motion.space.is_plane else moved.orientation
        for key, values in moved.within(motion.space, angle).datasets.items():
            group[f"bodies/{name}/{key}"] = values
        if F_p is not None:
            group[f"bodies/{name}/modal_force"] = F_p
        if motion.space.is_plane or name in solution.links:
            group[f"bodies/{name}"].attrs.update({"modal_coordinates": about, "modes_kept": modes_kept(body)})
        if name in solution.divided:
            group[f"bodies/{name}"].attrs["pieces"] = len(solution.divided[name].names)
        for label in points:
            for key, values in motion.point(f"{name}.{label}").within(motion.space).datasets.items():
                group[f"points/{name}.{label}/{key}"] = values


def _write_joints(group: h5py.Group, solution: SpatialSolution, result: SpatialResult) -> None:
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


def _write_gear(entry: h5py.Group, motion: SpatialMotion, joint: str) -> None:
    """What a gear that gives adds to a joint."""
    if (motor := motion.motor_motion(joint)) is not None:
        entry["motor_angle"], entry["motor_rate"] = motor
    if (moment := motion.gear_moment(joint)) is not None:
        entry["gear_moment"] = moment
    if (gear := motion.gears.get(joint)) is not None:
        entry.attrs["unresolved"] = gear.unresolved
