"""Results files (HDF5): one group per analysis, written whole or not at all."""

import json
import os
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from ..common.arrays import Indices
from ..common.checksum import MARK, sealed
from ..common.checksum import METHOD as CHECKSUM
from ..common.files import write_atomically
from ..common.hdf5 import image_of, in_memory
from ..common.meanings import LABELS, write_record
from ..common.python_files import allowed_python, imported_files
from ..common.rotations import quaternions
from ..common.version import VERSION
from ..mbs import _core
from ..mbs.fields.field_types import DATASET, METHOD
from ..mbs.model.truncation import modes_kept
from ..mbs.posture.redundancy import resolving_joints
from ..mbs.quantities.motion import (
    body_motion,
    constraint_violation,
    continuous,
    joint_motion,
    plane_angle,
    point_names,
    reported_points,
    section_motion,
)
from ..mbs.quantities.stress import BodyStress
from ..mbs.quantities.supply import actuator_forces, followed_trajectories, gear_motions, motor_motion
from ..mbs.run.record import Details, Run
from ..mbs.scene.space import Space
from ..run.actuation import Actuation
from ..run.inputs import digest_of_file, named_files, python_files
from ..run.result import AnalysisResult, Solution
from ..scene.scene import Scene
from .file import FORMAT
from .judging import write_off_path
from .kinds import OF_KIND
from .peaks import peaking, write_peaks

if TYPE_CHECKING:  # most scenes have none of these
    from ..actuation.feasibility import Feasibility
    from ..actuation.points import PointForces, PointSet

GROUP = "resume"  # in the group of an analysis
STOPPED = ("interrupted", "too many steps", "not evaluated")
ROWS = ("q", "v", "a", "multipliers")
KEPT: dict[str, type[_core.TreeCheckpoint | _core.Recording | _core.Samples]] = {
    "checkpoint": _core.TreeCheckpoint,
    "recording": _core.Recording,
    "samples": _core.Samples,
}
"""What a `Continuation` may have, as bytes of the core."""


def write_results(solution: Solution, path: Path) -> None:
    """Write every analysis of a solution to `path`, completely or not at all. Raises `SolveError` if that fails."""
    write_atomically(path, sealed(results_image(solution)), "results file")


def results_image(solution: Solution) -> bytes:
    """The bytes of the results file of a solution; of `wanted` datasets alone where the solution has these."""
    with in_memory() as file:
        _write_head(file, solution)
        for name, result in solution.analyses.items():
            with result.run.arithmetic:
                _write_analysis(file.create_group(name), solution, result)
        if (run := solution.unread) is not None:
            _write_run(file.create_group(run.analysis.name), run)
            _write_texts(file[run.analysis.name], run.statistics.warnings, ())
        if solution.wanted is None:
            write_state(file, solution)
        return image_of(file)


def _write_head(file: h5py.File, solution: Solution) -> None:
    scene = solution.scene
    file.attrs.update({MARK: CHECKSUM, "format": FORMAT, "format_version": 1, "ffrobot_version": VERSION})
    file.attrs.update(name=scene.name, scene=scene.text, space=scene.space)
    files = {
        name: {"path": str(body.path.absolute()), "sha256": body.file_hash, "input_hash": body.modal.input_hash}
        for name, body in solution.bodies.items()
        if body.modal is not None and body.path is not None
    }
    file.attrs["modal_bodies"] = json.dumps(files)
    file.attrs["geometric_stiffening"] = solution.is_stiffened
    file.attrs.create("skipped", [*solution.omissions, *solution.notes], dtype=h5py.string_dtype())


def _write_analysis(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    run, wants = result.run, result.wants
    _write_run(group, run)
    if solution.wanted is None:
        _write_texts(group, result.warnings, result.notes)
        _write_judgement(group, solution, result)
    if joints := resolving_joints(run.model):
        group.attrs.update({"redundancy": run.model.scene.redundancy, "resolved_by": joints})
    if wants("bodies"):
        _write_bodies(group, solution, result)
    _write_forces(group, solution, result)
    if wants("points"):
        _write_points(group, result)
    if wants("feasibility") and result.actuation is not None:
        _write_feasibility(group, solution, result.actuation.feasibility)
    for name, body in solution.bodies.items():
        if body.structure:
            write_record(group.create_group(f"patch_structure/{name}"), body.structure)
    for point, settled in result.settling.items() if wants("settling") else ():
        write_record(group.create_group(f"settling/{point}"), settled)
    if (left := result.deviations) is not None:
        about = group.create_group("robustness")
        about.attrs.update(bandwidth=left.bandwidth, causes=list(left.causes))
        for lane, values in left.lanes.items():
            about[lane] = values
    if wants("energy", "momentum", "constraint_violation"):
        _write_balances(group, result)
    if type(run.details) is not Details:
        own = OF_KIND[run.analysis.kind]
        if own.write:
            own.write(group, run, run.details)
        else:
            write_record(group.create_group(own.part), run.details)
    if wants("off_path"):
        write_off_path(group, solution, result)


def _write_balances(group: h5py.Group, result: AnalysisResult) -> None:
    run, (energies, momentum) = result.run, result.totals
    write_record(group.create_group("energy"), energies)
    group["momentum/linear"] = run.space.along(momentum.linear)
    group["momentum/angular"] = run.space.about(momentum.angular)
    violation = group.create_dataset("constraint_violation", data=constraint_violation(run))
    violation.attrs["columns"] = list(LABELS["level"])


def _write_forces(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Of an analysis: joints/, trajectories/, actuation_points/, stress/ and pzt/, and all that has peaks."""
    histories, wants = result.histories, result.wants
    if wants("joints"):
        _write_joints(group, solution, result)
    for body, forces in result.point_forces.items() if wants("actuation_points") else ():
        points = group.create_group(f"actuation_points/{body}")
        _write_point_forces(points, solution.points[body], forces, result.run.space)
    for body, stress in histories.stresses.items() if wants("stress") else ():
        _write_stress(group.create_group(f"stress/{body}"), stress, histories.outputs)
    if wants("trajectories"):
        _write_paths(group, result)
    if wants("pzt") and result.actuation is not None:
        _write_voltages(group, solution, result.actuation)
    with_peaks = {name: values for name, values in peaking(result) if wants(name)}
    write_peaks(group, histories.run.time, with_peaks, histories.outputs)


def _write_voltages(group: h5py.Group, solution: Solution, actuation: Actuation) -> None:
    """Write pzt/ of an analysis, a group for each layout.

    `pzt/LAYOUT/residual_force` (T, n) is what all patches of the link leave, on the modes of its file.
    """
    for body, of_link in solution.patches.items():
        for name, patches in of_link.arrays.items():
            entry, unmet = group.create_group(f"pzt/{name}"), actuation.unmet[body]
            left = actuation.voltages[name].unmet[:, : patches.served]
            entry["residual"] = np.linalg.norm(left, axis=1)
            write_record(entry, patches)
            if solution.scene.is_planar:  # modes of the equations
                entry["residual_force"] = unmet @ solution.bodies[body].spatial.modal_transform
            else:
                entry["residual_force"] = unmet
                entry["residual_force"].attrs["columns"] = list(map(str, solution.links[body].family))
            entry.attrs["limit"] = patches.limit if np.unique(patches.limit).size > 1 else patches.limit[0]
            entry.attrs["capacitance"] = patches.layout.capacitance()
            if np.any(-patches.amplifiers.range[0] != patches.amplifiers.range[1]):
                entry.attrs["range"] = patches.amplifiers.range
            entry.attrs.update({"body": body, "bends": patches.layout.bends})


def _write_feasibility(group: h5py.Group, solution: Solution, judged: "Feasibility") -> None:
    group = group.create_group("feasibility")
    group.attrs["feasible"] = judged.is_feasible
    if judged.unsupplied is not None:
        write_record(group.create_group("unsupplied"), judged.unsupplied)
    for label, motor in judged.motors.items():
        write_record(group.create_group(f"joints/{label}"), motor)
    layouts = {name: array.layout for of_link in solution.patches.values() for name, array in of_link.arrays.items()}
    for name, patches in judged.patches.items():
        entry = group.create_group(f"pzt/{name}")
        write_record(entry, patches)
        entry.attrs["depoling_field"] = layouts[name].depoling_field or np.inf
        entry.attrs["strain_limit"] = layouts[name].strain_limit or np.inf
        write_record(entry.create_group("remedies"), patches.remedies)
    for joint in solution.scene.motor_joints:
        for k, unit in enumerate(joint.units):
            label = joint.name if len(joint.units) == 1 else f"{joint.name} {k + 1}"
            group[f"joints/{label}"].attrs["unit"] = "N·m" if unit == "rad" else "N"


def _write_point_forces(group: h5py.Group, points: "PointSet", forces: "PointForces", space: Space) -> None:
    group["residual"] = forces.residual
    group["residual_force"] = forces.unmet
    group["position"] = space.along(np.array([point.position for point in points.points]))
    group["direction"] = space.along(points.direction.T)
    of_plane = {"x": "axial", "y": "transverse"} if space.is_plane else {}
    components = [of_plane.get(axis, axis) for axis in points.axes]
    group.attrs.update(components=components, rank=forces.rank, condition_number=forces.condition_number)


def _write_run(group: h5py.Group, outcome: Run) -> None:
    """What is known of a run whether it has outputs or not: its analysis, how it went, its times and steps."""
    analysis, run = outcome.analysis, outcome.statistics
    group.attrs.update(kind=analysis.kind, tolerance=analysis.tolerance)
    group.attrs["integrator"] = run.integrator.name if analysis.is_integrated else "none"
    group.attrs["integrator_reason"] = run.integrator.reason if analysis.is_integrated else ""
    group.attrs["actuation"] = (analysis.source or "") if analysis.takes_actuation else ""
    group.attrs["apply"] = getattr(analysis, "apply", None) or ""  # of every kind, for those who read the file
    for key in ("steps", "rejected", "evaluations", "wall_seconds", "status", "cause"):
        group.attrs[key] = getattr(run, key)
    group["time"] = outcome.time
    if len(run.step_ends):
        group[DATASET] = run.step_ends
        group[DATASET].attrs[METHOD] = run.integrator.name


def _write_texts(group: h5py.Group, warnings: Sequence[str], notes: Sequence[str]) -> None:
    """`warnings` say why results of an analysis may be wrong, `notes` what is worth knowing of right ones."""
    for name, texts in (("warnings", warnings), ("notes", notes)):
        group.attrs.create(name, list(texts), dtype=h5py.string_dtype())


def _write_judgement(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """How well modes resolve a motion, by estimates and by a replay on finer links, and what loads do to stiffness."""
    group.attrs["stiffening_effect"] = result.stiffening_effect
    if result.analysis.is_integrated:
        group.attrs["start_jolt"] = result.start_jolt
    is_rigid = solution.scene.is_planar and any(body.rigid_in for body in solution.bodies.values())
    if result.mode_error is not None and not is_rigid:
        group.attrs["mode_error"] = result.mode_error
    if solution.mode_choice is not None:
        for kind, error in solution.mode_choice.errors.get(result.analysis.name, {}).items():
            group.attrs[f"mode_error_{kind}"] = error
    if (check := result.check) is not None:
        group.attrs.update(check_point=check.point, check_error=check.error, check_status=check.status)
        group.attrs["check_modes"] = json.dumps(dict(check.modes))
        if check.least_voltage is not None:
            group.attrs["check_least_voltage"] = check.least_voltage


def _write_bodies(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Write bodies/ of an analysis; modes of planar scenes are those that move in the plane."""
    run, histories = result.run, result.histories
    forces = actuator_forces(histories.run)
    for name in reported_points(run):
        entry, body, moved = group.create_group(f"bodies/{name}"), solution.bodies[name].spatial, body_motion(run, name)
        force = {} if forces is None else {"modal_force": forces.modal[name][histories.outputs]}
        T, modes = body.modal_transform, {"modal": moved.modal, "modal_velocity": moved.modal_velocity}
        about = "modes of the modal body file"
        if run.space.is_plane and T.shape[1] < T.shape[0]:  # of those that move in the plane
            entry["modal_transform"] = T
            about = "modes of the modal body file are modal_transform times these"
            modes = {key: np.linalg.lstsq(T, values.T, rcond=None)[0].T for key, values in modes.items()}
            force = {key: F_p @ T for key, F_p in force.items()}
        turned = {"angle": plane_angle(run, name)} if run.space.is_plane else {"quaternion": moved.orientation}
        of_frame = {"position": run.space.along(moved.position), "velocity": run.space.along(moved.velocity)}
        of_frame["angular_velocity"] = run.space.about(moved.angular_velocity)
        for key, values in (of_frame | turned | modes | force).items():
            entry[key] = values
        if run.space.is_plane or name in solution.links:
            entry.attrs.update(modal_coordinates=about, modes_kept=modes_kept(body))
        if name in solution.divided:
            entry.attrs["pieces"] = len(solution.divided[name].names)
    for name, link in result.bending.items():
        attributes = group[f"bodies/{name}"].attrs
        attributes.update(largest_deflection=link.deflection, largest_rotation=link.rotation)
        attributes.update(position_error=link.missing.of_length, relative_error=link.missing.of_deflections)
        for key in ("foreshortening", "foreshortening_moment", "stiffness_change"):
            attributes[key] = getattr(link, key)


def _write_points(group: h5py.Group, result: AnalysisResult) -> None:
    """Write points/ of an analysis, except quantities with peaks."""
    run = result.run
    for place in point_names(run):
        if result.wants(f"points/{place}"):
            at = section_motion(run, place)
            group[f"points/{place}/position"] = run.space.along(at.r)
            if not run.space.is_plane:
                group[f"points/{place}/quaternion"] = continuous(quaternions(at.F))
        if result.wants(f"points/{place}/predicted_shift") and place in result.predicted_shift:
            group[f"points/{place}/predicted_shift"] = run.space.along(result.predicted_shift[place])


def _write_stress(group: h5py.Group, stress: BodyStress, outputs: Indices) -> None:
    recovery = stress.recovery.at(outputs)
    group.attrs["method"] = recovery.method
    group["modal"] = recovery.modal
    group["loads"] = recovery.sizes
    group["loads"].attrs.create("columns", list(recovery.loads), dtype=h5py.string_dtype())
    if recovery.sections is not None:
        write_record(group.create_group("layers"), recovery.sections)
    for name, point in stress.points.items():
        group[f"points/{name}/stress"] = point.stress[outputs]
        group[f"points/{name}/stress"].attrs["columns"] = list(LABELS["stress"])
    if stress.surface is not None:
        group["surface/position_of_max"] = stress.surface.position_of_max[outputs]


def _write_paths(group: h5py.Group, result: AnalysisResult) -> None:
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


def _write_joints(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
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


def write_state(file: h5py.File, solution: Solution) -> None:
    """Add the state of an interrupted run to its results file, for `resume_scene`, and fingerprints of its input.

    Fingerprints of imported Python files stand at their paths relative to the scene's folder.
    """
    scene, folder = solution.scene, solution.scene.path.parent
    file.attrs["input_files"] = json.dumps(input_files(scene))
    if python := python_files(tomllib.loads(scene.text), folder):
        imported = imported_files(folder, *(one.parent for one in python), *allowed_python())
        names = {os.path.relpath(one, folder.resolve()): digest for one, digest in imported.items()}
        file.attrs["imported_files"] = json.dumps(names)
    is_kept = left_out(solution) or any(run.status in STOPPED for run in solution.outcomes.values())
    for name, run in solution.outcomes.items() if is_kept else ():
        if solution.goes_on(run) and run.continuation is not None:
            group = file[name].create_group(GROUP)
            for row in ROWS:
                group[row] = getattr(run, row)
            for key in KEPT:
                if (kept := getattr(run.continuation, key)) is not None:
                    group[key] = np.frombuffer(kept.to_bytes(), dtype=np.uint8)


def left_out(solution: Solution) -> list[str]:
    """Names of analyses without a run, after a signal or an exception; [] where a run failed."""
    if any(outcome.failed and outcome.status not in STOPPED for outcome in solution.outcomes.values()):
        return []
    return [one.name for one in solution.scene.analysis if one.name not in solution.outcomes]


def input_files(scene: Scene) -> dict[str, str]:
    """SHA-256 of a scene's input files other than links and modal bodies, by their name in messages."""
    tables, folder = tomllib.loads(scene.text), scene.path.parent
    waypoints = {entry["waypoints"] for entry in tables.get("trajectory", []) if "waypoints" in entry}
    calls = {folder / name: f"the waypoints {name}" for name in waypoints}
    besides = {key: value for key, value in tables.items() if key != "body"}
    return {calls.get(file, f"the file {file.name}"): digest_of_file(file) for file in named_files(besides, folder)}
