"""What results files keep of runs that were stopped, so that they can be gone on with, and what is read of it."""

from __future__ import annotations

import json
from collections.abc import Iterable

import h5py
import numpy as np

from ..common.arrays import Array, as_list
from ..common.errors import InputError
from ..mbs import _core
from ..mbs.analysis.outcome import SAMPLED, AnyOutcome, Continuation, EarlierRun, Forces, Motion, Statistics
from ..mbs.scene.analysis import Analysis, IntegratedAnalysis
from ..mbs.solve.integrators import METHODS, Choice
from .file import Results
from .stopped import GROUP, STOPPED, row_of_numbers
from .tree_checkpoint import read_tree_checkpoint, write_tree_checkpoint

ROWS = ("q", "v", "a")
COUNTS = ("steps", "rejected", "evaluations", "wall_seconds")


def write_earlier_run(group: h5py.Group, outcome: AnyOutcome, *, is_spatial: bool) -> None:
    """What the next step of a run depends on, and its numbers that results files do not hold anyway."""
    assert outcome.continuation is not None
    datasets = {name: getattr(outcome, name) for name in ROWS} | {_multipliers(is_spatial): outcome.multipliers}
    datasets |= {"tau": outcome.forces.tau, "F_p": outcome.forces.F_p}
    for name, values in datasets.items():
        if values is not None:
            group[name] = values
    write_tree_checkpoint(group, outcome.continuation.checkpoint)
    if (samples := outcome.continuation.samples) is not None:
        group["samples/times"] = samples.times
        group["samples/states"] = samples.states
        group["samples"].attrs.update({key: getattr(samples, key) for key in SAMPLED})
    if (recording := outcome.continuation.recording) is not None:
        group["recording/times"] = recording.times
        group["recording/states"] = recording.states
        names = {kind: name for name, kind in METHODS.items()}
        group["recording"].attrs["methods"] = json.dumps([(first, names[kind]) for first, kind in recording.methods])


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

    def dataset(row: str) -> Array:
        if not file.has(f"{group}/{row}"):
            raise InputError(f"{file.path}: {group}/{row}: expected a dataset, found none")
        return file[f"{group}/{row}"]

    q, v, a, multipliers = (dataset(row) for row in (*ROWS, _multipliers(file.is_spatial)))
    residual = None if file.is_spatial else file[f"{name}/constraint_violation"]
    tau, F_p = (dataset(row) if file.has(f"{group}/{row}") else None for row in ("tau", "F_p"))
    counts = {count: about[count].item() for count in COUNTS if count != "rejected" or count in about}
    ends = row_of_numbers(file, f"{name}/step_ends") if file.has(f"{name}/step_ends") else np.zeros(0)
    return EarlierRun(
        Motion(file.time(name), q, v, a, multipliers, residual),
        Forces(tau, F_p),
        Statistics(about["status"], Choice(about["integrator"], about["integrator_reason"]), **counts, step_ends=ends),
        _continuation(file, analysis),
        f"{file.path}: {group}",
    )


def _multipliers(is_spatial: bool) -> str:
    """The name of their dataset."""
    return "multipliers" if is_spatial else "lambda_"


def _continuation(file: Results, analysis: Analysis) -> Continuation:
    about, group = file.attributes(analysis.name), f"{analysis.name}/{GROUP}"
    where, expected = f"{group}/checkpoint", len(file.time(analysis.name))
    if file.has(f"{where}/peaks"):
        raise InputError(
            f"{file.path}: {group}: expected a run in joint coordinates, found one in absolute coordinates, which an"
            " earlier version of ffrobot has stopped: solve again without --resume"
        )
    checkpoint = read_tree_checkpoint(file, where)
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
