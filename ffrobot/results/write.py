"""Results files (HDF5): one group per analysis, written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import h5py

from ..actuation.control.linear_models import LinearModels
from ..actuation.control.loop_record import LoopRecord
from ..actuation.control.placing import Placed
from ..common.arrays import Array
from ..common.checksum import MARK, sealed
from ..common.checksum import METHOD as CHECKSUM
from ..common.files import write_atomically
from ..common.version import program_version
from ..mbs.analysis.motors_only import InvertedPath
from ..mbs.analysis.outcome import AnyOutcome, Details
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.fields.steps import DATASET, METHOD
from ..run.loaded_body import Loaded
from ..run.mode_search import ModeChoice
from ..run.solution import AnalysisResult, FinerCheck, Solution
from ..run.spatial_solution import SpatialResult
from .actuators import write_actuators, write_placement
from .bodies import write_bending, write_motion, write_stress
from .control import write_loop
from .file import FORMAT
from .forces import write_forces, write_inversion
from .linear import write_linear
from .peaks import write_peaks
from .resume import write_state

FORMAT_VERSION = 1

DETAILS: dict[type[Details], Callable[[h5py.Group, PlanarOutcome, Any], None]] = {
    InvertedPath: write_inversion,
    LinearModels: write_linear,
    LoopRecord: lambda group, _outcome, record: write_loop(group, record),
    Placed: lambda group, _outcome, placed: write_placement(group, placed),
}
"""What writes to the group of an analysis that which only its kind finds."""


def write_results(solution: Solution, path: Path) -> None:
    """Write every analysis of a solution to `path`. Raises `SolveError` where that fails; no half file is left."""
    write_atomically(path, sealed(results_image(solution)), "results file")


def results_image(solution: Solution) -> bytes:
    """The content of the results file of a solution."""
    with h5py.File("results", "w", driver="core", backing_store=False) as file:
        write_head(file, solution.scene.name, solution.scene.text, solution.bodies)
        file.attrs["skipped"] = list(solution.omissions)
        file.attrs["geometric_stiffening"] = solution.stiffened
        for name, result in solution.analyses.items():
            group = file.create_group(name)
            _write_analysis(group, solution, result)
            closer = result.closer
            write_peaks(group, None if closer is None else partial(_write_analysis, solution=solution, result=closer))
        write_state(file, solution)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


def write_head(file: h5py.File, name: str, text: str, bodies: Mapping[str, Loaded]) -> None:
    """What every results file says of itself, of the scene `name` with its `text`, and of the modal bodies' files."""
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs[MARK] = CHECKSUM
    file.attrs["ffrobot_version"] = program_version()
    file.attrs["name"] = name
    file.attrs["scene"] = text
    files = {
        name: {"path": str(body.path.absolute()), "sha256": body.file_hash, "input_hash": body.modal.input_hash}
        for name, body in bodies.items()
        if body.modal is not None and body.path is not None
    }
    file.attrs["modal_bodies"] = json.dumps(files)


def _write_analysis(group: h5py.Group, solution: Solution, result: AnalysisResult) -> None:
    outcome, name = result.outcome, result.outcome.analysis.name
    write_attributes(group, outcome)
    group.attrs["stiffening_effect"] = result.stiffening_effect
    write_judgement(group, result)
    write_texts(group, result.warnings, result.notes)
    if solution.mode_choice is not None:
        write_mode_errors(group, name, solution.mode_choice)
    write_check(group, result.check)
    write_motion(group, outcome)
    write_bending(group, result.bending)
    for body, divided in solution.divided.items():
        group[f"bodies/{body}"].attrs["pieces"] = len(divided.names)
    write_steps(group, outcome.statistics.step_ends, outcome.statistics.integrator.name)
    write_forces(group, outcome)
    write_actuators(group, solution, result)
    for body, stress in result.stresses.items():
        write_stress(group.create_group(f"stress/{body}"), stress)
    for found, write in DETAILS.items():
        if isinstance(outcome.details, found):
            write(group, outcome, outcome.details)


def write_texts(group: h5py.Group, warnings: Sequence[str], notes: Sequence[str]) -> None:
    """Of an analysis: why its results may be wrong, and what is worth knowing of right ones."""
    for name, texts in (("warnings", warnings), ("notes", notes)):
        group.attrs.create(name, list(texts), dtype=h5py.string_dtype())


def write_judgement(group: h5py.Group, result: AnalysisResult | SpatialResult) -> None:
    """How well modes resolve a motion that was integrated."""
    if result.analysis.is_integrated:
        group.attrs["start_jolt"] = result.start_jolt
    if result.mode_error is not None:
        group.attrs["mode_error"] = result.mode_error


def write_steps(group: h5py.Group, ends: Array, method: str) -> None:
    """Where steps of an integration ended, if it can be repeated by them."""
    if len(ends):
        group[DATASET] = ends
        group[DATASET].attrs[METHOD] = method


def write_check(group: h5py.Group, found: FinerCheck | None) -> None:
    """Attributes check_… of an analysis that was replayed on finer links."""
    if found is not None:
        check = vars(found) | {"modes": json.dumps(dict(found.modes))}
        group.attrs.update({f"check_{key}": value for key, value in check.items()})


def write_mode_errors(group: h5py.Group, analysis: str, choice: ModeChoice) -> None:
    """What leaving out modes costs in an analysis, estimated."""
    for kind, error in choice.errors.get(analysis, {}).items():
        group.attrs[f"mode_error_{kind}"] = error


def write_attributes(group: h5py.Group, outcome: AnyOutcome) -> None:
    """What is known of a run by its analysis and statistics."""
    analysis, run = outcome.analysis, outcome.statistics
    group.attrs["kind"] = analysis.kind
    group.attrs["integrator"] = run.integrator.name if analysis.is_integrated else "none"
    group.attrs["integrator_reason"] = run.integrator.reason if analysis.is_integrated else ""
    group.attrs["tolerance"] = analysis.tolerance
    group.attrs["actuation"] = (analysis.source or "") if analysis.takes_actuation else ""
    group.attrs["apply"] = getattr(analysis, "apply", None) or ""  # of every kind, for those who read the file
    for key in ("steps", "rejected", "evaluations", "wall_seconds", "status", "cause"):
        group.attrs[key] = getattr(run, key)
