"""Going on with a run in space that was stopped, from its results file: as `resume` in the plane."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ..common.errors import InputError
from ..common.hdf5 import blaming
from ..mbs import _core
from ..mbs.analysis.spatial_earlier import ROWS, EarlierSpatialRun
from ..mbs.analysis.spatial_run import SpatialRun
from ..mbs.solve.integrators import Choice
from ..run.enough import goes_on
from ..run.spatial import Keep, prepare_spatial, run_spatial
from ..run.spatial_prepare import stiffened_in_space
from ..run.spatial_solution import SpatialSolution
from ..run.watcher import Watcher
from ..scene.spatial import SpatialScene
from .file import Results
from .same_input import check_same_input, write_input_files
from .stopped import GROUP, STOPPED, analyses, is_kept, row_of_numbers
from .tree_checkpoint import read_tree_checkpoint, write_tree_checkpoint

COUNTS = ("steps", "evaluations", "wall_seconds")


def resume_spatial(
    scene: SpatialScene | Path, results: Path, watcher: Watcher, keep: Keep | None = None
) -> SpatialSolution | None:
    """`solve_spatial`, going on from the file `results`; None where that is complete. From the start if absent.

    Raises `InputError` where the file is not that of the same scene, modal bodies and waypoints; else as
    `solve_spatial`.
    """
    solution = prepare_spatial(scene, watcher)
    if not results.exists():
        return run_spatial(solution, watcher, keep)
    with blaming(results), Results(results) as file:
        check_same_input(solution.scene, solution.bodies, file)
        names = analyses(solution)
        if all(file.has(name) and file.attributes(name)["status"] == "completed" for name in names):
            return None
        if solution.scene.geometric_stiffening == "auto" and file.attributes("/")["geometric_stiffening"]:
            solution = stiffened_in_space(solution)
        kept = [name for name in file.analyses if file.has(f"{name}/{GROUP}")]
        solution = replace(solution, earlier={name: _earlier_run(file, name) for name in kept})
    return run_spatial(solution, watcher, keep)


def write_state_in_space(file: h5py.File, solution: SpatialSolution) -> None:
    """Add to a results file, where the run was stopped, what `resume_spatial` needs."""
    write_input_files(file, solution.scene)
    for name, run in solution.outcomes.items() if is_kept(solution) else ():
        if goes_on(solution, run) and run.checkpoint is not None:
            _write_run(file[name].create_group(GROUP), run, run.checkpoint)


def _write_run(group: h5py.Group, run: SpatialRun, checkpoint: _core.TreeCheckpoint) -> None:
    for name in ROWS:
        group[name] = getattr(run, name)
    write_tree_checkpoint(group, checkpoint)


def _earlier_run(file: Results, name: str) -> EarlierSpatialRun:
    about, group = file.attributes(name), f"{name}/{GROUP}"
    if missing := [row for row in ROWS if not file.has(f"{group}/{row}")]:
        raise InputError(f"{file.path}: {group}/{missing[0]}: expected a dataset, found none")
    checkpoint, expected = read_tree_checkpoint(file, f"{group}/checkpoint"), len(file.time(name))
    if checkpoint.outputs != expected or about["status"] not in (*STOPPED, "completed"):
        raise InputError(
            f"{file.path}: {group}: expected as many outputs as times, {expected}, found {checkpoint.outputs}"
        )
    kept: dict[str, Any] = {row: file[f"{group}/{row}"] for row in ROWS}
    kept |= {count: about[count].item() for count in COUNTS}
    return EarlierSpatialRun(
        time=file.time(name),
        integrator=Choice(about["integrator"], about["integrator_reason"]),
        status=about["status"],
        **kept,
        checkpoint=checkpoint,
        where=f"{file.path}: {group}",
        step_ends=row_of_numbers(file, f"{name}/step_ends") if file.has(f"{name}/step_ends") else np.zeros(0),
    )
