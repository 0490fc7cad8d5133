"""What every results file says of itself, and every analysis of its run."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import h5py

from ..common.arrays import Array
from ..common.checksum import MARK
from ..common.checksum import METHOD as CHECKSUM
from ..common.version import program_version
from ..mbs.analysis.outcome import Outcome
from ..mbs.fields.steps import DATASET, METHOD
from ..run.loaded_body import Loaded
from ..run.mode_search import ModeChoice
from ..run.spatial_solution import FinerCheck, SpatialResult
from .file import FORMAT

FORMAT_VERSION = 1


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


def write_texts(group: h5py.Group, warnings: Sequence[str], notes: Sequence[str]) -> None:
    """Of an analysis: why its results may be wrong, and what is worth knowing of right ones."""
    for name, texts in (("warnings", warnings), ("notes", notes)):
        group.attrs.create(name, list(texts), dtype=h5py.string_dtype())


def write_judgement(group: h5py.Group, result: SpatialResult) -> None:
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


def write_attributes(group: h5py.Group, outcome: Outcome) -> None:
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
