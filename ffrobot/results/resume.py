"""Going on with a run that was stopped, from its results file.

On Ctrl-C and where `max_steps` is used up, the results file keeps what the next step depends on. Analyses for
which that can be done for (`is_resumable`) go on from there, or are taken over where they are complete; all others are
run again.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.hdf5 import blaming
from ..common.tables import key_path
from ..common.version import program_version
from ..mbs import _core
from ..mbs.analysis.outcome import BODY_PEAKS, STEPS, Continuation, EarlierRun, Forces, Motion, Outcome, Statistics
from ..mbs.scene.analysis import IntegratedAnalysis
from ..mbs.solve.integrators import METHODS, Choice
from ..run.inputs import digest_of_file, named_files
from ..run.prepare import prepare, stiffened
from ..run.solution import Solution
from ..run.solve import Keep, run_analyses
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .file import Results

GROUP = "resume"  # in the group of an analysis
STOPPED = ("interrupted", "too many steps")
ROWS = ("q", "v", "a", "lambda_", "tau", "F_p")  # what results files do not hold anyway
COUNTS = ("steps", "rejected", "evaluations", "wall_seconds")
MAY_CHANGE = "max_steps"  # counts from where a run goes on


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
        _check_same_input(solution, file)
        status = [file.attributes(name)["status"] if file.has(name) else "" for name in _analyses(solution)]
        if all(found == "completed" for found in status):
            return None
        if file.attributes("/")["geometric_stiffening"] and not solution.stiffened:
            solution = stiffened(solution)
        kept = [name for name in file.analyses if file.has(f"{name}/{GROUP}")]
        solution = replace(solution, earlier={name: _earlier_run(solution, file, name) for name in kept})
    return run_analyses(solution, watcher, keep)


def write_state(file: h5py.File, solution: Solution) -> None:
    """Add to a results file, where the run was stopped, what `resume` needs."""
    file.attrs["input_files"] = json.dumps(_input_files(solution.scene))
    if not _stopped(solution) and not left_out(solution):
        return
    for name, outcome in solution.outcomes.items():
        if _goes_on(solution, outcome):
            _write_outcome(file[name].create_group(GROUP), outcome.computed)


def how_to_go_on(solution: Solution, command: str) -> str:
    """What a message about a run that was stopped adds; empty where it cannot be gone on with."""
    outcome = _stopped(solution)
    if outcome is None:
        return "".join(f'; {command} goes on with "{name}"' for name in left_out(solution)[:1])
    if _goes_on(solution, outcome):
        return f"; {command} goes on from t = {outcome.statistics.time_reached:.9g} s"
    return f'; {command} runs "{outcome.analysis.name}" again from its start'


def left_out(solution: Solution) -> list[str]:
    """Analyses that were not begun when the run was stopped, or ended by an error."""
    if any(outcome.failed and outcome.status not in STOPPED for outcome in solution.outcomes.values()):
        return []
    return [name for name in _analyses(solution) if name not in solution.outcomes]


def _stopped(solution: Solution) -> Outcome | None:
    return next((outcome for outcome in solution.outcomes.values() if outcome.status in STOPPED), None)


def _goes_on(solution: Solution, outcome: Outcome) -> bool:
    """Whether `outcome` is of use to `resume`; a search for modes or pieces has its own bodies and starts again."""
    searched = any("auto" in (body.modes, body.pieces) for body in solution.scene.body)
    return not searched and outcome.analysis.is_resumable


def _analyses(solution: Solution) -> list[str]:
    return [analysis.name for analysis in solution.scene.analysis]


def _write_outcome(group: h5py.Group, outcome: Outcome) -> None:
    for name in ROWS:
        if (rows := getattr(outcome, name)) is not None:
            group[name] = rows
    assert outcome.continuation is not None
    checkpoint, recording = outcome.continuation.checkpoint, outcome.continuation.recording
    group["checkpoint/state"] = checkpoint.state
    for name in (*BODY_PEAKS, "groups"):
        group[f"checkpoint/peaks/{name}"] = getattr(checkpoint.peaks, name)
    about = {"time": checkpoint.time, "outputs": checkpoint.outputs}
    group["checkpoint"].attrs.update(about | {name: getattr(checkpoint.steps, name) for name in STEPS})
    if recording is not None:
        group["recording/times"] = recording.times
        group["recording/states"] = recording.states


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
    checkpoint, expected = _checkpoint(file, f"{group}/checkpoint"), len(file.time(name))
    if checkpoint.outputs != expected or about["status"] not in (*STOPPED, "completed"):
        raise InputError(
            f"{file.path}: {group}: expected as many outputs as times, {expected}, found {checkpoint.outputs}"
        )
    if not file.has(f"{group}/recording"):
        return Continuation(checkpoint)
    analysis = next(analysis for analysis in solution.scene.analysis if analysis.name == name)
    assert isinstance(analysis, IntegratedAnalysis)
    times, states = (_vector(file, f"{group}/recording/{key}") for key in ("times", "states"))
    method = METHODS[about["integrator"]]
    return Continuation(
        checkpoint, _core.Recording(times, states, method, analysis.spectral_radius, analysis.tolerance)
    )


def _checkpoint(file: Results, group: str) -> _core.Checkpoint:
    about = file.attributes(group)
    try:
        return _core.Checkpoint(
            time=float(about["time"]),
            state=_vector(file, f"{group}/state"),
            steps=_core.StepHistory(**{name: about[name].item() for name in STEPS}),
            peaks=_core.Peaks(**{name: _vector(file, f"{group}/peaks/{name}") for name in (*BODY_PEAKS, "groups")}),
            outputs=int(about["outputs"]),
        )
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InputError(f"{file.path}: {group}: expected where the run has stopped, found {error}") from None


def _vector(file: Results, name: str) -> Array:
    values = file[name]
    if values.ndim != 1:
        raise InputError(f"{file.path}: {name}: expected a row of numbers, found an array of shape {values.shape}")
    return values


def _check_same_input(solution: Solution, file: Results) -> None:
    """Raise `InputError` naming the first thing that is not as it was."""
    found = next(_changes(solution, file), None)
    if found is not None:
        raise InputError(
            f"{file.path}: resume: expected results of the same input, found that {found} has changed; solve it from"
            " the start, or undo the change"
        )


def _changes(solution: Solution, file: Results) -> Iterator[str]:
    """What of the input is not that of the results file."""
    if file.ffrobot_version != program_version():
        yield f"ffrobot {file.ffrobot_version}, now {program_version()},"
    then, now = _without_limits(file.scene), _without_limits(tomllib.loads(solution.scene.text))
    loc = _first_difference(then, now)
    if loc is not None:
        yield f"the scene ({key_path(loc, now)})"
    for name, body in solution.bodies.items():
        if body.path is not None and body.file_hash != file.modal_files[name].sha256:
            yield f'the modal body of "{name}"'
    files = json.loads(file.attributes("/").get("input_files", "{}"))
    for name, digest in _input_files(solution.scene).items():
        if files.get(name) != digest:
            yield name


def _without_limits(scene: Mapping[str, Any]) -> dict[str, Any]:
    analyses = [{key: value for key, value in a.items() if key != MAY_CHANGE} for a in scene["analysis"]]
    return {**scene, "analysis": analyses}


def _first_difference(then: object, now: object, loc: tuple[int | str, ...] = ()) -> tuple[int | str, ...] | None:
    """Where two values of TOML differ first; None where they are equal."""
    if then == now:
        return None
    if isinstance(then, dict) and isinstance(now, dict):
        inner = ((key, then.get(key), now.get(key)) for key in now | then)
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        inner = ((k, *pair) for k, pair in enumerate(zip(then, now, strict=True)))
    else:
        return loc
    found = (_first_difference(old, new, (*loc, key)) for key, old, new in inner)
    return next((place for place in found if place is not None), loc)


def _input_files(scene: Scene) -> dict[str, str]:
    """SHA-256 of the files that a scene names besides links and modal bodies, by what messages call them."""
    tables, folder = tomllib.loads(scene.text), scene.path.parent
    waypoints = {entry["waypoints"] for entry in tables.get("trajectory", []) if "waypoints" in entry}
    calls = {folder / name: f"the waypoints {name}" for name in waypoints}
    besides = {key: value for key, value in tables.items() if key != "body"}
    return {calls.get(file, f"the file {file.name}"): digest_of_file(file) for file in named_files(besides, folder)}
