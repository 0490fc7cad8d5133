"""Motion of bodies and points in results files, and stresses in the bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import h5py
import numpy as np

from ..common.arrays import Array
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.stress import BodyStress, Recovery, SectionLoads, mode_displacement
from ..mbs.quantities.validity import Bending
from ..run.solution import AnalysisResult, Solution


def write_bodies(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Of an analysis: bodies/ and points/; modes of planar scenes are those that move in the plane."""
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
                "position_error": link.position_error,
                "relative_error": link.relative_error,
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


def write_stress(group: h5py.Group, stress: BodyStress) -> None:
    """Of one body, at its stress points and on its surface, and what they were computed from."""
    group.attrs["method"] = stress.recovery.method
    group["modal"] = stress.recovery.modal
    group["loads"] = stress.recovery.sizes
    group["loads"].attrs.create("columns", list(stress.recovery.loads), dtype=h5py.string_dtype())
    if stress.recovery.sections is not None:
        for key, values in vars(stress.recovery.sections).items():
            group[f"layers/{key}"] = values
    for name, point in stress.points.items():
        for key, values in vars(point).items():
            group[f"points/{name}/{key}"] = values
        group[f"points/{name}/stress"].attrs["columns"] = ["xx", "yy", "zz", "yz", "xz", "xy"]
    if stress.surface is not None:
        for key, values in vars(stress.surface).items():
            group[f"surface/{key}"] = values
