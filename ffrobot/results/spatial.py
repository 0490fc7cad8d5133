"""Results files of scenes in space (HDF5): one group per analysis, written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from ..common.checksum import sealed
from ..common.files import write_atomically
from ..run.spatial import SpatialResult, SpatialSolution
from .spatial_actuation import write_actuation
from .write import write_head


def write_spatial_results(solution: SpatialSolution, path: Path) -> None:
    """Write every analysis of a solution to `path`. Raises `SolveError` where that fails; no half file is left."""
    write_atomically(path, sealed(_image(solution)), "results file")


def _image(solution: SpatialSolution) -> bytes:
    with h5py.File("results", "w", driver="core", backing_store=False) as file:
        write_head(file, solution.scene.name, solution.scene.text, solution.bodies)
        file.attrs["space"] = "spatial"
        file.attrs.create("skipped", list(solution.notes), dtype=h5py.string_dtype())
        for name, result in solution.analyses.items():
            _write_analysis(file.create_group(name), result)
            write_actuation(file[name], solution, result.actuation)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def _write_analysis(group: h5py.Group, result: SpatialResult) -> None:
    run, motion = result.run, result.motion
    group.attrs.update({"kind": run.analysis.kind, "tolerance": run.analysis.tolerance})
    for key in ("integrator", "steps", "evaluations", "wall_seconds", "status"):
        group.attrs[key] = getattr(run, key)
    group.attrs.create("warnings", list(result.warnings), dtype=h5py.string_dtype())
    group["time"] = run.time
    _write_bodies(group, result)
    _write_joints(group, result)
    for trajectory in motion.model.scene.trajectory:
        group[f"trajectories/{trajectory.name}/force"] = motion.path_force(trajectory.name)
        entry = group[f"trajectories/{trajectory.name}"]
        entry.attrs["components"] = list(trajectory.components)
    for key, values in zip(("kinetic", "strain", "gravitational"), run.energy.T, strict=True):
        group[f"energy/{key}"] = values
    violation = group.create_dataset("constraint_violation", data=run.violation)
    violation.attrs["columns"] = ["position", "velocity"]


def _write_bodies(group: h5py.Group, result: SpatialResult) -> None:
    motion = result.motion
    for node in motion.model.tree.nodes:
        name = node.body.name
        for key, values in vars(motion.body(name)).items():
            group[f"bodies/{name}/{key}"] = values
        group[f"bodies/{name}/modal_force"] = motion.motor_forces.modal[name]
        for label in node.body.points:
            for key, values in vars(motion.point(f"{name}.{label}")).items():
                group[f"points/{name}.{label}/{key}"] = values


def _write_joints(group: h5py.Group, result: SpatialResult) -> None:
    motion = result.motion
    for joint in motion.model.scene.joint:
        entry = group.create_group(f"joints/{joint.name}")
        entry.attrs["type"] = joint.type
        acting = result.reactions[joint.name]
        entry["reaction"], entry["reaction_moment"] = acting.force, acting.moment
        if (found := motion.joint(joint.name)) is not None:
            entry["coordinate"], entry["rate"] = (
                np.squeeze(values, 1) if len(joint.units) == 1 else values for values in found
            )
        if (moment := motion.motor_forces.moments.get(joint.name)) is not None:
            entry["moment"] = np.squeeze(moment, 1) if len(joint.units) == 1 else moment
