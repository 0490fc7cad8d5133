"""Motion of bodies and points in results files, stresses in the bodies, forces along trajectories and in joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import h5py
import numpy as np

from ..common.arrays import Array, Indices
from ..common.meanings import write_record
from ..common.peaks import largest, root_mean_square
from ..mbs.model.model import path_errors
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.stress import BodyStress, Recovery, SectionLoads, mode_displacement
from ..mbs.quantities.validity import Bending
from ..mbs.scene.trajectories import Trajectory
from ..run.solution import AnalysisResult, Solution
from .verdict import attributes_of

if TYPE_CHECKING:
    from ..mbs.inversion.stable_inversion import Inversion

SAME = 1e-9  # of a time: what differs by less is rounding


def write_bodies(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Of an analysis: bodies/ and points/; modes of planar scenes are those that move in the plane."""
    motion, histories = result.motion, result.histories
    forces = histories.motion.motor_forces
    for name, points in motion.points.items():
        body, moved = solution.bodies[name].spatial, motion.body(name)
        F_p, T = None if forces is None else forces.modal[name][histories.outputs], body.modal_transform
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
                if key != "deflection":  # which has peaks
                    group[f"points/{name}.{label}/{key}"] = values


def write_bending(group: h5py.Group, links: Mapping[str, Bending]) -> None:
    """How far flexible bodies leave small deformations: attributes of bodies/BODY."""
    for name, link in links.items():
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


def read_modal(group: h5py.Group, body: str) -> Array:
    """P (T, n) of a flexible body of an analysis, in the modes of its modal body file."""
    entry = group[f"bodies/{body}"]
    p: Array = entry["modal"][()]
    return p @ entry["modal_transform"][()].T if "modal_transform" in entry else p


def read_recovery(group: h5py.Group, body: str) -> Recovery:
    """What stresses of a flexible body of an analysis are computed from; in old files modal coordinates alone."""
    if f"stress/{body}/modal" not in group:
        return mode_displacement(read_modal(group, body))
    entry = group[f"stress/{body}"]
    names = tuple(str(name) for name in entry["loads"].attrs["columns"])
    layers = {key: values[()] for key, values in entry["layers"].items()} if "layers" in entry else None
    sections = None if layers is None else SectionLoads(**layers)
    return Recovery(str(entry.attrs["method"]), entry["modal"][()], names, entry["loads"][()], sections)


def write_stress(group: h5py.Group, stress: BodyStress, outputs: Indices) -> None:
    """Of one body, at its stress points and on its surface at `outputs`, and what they were computed from."""
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
        entry.attrs["components"] = list(trajectory.force_components)
        if functions := list(trajectory.components.values()):
            target = [function.sample(inside)[0] for function in functions]
            entry["target"] = target[0] if trajectory.coordinate_of else np.stack(target, axis=1)
        _write_path(entry, trajectory)


def write_off_path(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """How far a replay is off the paths that its actuation follows, at outputs and between: off_path/."""
    source, run, motion = str(group.attrs["actuation"]), result.histories.run, result.histories.motion
    if source not in solution.analyses or attributes_of(group, "control") or not len(run.time):
        return
    of, last = group.parent[source], solution.analyses[source].analysis.last_time
    both = (run.time >= of["time"][0]) & (run.time <= of["time"][-1] * (1.0 + SAME))
    inside = np.clip(run.time[both], 0.0, last)
    for trajectory in motion.model.scene.trajectory:
        if f"trajectories/{trajectory.name}/target" in of and trajectory.point is not None and trajectory.components:
            position = motion.point(trajectory.point).position[both]
            off = [position[:, "xyz".index(axis)] - f.sample(inside)[0] for axis, f in trajectory.components.items()]
            distance = np.linalg.norm(off, axis=0)
            entry = group.create_group(f"off_path/{trajectory.name}")
            entry.attrs["point"], entry.attrs["distance"] = trajectory.point, largest(run.time[both], distance)[0]
            entry.attrs["distance_rms"] = root_mean_square(run.time[both], distance)


def _write_zero_dynamics(group: h5py.Group, inversion: Inversion) -> None:
    """Of motors-only inverse dynamics: zero_dynamics/."""
    from ..mbs.inversion.motors_only import is_minimum_phase

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
    """Of an analysis: joints/, what has no peaks."""
    motion = result.motion
    for joint in solution.scene.joint:
        entry = group.create_group(f"joints/{joint.name}")
        entry.attrs["type"] = joint.type
        if result.sharing is not None and joint.name in result.sharing.components:
            entry.attrs["indeterminate"] = list(result.sharing.components[joint.name])
        if (found := motion.joint(joint.name)) is not None:
            entry["coordinate"] = np.squeeze(found[0], 1) if len(joint.units) == 1 else found[0]
        if (motor := motion.motor_motion(joint.name)) is not None:
            entry["motor_coordinate"] = motor[0]
            entry["motor_angle"] = entry["motor_coordinate"]  # the same dataset under its former name
        if (gear := motion.gears.get(joint.name)) is not None:
            entry.attrs["unresolved"] = gear.unresolved
