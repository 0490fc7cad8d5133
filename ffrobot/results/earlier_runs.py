"""What results files keep of runs that were stopped, so that they can be gone on with, and what is read of it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import h5py
import numpy as np

from ..common.arrays import Array, as_list
from ..common.errors import InputError
from ..mbs import _core
from ..mbs.analysis.outcome import (
    METHOD_HISTORY,
    SAMPLED,
    STEPS,
    TREE_MEMORY,
    TREE_VECTORS,
    Continuation,
    EarlierRun,
    Motion,
    Outcome,
    Statistics,
)
from ..mbs.scene.analysis import Analysis, IntegratedAnalysis
from ..mbs.solve.integrators import METHODS, Choice
from .file import Results
from .stopped import GROUP, STOPPED, row_of_numbers

ROWS = ("q", "v", "a", "multipliers")
COUNTS = ("steps", "rejected", "evaluations", "wall_seconds")
OF_PLANE = ("lambda_", "checkpoint/peaks")
"""What earlier versions kept of runs of planar scenes, in coordinates of the plane, 0.1 in absolute ones."""


def write_earlier_run(group: h5py.Group, outcome: Outcome) -> None:
    """What the next step of a run depends on, and its numbers that results files do not hold anyway."""
    assert outcome.continuation is not None
    for name in ROWS:
        group[name] = getattr(outcome, name)
    _write_checkpoint(group, outcome.continuation.checkpoint)
    if (samples := outcome.continuation.samples) is not None:
        group["samples/times"] = samples.times
        group["samples/states"] = samples.states
        group["samples"].attrs.update({key: getattr(samples, key) for key in SAMPLED})
    if (recording := outcome.continuation.recording) is not None:
        group["recording/times"] = recording.times
        group["recording/states"] = recording.states
        names = {kind: name for name, kind in METHODS.items()}
        group["recording"].attrs["methods"] = json.dumps([(first, names[kind]) for first, kind in recording.methods])


def _write_checkpoint(group: h5py.Group, checkpoint: _core.TreeCheckpoint) -> None:
    """Add "checkpoint" to what is kept of an analysis."""
    for name in TREE_VECTORS:
        group[f"checkpoint/{name}"] = getattr(checkpoint, name)
    about = {name: getattr(checkpoint, name) for name in ("time", "outputs", *TREE_MEMORY)}
    about |= {name: getattr(checkpoint.steps, name) for name in STEPS}
    about |= {name: getattr(checkpoint.methods, name) for name in METHOD_HISTORY}
    group["checkpoint"].attrs.update(about)


def earlier_runs(file: Results, analyses: Iterable[Analysis]) -> dict[str, EarlierRun]:
    """Of those `analyses` of which something was kept, by name.

    A run that was stopped before its first step begins anew: what acts on it may not have been known yet.
    """
    return {one.name: _earlier_run(file, one) for one in analyses if _can_go_on(file, one.name)}


def _can_go_on(file: Results, name: str) -> bool:
    if not file.has(f"{name}/{GROUP}"):
        return False
    about = file.attributes(name)
    return bool(about["steps"] > 0 or about["status"] == "completed")


def _earlier_run(file: Results, analysis: Analysis) -> EarlierRun:
    """The run of `analysis` as far as it got. Raises `InputError` where something is missing or damaged."""
    name, about, group = analysis.name, file.attributes(analysis.name), f"{analysis.name}/{GROUP}"

    if any(file.has(f"{group}/{kept}") for kept in OF_PLANE):
        raise InputError(
            f"{file.path}: {group}: expected a run in the coordinates of this version, found one that an earlier"
            " version of ffrobot has stopped: solve again without --resume"
        )

    def dataset(row: str) -> Array:
        if not file.has(f"{group}/{row}"):
            raise InputError(f"{file.path}: {group}/{row}: expected a dataset, found none")
        return file[f"{group}/{row}"]

    q, v, a, multipliers = (dataset(row) for row in ROWS)
    counts = {count: about[count].item() for count in COUNTS if count != "rejected" or count in about}
    ends = row_of_numbers(file, f"{name}/step_ends") if file.has(f"{name}/step_ends") else np.zeros(0)
    return EarlierRun(
        Motion(file.time(name), q, v, a, multipliers),
        Statistics(about["status"], Choice(about["integrator"], about["integrator_reason"]), **counts, step_ends=ends),
        _continuation(file, analysis),
        f"{file.path}: {group}",
    )


def _continuation(file: Results, analysis: Analysis) -> Continuation:
    about, group = file.attributes(analysis.name), f"{analysis.name}/{GROUP}"
    expected = len(file.time(analysis.name))
    checkpoint = _read_checkpoint(file, f"{group}/checkpoint")
    if checkpoint.outputs != expected or about["status"] not in (*STOPPED, "completed"):
        raise InputError(
            f"{file.path}: {group}: expected as many outputs as times, {expected}, found {checkpoint.outputs}"
        )
    samples = _samples(file, f"{group}/samples")
    if not file.has(f"{group}/recording"):
        return Continuation(checkpoint, samples=samples)
    assert isinstance(analysis, IntegratedAnalysis)
    times, states = (row_of_numbers(file, f"{group}/recording/{key}") for key in ("times", "states"))
    methods = _methods(file, f"{group}/recording")
    recording = _core.Recording(times, states, methods, analysis.spectral_radius, analysis.tolerance)
    return Continuation(checkpoint, recording, samples)


def _read_checkpoint(file: Results, group: str) -> _core.TreeCheckpoint:
    """That of a group. Raises `InputError` where it lacks something."""
    about = file.attributes(group)
    try:
        memory: dict[str, Any] = {name: about[name].item() for name in TREE_MEMORY}
        memory |= {name: row_of_numbers(file, f"{group}/{name}") for name in TREE_VECTORS}
        found: _core.TreeCheckpoint = _core.TreeCheckpoint(
            time=float(about["time"]),
            outputs=int(about["outputs"]),
            steps=_core.StepHistory(**{name: about[name].item() for name in STEPS if name in about}),
            methods=_core.MethodHistory(**{name: about[name].item() for name in METHOD_HISTORY}),
            **memory,
        )
        return found
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InputError(f"{file.path}: {group}: expected where the run has stopped, found {error}") from None


def _samples(file: Results, group: str) -> _core.Samples | None:
    """States between outputs; None in files of earlier versions."""
    if not file.has(group):
        return None
    about = file.attributes(group)
    times, states = (row_of_numbers(file, f"{group}/{key}") for key in ("times", "states"))
    try:
        numbers = {key: about[key].item() for key in SAMPLED}
        return _core.Samples(times=as_list(times), states=as_list(states), **numbers)
    except (TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{file.path}: {group}: expected states between outputs, found {error}") from None


def _methods(file: Results, group: str) -> list[tuple[int, _core.MethodKind]]:
    """The first step of each integrator of a recording, and its kind."""
    text = file.attributes(group).get("methods", "")
    try:
        methods = [(int(first), METHODS[name]) for first, name in json.loads(text)]
    except (TypeError, ValueError, KeyError):
        methods = []
    firsts = [first for first, _ in methods]
    if firsts[:1] != [0] or firsts != sorted(firsts):
        raise InputError(f"{file.path}: {group}: methods: expected integrators from step 0 on, found {text!r}")
    return methods
