"""Motion of bodies and points in results files, stresses in the bodies, forces along trajectories and in joints."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np

from ..common.arrays import Array, Indices
from ..common.hdf5 import fields_in
from ..common.meanings import write_record
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.motion import body_motion, joint_motion, plane_angle, point_motion, point_names, reported_points
from ..mbs.quantities.stress import BodyStress, Recovery, SectionLoads, mode_displacement
from ..mbs.quantities.supply import actuator_forces, followed_trajectories, gear_motions, motor_motion
from ..run.result import AnalysisResult, Solution


def write_bodies(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Write bodies/ of an analysis; modes of planar scenes are those that move in the plane."""
    run, histories = result.run, result.histories
    forces = actuator_forces(histories.run)
    for name in reported_points(run):
        body, moved = solution.bodies[name].spatial, body_motion(run, name)
        F_p, T = None if forces is None else forces.modal[name][histories.outputs], body.modal_transform
        about = "modes of the modal body file"
        if run.space.is_plane and T.shape[1] < T.shape[0]:  # of those that move in the plane
            group[f"bodies/{name}/modal_transform"] = T
            about = "modes of the modal body file are modal_transform times these"
            p, p_dot = (np.linalg.lstsq(T, values.T, rcond=None)[0].T for values in (moved.modal, moved.modal_velocity))
            F_p, moved = None if F_p is None else F_p @ T, replace(moved, modal=p, modal_velocity=p_dot)
        angle = plane_angle(run, name) if run.space.is_plane else moved.orientation
        for key, values in moved.within(run.space, angle).datasets.items():
            group[f"bodies/{name}/{key}"] = values
        if F_p is not None:
            group[f"bodies/{name}/modal_force"] = F_p
        if run.space.is_plane or name in solution.links:
            group[f"bodies/{name}"].attrs.update({"modal_coordinates": about, "modes_kept": modes_kept(body)})
        if name in solution.divided:
            group[f"bodies/{name}"].attrs["pieces"] = len(solution.divided[name].names)
    for name, link in result.bending.items():
        group[f"bodies/{name}"].attrs.update(
            {
                "largest_deflection": link.deflection,
                "largest_rotation": link.rotation,
                "foreshortening": link.foreshortening,
                "foreshortening_moment": link.foreshortening_moment,
                "stiffness_change": link.stiffness_change,
                "position_error": link.missing.of_length,
                "relative_error": link.missing.of_deflections,
            }
        )


def write_points(group: h5py.Group, result: AnalysisResult) -> None:
    """Write points/ of an analysis, except quantities with peaks."""
    run = result.run
    for place in point_names(run):
        if result.wants(f"points/{place}"):
            for key, values in point_motion(run, place).within(run.space).datasets.items():
                if key != "deflection":  # which has peaks
                    group[f"points/{place}/{key}"] = values
        if result.wants(f"points/{place}/predicted_shift") and place in result.predicted_shift:
            group[f"points/{place}/predicted_shift"] = run.space.along(result.predicted_shift[place])


def read_modal(group: h5py.Group, body: str) -> Array:
    """Modal coordinates (T, n), √kg·m, of a flexible body of an analysis, in the modes of its modal body file."""
    entry = group[f"bodies/{body}"]
    p: Array = entry["modal"][()]
    return p @ entry["modal_transform"][()].T if "modal_transform" in entry else p


def read_recovery(group: h5py.Group, body: str) -> Recovery:
    """Read the data for stresses of a flexible body in an analysis; old files contain modal coordinates alone."""
    if f"stress/{body}/modal" not in group:
        return mode_displacement(read_modal(group, body))
    entry = group[f"stress/{body}"]
    names = tuple(str(name) for name in entry["loads"].attrs["columns"])
    sections = None
    if "layers" in entry:
        layers = fields_in(entry["layers"], SectionLoads)
        sections = SectionLoads(**{key: values[()] for key, values in layers.items()})
    return Recovery(str(entry.attrs["method"]), entry["modal"][()], names, entry["loads"][()], sections)


def write_stress(group: h5py.Group, stress: BodyStress, outputs: Indices) -> None:
    """Write stresses of a body at stress points and on its surface at `outputs`, and the data for them."""
    recovery = stress.recovery.at(outputs)
    group.attrs["method"] = recovery.method
    group["modal"] = recovery.modal
    group["loads"] = recovery.sizes
    group["loads"].attrs.create("columns", list(recovery.loads), dtype=h5py.string_dtype())
    if recovery.sections is not None:
        write_record(group.create_group("layers"), recovery.sections)
    for name, point in stress.points.items():
        group[f"points/{name}/stress"] = point.stress[outputs]
        group[f"points/{name}/stress"].attrs["columns"] = ["xx", "yy", "zz", "yz", "xz", "xy"]
    if stress.surface is not None:
        group["surface/position_of_max"] = stress.surface.position_of_max[outputs]


def write_paths(group: h5py.Group, result: AnalysisResult) -> None:
    """Write trajectories/ of an analysis: prescribed or followed paths, constant before and after their duration.

    Of paths made of legs also when they begin and are over, and what was found for them.
    """
    run, details = result.run, result.run.details
    inside = np.clip(run.time, 0.0, run.analysis.last_time)
    errors = {} if details.held is None else details.held.path_errors(run.time, run.q)
    for trajectory in run.model.scene.trajectory if errors else followed_trajectories(run):
        entry = group.create_group(f"trajectories/{trajectory.name}")
        if errors:
            entry["error"] = errors[trajectory.name]
        entry.attrs["components"] = list(trajectory.force_components)
        if functions := list(trajectory.components.values()):
            target = [function.sample(inside)[0] for function in functions]
            entry["target"] = target[0] if trajectory.coordinate_of else np.stack(target, axis=1)
        if (path := trajectory.path) is not None:
            entry.attrs.update(begin=path.begin, end=path.end, stretch=trajectory.stretch)
            if trajectory.shaper is not None and trajectory.shaper.frequency is not None:
                entry.attrs["shaper_frequency"] = np.atleast_1d(trajectory.shaper.frequency)


def write_joints(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Write joints/ of an analysis, except quantities with peaks."""
    run = result.run
    for joint in solution.scene.joint:
        entry = group.create_group(f"joints/{joint.name}")
        entry.attrs["type"] = joint.type
        if result.sharing is not None and joint.name in result.sharing.components:
            entry.attrs["indeterminate"] = list(result.sharing.components[joint.name])
        if (moving := joint_motion(run, joint.name)) is not None:
            entry["coordinate"] = np.squeeze(moving[0], 1) if len(joint.units) == 1 else moving[0]
        if (motor := motor_motion(run, joint.name)) is not None:
            entry["motor_coordinate"] = motor[0]
            entry["motor_angle"] = entry["motor_coordinate"]  # the same dataset under its former name
        if (gear := gear_motions(run).get(joint.name)) is not None:
            entry.attrs["unresolved"] = gear.unresolved
