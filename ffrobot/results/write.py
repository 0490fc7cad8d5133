"""Results files (HDF5): one group per analysis, written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import h5py

from ..common.checksum import MARK, sealed
from ..common.checksum import METHOD as CHECKSUM
from ..common.files import write_atomically
from ..common.hdf5 import image_of, in_memory
from ..common.meanings import write_record
from ..common.version import VERSION
from ..mbs.fields.steps import DATASET, METHOD
from ..mbs.posture.redundancy import resolving_joints
from ..mbs.quantities.motion import constraint_violation
from ..mbs.run.record import Details, Run
from ..run.result import AnalysisResult, Solution
from .actuators import write_feasibility, write_point_forces, write_voltages
from .file import FORMAT
from .judging import write_off_path
from .kinds import own_results
from .motion import write_bodies, write_joints, write_paths, write_points, write_stress
from .peaks import peaking, write_peaks
from .resume import write_state

FORMAT_VERSION = 1


def write_results(solution: Solution, path: Path) -> None:
    """Write every analysis of a solution to `path`, completely or not at all. Raises `SolveError` if that fails."""
    write_atomically(path, sealed(results_image(solution)), "results file")


def results_image(solution: Solution) -> bytes:
    """The content of the results file of a solution: all of it, or what is wanted."""
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
    """What every results file says of itself, of the scene, and of the files of modal bodies."""
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs[MARK] = CHECKSUM
    file.attrs["ffrobot_version"] = VERSION
    file.attrs["name"] = solution.scene.name
    file.attrs["scene"] = solution.scene.text
    file.attrs["space"] = solution.scene.space
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
        write_bodies(group, solution, result)
    _write_forces(group, solution, result)
    if wants("points"):
        write_points(group, result)
    if wants("feasibility") and result.actuation is not None:
        write_feasibility(group, solution, result.actuation.feasibility)
    for name, effect in ((name, body.structure) for name, body in solution.bodies.items() if body.structure):
        write_record(group.create_group(f"patch_structure/{name}"), effect)
    for point, settled in result.settling.items() if wants("settling") else ():
        write_record(group.create_group(f"settling/{point}"), settled)
    if (left := result.deviations) is not None:
        about = group.create_group("robustness")
        about.attrs["bandwidth"] = left.bandwidth
        about.attrs.create("causes", list(left.causes), dtype=h5py.string_dtype())
        for lane, values in left.lanes.items():
            about[lane] = values
    if wants("energy", "momentum", "constraint_violation"):
        _write_balances(group, result)
    if type(run.details) is not Details:
        own_results(group).write(group, run, run.details)
    if wants("off_path"):
        write_off_path(group, solution, result)


def _write_balances(group: h5py.Group, result: AnalysisResult) -> None:
    """Of an analysis: energy/, momentum/ and how well constraints are kept."""
    run, (energies, momentum) = result.run, result.totals
    write_record(group.create_group("energy"), energies)
    group["momentum/linear"] = run.space.along(momentum.linear)
    group["momentum/angular"] = run.space.about(momentum.angular)
    violation = group.create_dataset("constraint_violation", data=constraint_violation(run))
    violation.attrs["columns"] = ["position", "velocity", "acceleration"]


def _write_forces(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    """Of an analysis: joints/, trajectories/, actuation_points/, stress/ and pzt/, and all that has peaks."""
    histories, wants = result.histories, result.wants
    if wants("joints"):
        write_joints(group, solution, result)
    for body, forces in result.point_forces.items() if wants("actuation_points") else ():
        points = group.create_group(f"actuation_points/{body}")
        write_point_forces(points, solution.points[body], forces, result.run.space)
    for body, stress in histories.stresses.items() if wants("stress") else ():
        write_stress(group.create_group(f"stress/{body}"), stress, histories.outputs)
    if wants("trajectories"):
        write_paths(group, result)
    if wants("pzt") and result.actuation is not None:
        write_voltages(group, solution, result.actuation)
    with_peaks = {name: values for name, values in peaking(result) if wants(name)}
    write_peaks(group, histories.run.time, with_peaks, histories.outputs)


def _write_run(group: h5py.Group, outcome: Run) -> None:
    """What is known of a run whether it has outputs or not: its analysis, how it went, its times and steps."""
    analysis, run = outcome.analysis, outcome.statistics
    group.attrs["kind"] = analysis.kind
    group.attrs["integrator"] = run.integrator.name if analysis.is_integrated else "none"
    group.attrs["integrator_reason"] = run.integrator.reason if analysis.is_integrated else ""
    group.attrs["tolerance"] = analysis.tolerance
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
