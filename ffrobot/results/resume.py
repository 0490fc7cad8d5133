"""Going on with a run that was stopped, from its results file.

On Ctrl-C and where `max_steps` is used up, the results file keeps what the next step depends on. Analyses for
which that can be done for (`is_resumable`) go on from there, or are taken over where they are complete; all others are
run again.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py

from ..common.errors import InputError
from ..common.hdf5 import blaming
from ..mbs import _core
from ..mbs.analysis.outcome import Continuation, EarlierRun, Forces, Motion, Outcome, Statistics
from ..mbs.scene.analysis import IntegratedAnalysis
from ..mbs.solve.integrators import METHODS, Choice
from ..run.enough import goes_on
from ..run.prepare import prepare, stiffened
from ..run.solution import Solution
from ..run.solve import Keep, run_analyses
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .file import Results
from .same_input import check_same_input, write_input_files
from .stopped import GROUP, STOPPED, analyses, is_kept, row_of_numbers
from .tree_checkpoint import read_tree_checkpoint, write_tree_checkpoint

ROWS = ("q", "v", "a", "lambda_", "tau", "F_p")  # what results files do not hold anyway
COUNTS = ("steps", "rejected", "evaluations", "wall_seconds")


def resume(
    scene: Scene | Path, results: Path, watcher: Watcher | None = None, keep: Keep | None = None
) -> Solution | None:
    """`solve`, going on from the results file `results`; None where that is complete. From the start if absent.

    Raises `InputError` where the file is not that of the same scene, modal bodies and waypoints; else as `solve`.
    """
    watcher = watcher or Watcher()
    solution = prepare(scene, watcher)
    if not results.exists():
        return run_analyses(solution, watcher, keep)
    with blaming(results), Results(results) as file:
        check_same_input(solution.scene, solution.bodies, file)
        status = [file.attributes(name)["status"] if file.has(name) else "" for name in analyses(solution)]
        if all(found == "completed" for found in status):
            return None
        if file.attributes("/")["geometric_stiffening"] and not solution.stiffened:
            solution = stiffened(solution)
        kept = [name for name in file.analyses if file.has(f"{name}/{GROUP}")]
        solution = replace(solution, earlier={name: _earlier_run(solution, file, name) for name in kept})
    return run_analyses(solution, watcher, keep)


def write_state(file: h5py.File, solution: Solution) -> None:
    """Add to a results file, where the run was stopped, what `resume` needs."""
    write_input_files(file, solution.scene)
    for name, outcome in solution.outcomes.items() if is_kept(solution) else ():
        if goes_on(solution, outcome):
            _write_outcome(file[name].create_group(GROUP), outcome.computed)


def _write_outcome(group: h5py.Group, outcome: Outcome) -> None:
    for name in ROWS:
        if (rows := getattr(outcome, name)) is not None:
            group[name] = rows
    assert outcome.continuation is not None
    checkpoint, recording = outcome.continuation.checkpoint, outcome.continuation.recording
    write_tree_checkpoint(group, checkpoint)
    if recording is not None:
        group["recording/times"] = recording.times
        group["recording/states"] = recording.states
        names = {kind: name for name, kind in METHODS.items()}
        group["recording"].attrs["methods"] = json.dumps([(first, names[kind]) for first, kind in recording.methods])


def _earlier_run(solution: Solution, file: Results, name: str) -> EarlierRun:
    about, group = file.attributes(name), f"{name}/{GROUP}"
    rows = {row: file[f"{group}/{row}"] if file.has(f"{group}/{row}") else None for row in ROWS}
    if missing := [row for row in ROWS[:4] if rows[row] is None]:
        raise InputError(f"{file.path}: {group}/{missing[0]}: expected a dataset, found none")
    tau, F_p = rows.pop("tau"), rows.pop("F_p")
    motion = {key: values for key, values in rows.items() if values is not None}
    integrator = Choice(about["integrator"], about["integrator_reason"])
    counts = {count: about[count].item() for count in COUNTS}
    return EarlierRun(
        Motion(time=file.time(name), residual=file[f"{name}/constraint_violation"], **motion),
        Forces(tau, F_p),
        Statistics(status=about["status"], integrator=integrator, **counts),
        _continuation(solution, file, name),
        f"{file.path}: {group}",
    )


def _continuation(solution: Solution, file: Results, name: str) -> Continuation:
    about, group = file.attributes(name), f"{name}/{GROUP}"
    where, expected = f"{group}/checkpoint", len(file.time(name))
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
    if not file.has(f"{group}/recording"):
        return Continuation(checkpoint)
    analysis = next(analysis for analysis in solution.scene.analysis if analysis.name == name)
    assert isinstance(analysis, IntegratedAnalysis)
    times, states = (row_of_numbers(file, f"{group}/recording/{key}") for key in ("times", "states"))
    methods = _methods(file, f"{group}/recording")
    return Continuation(
        checkpoint, _core.Recording(times, states, methods, analysis.spectral_radius, analysis.tolerance)
    )


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
