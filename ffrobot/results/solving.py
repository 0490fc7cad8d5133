"""One solve from a scene to its results, for Python and the command line: prepared, resumed, kept and checked."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from ..common.errors import SolveError, StoppedError
from ..common.files import check_output
from ..common.outputs import protected
from ..run.inputs import named_files
from ..run.result import Solution
from ..run.solve import solve_scene
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .file import FORMAT
from .resume import how_to_go_on, left_out, resume_scene
from .write import write_results


def solve_and_keep(
    scene: Scene, path: Path | None, watcher: Watcher, again: str, *, resume: bool = False, wanted: Iterable[str] = ()
) -> Solution | None:
    """Run the analyses of a scene, which go on from the file `path` with `resume`, and write that file where given.

    Before an error is raised, too: all of it, or what is `wanted`. `again`: the command that resumes the run. None
    where nothing is left to run. Raises as `solve_scene`, and `StoppedError` where a signal has cut a run short.
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

    `again`: the command that resumes the run; empty without a file. `scene_file`: the scene, as it was named.
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
