"""Going on with a run that was stopped, from its results file.

On Ctrl-C and where `max_steps` is used up, the results file keeps what the next step depends on. Analyses for which
that can be done (`is_resumable`) go on from there, or are taken over where they are complete; all others are run again.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5py

from ..common.hdf5 import blaming
from ..run.prepare import with_stiffening
from ..run.refinement import goes_on
from ..run.solution import Solution
from ..run.solve import Keep, prepare_scene, run_analyses
from ..run.watcher import Watcher
from ..scene.scene import Scene
from .earlier_runs import earlier_runs, write_earlier_run
from .file import Results
from .same_input import check_same_input, write_input_files
from .stopped import GROUP, analyses, is_kept


def resume_scene(scene: Scene | Path, results: Path, watcher: Watcher, keep: Keep | None = None) -> Solution | None:
    """`solve_scene`, going on from the file `results`; None where that is complete. From the start if absent.

    Raises `InputError` where the file is not that of the same scene, modal bodies and waypoints; else as
    `solve_scene`.
    """
    solution = prepare_scene(scene, watcher)
    if not results.exists():
        return run_analyses(solution, watcher, keep)
    with blaming(results), Results(results) as file:
        check_same_input(solution.scene, solution.bodies, file)
        names = analyses(solution)
        if all(file.has(name) and file.attributes(name)["status"] == "completed" for name in names):
            return None
        if solution.scene.geometric_stiffening == "auto" and file.attributes("/")["geometric_stiffening"]:
            solution = with_stiffening(solution)
        solution = replace(solution, earlier=earlier_runs(file, solution.scene.analysis))
    return run_analyses(solution, watcher, keep)


def write_state(file: h5py.File, solution: Solution) -> None:
    """Add to a results file, where the run was stopped, what `resume_scene` needs."""
    write_input_files(file, solution.scene)
    for name, run in solution.outcomes.items() if is_kept(solution) else ():
        if goes_on(solution, run) and run.continuation is not None:
            write_earlier_run(file[name].create_group(GROUP), run)
