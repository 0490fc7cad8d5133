"""One solve from a scene to its results, for Python and the command line: prepared, resumed, kept and checked.

On Ctrl-C and where `max_steps` is used up, the results file keeps what the next step depends on. Analyses that allow
it (`is_resumable`) go on from there, or are taken over where they are complete; all others are run again.
"""

import json
import time
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..common import checksum
from ..common.errors import InputError, SolveError, StoppedError
from ..common.files import check_output
from ..common.hdf5 import blaming
from ..common.outputs import protected
from ..common.tables import key_path
from ..common.version import VERSION
from ..mbs.run.integrators import Choice
from ..mbs.run.record import Continuation, Run, Statistics
from ..run.bodies import LoadedBody
from ..run.inputs import digest_of_file, named_files
from ..run.prepare import prepare_scene, unsolved
from ..run.result import Solution
from ..run.solve import Keep, run_analyses, solve_scene
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .file import FORMAT, Results
from .write import GROUP, KEPT, ROWS, STOPPED, input_files, left_out, write_results

COUNTS = ("steps", "rejected", "evaluations", "wall_seconds")


def solve_and_keep(
    scene: Scene, path: Path | None, watcher: Watcher, again: str, *, resume: bool = False, wanted: Iterable[str] = ()
) -> Solution | None:
    """Run the analyses of a scene, and write the results file `path` if given, also before an error is raised.

    With `resume` they go on from that file; None if it is complete. `wanted`: names to which results are limited.
    `again`: the command that resumes the run, for messages. Raises as `solve_scene`, and `StoppedError` where a signal
    has cut a run short.
    """
    inputs = [scene.path, *named_files(tomllib.loads(scene.text), scene.path.parent)]
    kept: list[Solution] = []
    if path is not None:
        with protected(inputs):
            check_output(path, FORMAT)

    def keep(solution: Solution) -> None:
        began = time.perf_counter()
        if path is not None:
            with protected(inputs):
                write_results(solution, path)
        kept.append(replace(solution, seconds={**solution.seconds, "writing": time.perf_counter() - began}))

    try:
        if path is not None and resume:
            solution = resume_scene(scene, path, watcher, keep)
        else:
            solution = solve_scene(scene, watcher, keep, frozenset(wanted) or None)
    except SolveError as error:
        if not watcher.signal:
            raise
        go_on = "".join(how_to_go_on(one, again) for one in kept)
        raise StoppedError(f"{error}{go_on}", watcher.signal) from error
    return kept[-1] if kept else solution


def check_ended(solution: Solution, watcher: Watcher, again: str, scene_file: Path) -> None:
    """Raise `SolveError` where an analysis ended early, `StoppedError` where a signal interrupted it.

    `again`: the command that resumes the run, "" without a file; `scene_file`: for messages.
    """
    go_on = how_to_go_on(solution, again)
    try:
        for run in solution.outcomes.values():
            run.check_completed(go_on)
    except SolveError as error:
        raise StoppedError(str(error), watcher.signal) if watcher.signal else error from None
    if watcher.signal:
        done = "before all analyses" if left_out(solution) else "at the end, where peaks may be left out"
        raise StoppedError(f"{scene_file}: stopped on request {done}{go_on}", watcher.signal)


def how_to_go_on(solution: Solution, command: str) -> str:
    """The part of a message on how to resume a stopped run with `command`; empty without one."""
    if not command:
        return ""
    outcomes = {**solution.earlier, **solution.outcomes}
    for name in (analysis.name for analysis in solution.scene.analysis):
        if (outcome := outcomes.get(name)) is None:
            return f'; {command} resumes with "{name}"'
        if outcome.status in STOPPED and solution.goes_on(outcome):
            return f"; {command} resumes from t = {outcome.time_reached:.9g} s"
        if outcome.failed:
            return f'; {command} runs "{name}" again from its start' if outcome.status in STOPPED else ""
    return ""


def check_same_input(scene: Scene, bodies: Mapping[str, LoadedBody], file: Results) -> None:
    """Raise `InputError` naming the first part of scene, bodies or input files that differs from that of `file`."""
    for change in _changes(scene, bodies, file):
        raise InputError(
            f"{file.path}: resume: expected results of the same input",
            f"that {change} has changed; solve it from the start, or undo the change",
        )


def _changes(scene: Scene, bodies: Mapping[str, LoadedBody], file: Results) -> Iterator[str]:
    if file.ffrobot_version != VERSION:
        yield f"ffrobot {file.ffrobot_version}, now {VERSION},"
    if checksum.state(file.path) != "sound":  # the core looks at nothing that it is given
        yield "the file itself"
    then, now = _without_limits(file.scene), _without_limits(tomllib.loads(scene.text))
    loc = _first_difference(then, now)
    if loc is not None:
        yield f"the scene ({key_path(loc, now)})"
    for name, body in bodies.items():
        if body.path is not None and body.file_hash != file.modal_files[name].sha256:
            yield f'the modal body of "{name}"'
    files = json.loads(file.attributes("/").get("input_files", "{}"))
    for name, digest in input_files(scene).items():
        if files.get(name) != digest:
            yield name
    for name, digest in json.loads(file.attributes("/").get("imported_files", "{}")).items():
        if digest_of_file(scene.path.parent / name) != digest:
            yield f"the file {name}, which a Python file imports,"


def _without_limits(scene: Mapping[str, Any]) -> dict[str, Any]:
    # `max_steps` counts from where a run goes on.
    analyses = [{key: value for key, value in a.items() if key != "max_steps"} for a in scene["analysis"]]
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
    places = (_first_difference(old, new, (*loc, key)) for key, old, new in inner)
    return next((place for place in places if place is not None), loc)


def earlier_runs(file: Results, solution: Solution) -> dict[str, Run]:
    """The kept runs of the analyses of a solution, by name; one stopped before its first step begins anew."""
    runs = {}
    for analysis in solution.scene.analysis:
        name, group = analysis.name, f"{analysis.name}/{GROUP}"
        about = file.attributes(name) if file.has(group) else None
        if about is None or (about["steps"] == 0 and about["status"] != "completed"):
            continue
        states: dict[str, Any] = {row: file[f"{group}/{row}"] for row in ROWS}
        counts = {count: about[count].item() for count in COUNTS}
        ends = file[f"{name}/step_ends"] if file.has(f"{name}/step_ends") else np.zeros(0)
        choice = Choice(about["integrator"], about["integrator_reason"])
        kept: dict[str, Any] = {
            key: kind.of_bytes(file[f"{group}/{key}"].astype(np.uint8).tobytes())
            for key, kind in KEPT.items()
            if file.has(f"{group}/{key}")
        }
        runs[name] = Run(
            analysis=analysis,
            model=solution.model,
            time=file.time(name),
            statistics=Statistics(
                about["status"], choice, **counts, step_ends=ends, time_reached=kept["checkpoint"].time
            ),
            continuation=Continuation(**kept),
            **states,
        )
    return runs


def resume_scene(scene: Scene | Path, results: Path, watcher: Watcher, keep: Keep | None = None) -> Solution | None:
    """Run `solve_scene` from where the file `results` ends; None if that is complete. From the start if absent.

    Raises `InputError` where the file is not that of the same scene, modal bodies and waypoints; else as
    `solve_scene`. `keep` is called with the solution, also before an error is raised.
    """
    solution = prepare_scene(scene, watcher)
    if not results.exists():
        return run_analyses(solution, watcher, keep)
    with blaming(results), Results(results) as file:
        check_same_input(solution.scene, solution.bodies, file)
        names = [one.name for one in solution.scene.analysis]
        if all(file.has(name) and file.attributes(name)["status"] == "completed" for name in names):
            return None
        if solution.scene.geometric_stiffening == "auto" and file.attributes("/")["geometric_stiffening"]:
            solution = unsolved(replace(solution, stiffened=True))
        solution = replace(solution, earlier=earlier_runs(file, solution))
    return run_analyses(solution, watcher, keep)
