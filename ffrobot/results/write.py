"""Results files (HDF5): one group per analysis, written whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np

from ..actuation.feasibility import Feasibility
from ..actuation.patches.patches import PatchArray
from ..actuation.patches.voltages import Voltages
from ..actuation.points import PointForces, PointSet
from ..common.files import write_atomically
from ..common.version import program_version
from ..mbs.analysis.analyses import Outcome
from ..mbs.analysis.motors_only import is_minimum_phase, path_error
from ..mbs.model.truncation import modes_kept
from ..mbs.quantities.observation import (
    body_motion,
    energies,
    joint_forces,
    motor_angle,
    point_motion,
    stored_coordinates,
    trajectory_force,
    trajectory_target,
)
from ..mbs.quantities.stress import BodyStress
from ..mbs.solve.stable_inversion import Inversion
from ..run.resume import write_state
from ..run.solution import Solution
from .linear import write_linear, write_placement
from .loop import write_loop

FORMAT = "ffrobot-results"
FORMAT_VERSION = 1


def write_results(solution: Solution, path: Path) -> None:
    """Write every analysis of a solution to `path`. Raises `SolveError` where that fails; no half file is left."""
    write_atomically(path, results_image(solution), "results file")


def results_image(solution: Solution) -> bytes:
    """The content of the results file of a solution."""
    with h5py.File("results", "w", driver="core", backing_store=False) as file:
        file.attrs["format"] = FORMAT
        file.attrs["format_version"] = FORMAT_VERSION
        file.attrs["ffrobot_version"] = program_version()
        file.attrs["name"] = solution.scene.name
        file.attrs["scene"] = solution.scene.text
        file.attrs["skipped"] = list(solution.skipped)
        file.attrs["geometric_stiffening"] = solution.stiffened
        file.attrs["modal_bodies"] = json.dumps(_modal_files(solution))
        for name, outcome in solution.outcomes.items():
            group = file.create_group(name)
            _write_attributes(group, outcome)
            group.attrs["stiffening_effect"] = solution.stiffening_effects[name]
            if solution.mode_choice is not None and name in solution.mode_choice.errors:
                for kind, error in solution.mode_choice.errors[name].items():
                    group.attrs[f"mode_error_{kind}"] = error
            _write_motion(group, outcome)
            _write_forces(group, outcome)
            for body_name, voltages in solution.voltages.get(name, {}).items():
                _write_voltages(group.create_group(f"pzt/{body_name}"), solution.patches[body_name], voltages)
            for body_name, forces in solution.point_forces.get(name, {}).items():
                _write_point_forces(
                    group.create_group(f"actuation_points/{body_name}"), solution.points[body_name], forces
                )
            for body_name, effect in solution.structure.items():
                for key, pair in vars(effect).items():
                    group[f"patch_structure/{body_name}/{key}"] = pair
            for point, shift in solution.predicted_shift.get(name, {}).items():
                group[f"points/{point}/predicted_shift"] = shift
            if name in solution.linear:
                write_linear(group.create_group("linear"), solution.linear[name], outcome)
            if name in solution.placements:
                write_placement(group.create_group("placement"), solution.placements[name])
            if name in solution.feasibility:
                _write_feasibility(group.create_group("feasibility"), solution, solution.feasibility[name])
            if name in solution.loops:
                write_loop(group, solution.loops[name])
            for body_name, stress in solution.stresses.get(name, {}).items():
                _write_stress(group.create_group(f"stress/{body_name}"), stress)
        write_state(file, solution)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def _modal_files(solution: Solution) -> dict[str, dict[str, str]]:
    """Path and hashes of the modal body file behind each flexible body."""
    return {
        name: {"path": str(body.path.absolute()), "sha256": body.file_hash, "input_hash": body.modal.input_hash}
        for name, body in solution.bodies.items()
        if body.modal is not None and body.path is not None
    }


def _write_attributes(group: h5py.Group, outcome: Outcome) -> None:
    analysis = outcome.analysis
    group.attrs["kind"] = analysis.kind
    group.attrs["integrator"] = outcome.integrator.name if analysis.integrated else "none"
    group.attrs["integrator_reason"] = outcome.integrator.reason if analysis.integrated else ""
    group.attrs["tolerance"] = analysis.tolerance
    group.attrs["actuation"] = analysis.actuation or ""
    group.attrs["apply"] = analysis.apply or ""
    for key in ("steps", "rejected", "evaluations", "wall_seconds", "status", "cause"):
        group.attrs[key] = getattr(outcome, key)


def _write_motion(group: h5py.Group, outcome: Outcome) -> None:
    group["time"] = outcome.time
    for body in outcome.assembly.model.links:
        for key, values in vars(body_motion(outcome, body)).items():
            group[f"bodies/{body.name}/{key}"] = values
        transform = stored_coordinates(body)
        about = "modes of the modal body file"
        if transform is not None:
            group[f"bodies/{body.name}/modal_transform"] = transform
            about = "modes of the modal body file are modal_transform times these"
        group[f"bodies/{body.name}"].attrs["modal_coordinates"] = about
        group[f"bodies/{body.name}"].attrs["modes_kept"] = modes_kept(body)
        for label in body.points:
            point = f"{body.name}.{label}"
            for key, values in vars(point_motion(outcome, point)).items():
                group[f"points/{point}/{key}"] = values
    for key, values in energies(outcome).items():
        group[f"energy/{key}"] = values
    violation = group.create_dataset("constraint_violation", data=outcome.residual)
    violation.attrs["columns"] = ["position", "velocity", "acceleration"]


def _write_forces(group: h5py.Group, outcome: Outcome) -> None:
    held = {c.owner for c in outcome.assembly.constraints if c.is_trajectory}
    for trajectory in outcome.assembly.model.scene.trajectory:
        if trajectory.name in held:
            entry = group.create_group(f"trajectories/{trajectory.name}")
            entry["force"] = trajectory_force(outcome, trajectory.name)
            entry["target"] = trajectory_target(outcome, trajectory.name)
            entry.attrs["components"] = list(trajectory.components)
    if outcome.inversion is not None:
        _write_servo(group, outcome, outcome.inversion)
    for joint in outcome.assembly.model.scene.joint:
        forces = joint_forces(outcome, joint.name)
        entry = group.create_group(f"joints/{joint.name}")
        entry.attrs["type"] = joint.type
        entry["reaction"] = forces.reaction
        if forces.reaction_moment is not None:
            entry["reaction_moment"] = forces.reaction_moment
        if forces.motor is not None:
            entry["moment"] = forces.motor
            if joint.given_gear_ratio is not None:
                entry["motor_moment"] = forces.motor / joint.given_gear_ratio
        angle = motor_angle(outcome, joint.name)
        if angle is not None:
            entry["motor_angle"] = angle
        if (gear := outcome.gears.get(joint.name)) is not None:
            entry["gear_moment"] = gear.gear_moment
            entry.attrs["unresolved"] = gear.unresolved


def _write_servo(group: h5py.Group, outcome: Outcome, inversion: Inversion) -> None:
    """Of motors-only inverse dynamics: no force acts on the path's points, which may be off it."""
    error, column = path_error(inversion, outcome.time, outcome.q), 0
    for trajectory in outcome.assembly.model.scene.trajectory:
        entry, count = group.create_group(f"trajectories/{trajectory.name}"), len(trajectory.components)
        entry["target"] = trajectory_target(outcome, trajectory.name)
        entry["error"] = error[:, column : column + count]
        entry.attrs["components"] = list(trajectory.components)
        column += count
    entry = group.create_group("zero_dynamics")
    entry["time"] = inversion.linearisation.times
    entry["zeros"] = np.stack([inversion.linearisation.zeros.real, inversion.linearisation.zeros.imag], axis=2)
    entry.attrs["columns"] = ["real", "imaginary"]
    entry.attrs["factor"] = inversion.servo.factor
    entry.attrs["minimum_phase"] = is_minimum_phase(inversion.linearisation)
    entry.attrs["unmet_force"] = inversion.unmet
    entry.attrs["off_rest"] = inversion.off_rest


def _write_stress(group: h5py.Group, stress: BodyStress) -> None:
    for name, point in stress.points.items():
        for key, values in vars(point).items():
            group[f"points/{name}/{key}"] = values
        group[f"points/{name}/stress"].attrs["columns"] = ["xx", "yy", "zz", "yz", "xz", "xy"]
    if stress.surface is not None:
        for key, values in vars(stress.surface).items():
            group[f"surface/{key}"] = values


def _write_voltages(group: h5py.Group, patches: PatchArray, voltages: Voltages) -> None:
    group["voltage"] = voltages.within_limit
    group["required_voltage"] = voltages.required
    group["residual"] = voltages.residual
    group["edges"] = patches.edges
    group["moment_per_volt"] = patches.moment_per_volt
    group.attrs["condition_number"] = patches.condition_number
    group["residual_force"] = voltages.unmet
    group.attrs["limit"] = patches.limit if np.unique(patches.limit).size > 1 else patches.limit[0]


def _write_feasibility(group: h5py.Group, solution: Solution, judged: Feasibility) -> None:
    for joint, motor in judged.motors.items():
        group.create_group(f"joints/{joint}").attrs.update(vars(motor) | {"factor": motor.factor})
    for body, patches in judged.patches.items():
        entry, layout = group.create_group(f"pzt/{body}"), solution.patches[body].layout
        arrays = {key: value for key, value in vars(patches).items() if isinstance(value, np.ndarray)}
        for key, values in (arrays | {"factor": patches.factor, "mode_factor": patches.mode_factor}).items():
            entry[key] = values
        entry.attrs["depoling_field"] = layout.depoling_field or np.inf
        entry.attrs["strain_limit"] = layout.strain_limit or np.inf
        entry.create_group("remedies").attrs.update(vars(patches.remedies))


def _write_point_forces(group: h5py.Group, points: PointSet, forces: PointForces) -> None:
    group["force"] = forces.force
    group["residual"] = forces.residual
    group["residual_force"] = forces.unmet
    group["position"] = np.array([point.position for point in points.points])
    group["direction"] = points.direction.T
    group.attrs["components"] = list(points.axes)
    group.attrs["rank"] = forces.rank
    group.attrs["condition_number"] = forces.condition_number
