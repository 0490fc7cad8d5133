"""Motion of bodies and points in results files, energies, and stresses in the bodies."""

from __future__ import annotations

from collections.abc import Mapping

import h5py

from ..common.arrays import Array
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.observation import body_motion, energies, modal_force, point_motion, stored_coordinates
from ..mbs.quantities.stress import BodyStress, Recovery, SectionLoads, mode_displacement
from ..mbs.quantities.validity import Bending


def write_motion(group: h5py.Group, outcome: PlanarOutcome) -> None:
    """Of an analysis: bodies/, points/, energy/, and how far the constraints are violated."""
    group["time"] = outcome.time
    for body in outcome.assembly.model.links:
        for key, values in body_motion(outcome, body).datasets.items():
            group[f"bodies/{body.name}/{key}"] = values
        if (F_p := modal_force(outcome, body)) is not None:
            group[f"bodies/{body.name}/modal_force"] = F_p
        transform = stored_coordinates(body)
        about = "modes of the modal body file"
        if transform is not None:
            group[f"bodies/{body.name}/modal_transform"] = transform
            about = "modes of the modal body file are modal_transform times these"
        group[f"bodies/{body.name}"].attrs["modal_coordinates"] = about
        group[f"bodies/{body.name}"].attrs["modes_kept"] = modes_kept(body)
        for label in body.points:
            point = f"{body.name}.{label}"
            for key, values in point_motion(outcome, point).datasets.items():
                group[f"points/{point}/{key}"] = values
    for key, values in energies(outcome).items():
        group[f"energy/{key}"] = values
    violation = group.create_dataset("constraint_violation", data=outcome.residual)
    violation.attrs["columns"] = ["position", "velocity", "acceleration"]


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
