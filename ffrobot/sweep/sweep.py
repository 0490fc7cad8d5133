"""A sweep from its plan to its table; what is finished is not run again."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..common.errors import InputError
from ..common.files import write_atomically
from ..common.parallel import is_first, processes
from ..run.watcher import Watcher
from .files import write_run
from .runs import RESULTS, ROW, Row, Run, collected, finished_row, perform
from .table import write_table
from .variation import Value, Variation, grid, latin_hypercube, parse_variation

PLAN = "plan.json"


@dataclass(frozen=True)
class Sweep:
    """The runs of a scene: `points` are the combinations of the `variations`' values, one run each.

    `collect` names histories whose reductions become columns beside the standard ones; see `runs.REDUCTIONS`.
    """

    scene: Path
    variations: tuple[Variation, ...]
    points: tuple[tuple[Value, ...], ...]
    folder: Path
    collect: tuple[str, ...] = ()

    @property
    def keys(self) -> list[str]:
        """What is varied, as the user writes it."""
        return [variation.name for variation in self.variations]

    @property
    def collected(self) -> list[str]:
        """Columns of the table that `collect` asks for."""
        return [" ".join(collected(request)) for request in self.collect]

    @property
    def table(self) -> Path:
        """The file that all rows end in."""
        return self.folder / "table.csv"

    @property
    def runs(self) -> list[Run]:
        """In the order of the table."""
        return [Run(k, values, self.folder / "runs" / f"{k:04d}", self.collect) for k, values in enumerate(self.points)]


def plan_sweep(
    scene: Path, vary: Sequence[str], folder: Path, sample: int | None, seed: int, collect: Sequence[str]
) -> Sweep:
    """Every combination of the values, or `sample` points of a Latin hypercube.

    Raises `InputError` for a wrong `--vary` or `--collect`, a scene or link file that its first point makes wrong, and
    a folder that holds another sweep.
    """
    variations = tuple(parse_variation(text) for text in vary)
    for request in collect:
        collected(request)
    points = tuple(grid(variations) if sample is None else latin_hypercube(variations, sample, seed))
    sweep = Sweep(scene, variations, points, folder, tuple(collect))
    _check_first(sweep)
    _claim_folder(sweep)
    return sweep


def run_sweep(sweep: Sweep, side_by_side: int, watcher: Watcher) -> list[Row]:
    """The rows of all runs; failures are rows, too. The table in the sweep's folder grows with every run.

    `side_by_side` runs go at once, each in a process of its own. Under mpirun all processes call this: the first hands
    out the runs and has the rows, the others, on whatever machine they are, perform them (mpi4py.futures).
    """
    if not is_first():
        with _performed([], side_by_side):
            return []
    rows = {run.number: row for run in sweep.runs if (row := finished_row(run.folder)) is not None}
    waiting = [run for run in sweep.runs if run.number not in rows]
    for run in waiting:
        _write_files(sweep, run)
    watcher.stage(f"{len(waiting)} runs" + (f", {len(rows)} done before" if rows else ""))
    with _performed(waiting, side_by_side) as finished:
        for row in finished:
            rows[row.number] = row
            watcher.advance(len(rows), len(sweep.points))
            write_table(sweep.table, sweep.keys, [rows[k] for k in sorted(rows)])
    return [rows[k] for k in sorted(rows)]


@contextmanager
def _performed(runs: Sequence[Run], side_by_side: int) -> Iterator[Iterable[Row]]:
    """Rows of the runs as they finish; the body of the `with` ends when the last one is there."""
    if processes() > 1:
        from mpi4py.futures import MPICommExecutor, MPIPoolExecutor

        with MPICommExecutor() as entered:  # None but on the first process: the others serve it until it is done
            executor: MPIPoolExecutor | None = entered
            yield () if executor is None else executor.map(perform, runs, unordered=True)
        return
    with ThreadPoolExecutor(side_by_side) as threads:  # each waits for a process
        futures = [threads.submit(perform, run) for run in runs]
        try:
            yield (future.result() for future in as_completed(futures))
        finally:
            threads.shutdown(cancel_futures=True)


def _write_files(sweep: Sweep, run: Run) -> Path:
    changes = {v.key: value for v, value in zip(sweep.variations, run.values, strict=True)}
    return write_run(sweep.scene, changes, run.folder)


def _check_first(sweep: Sweep) -> None:
    """A key that does not exist is told before hundreds of runs fail of it."""
    from tempfile import TemporaryDirectory

    from ..fe_models.link_file import read_link
    from ..scene.load import load_scene

    with TemporaryDirectory() as folder:
        run = Run(0, sweep.points[0], Path(folder))
        try:
            scene = load_scene(_write_files(sweep, run))
            for body in scene.body:
                if body.link is not None:
                    read_link(body.link)
        except InputError as error:
            raise InputError(f"with {_describe(sweep, run)}:\n{str(error).replace(folder + os.sep, '')}") from None


def _describe(sweep: Sweep, run: Run) -> str:
    return ", ".join(f"{v.name} = {value}" for v, value in zip(sweep.variations, run.values, strict=True))


def _claim_folder(sweep: Sweep) -> None:
    """Start the folder of a sweep, or take up the same one; a folder of another sweep is left alone."""
    plan = json.dumps(
        {
            "scene": str(sweep.scene.absolute()),
            "keys": sweep.keys,
            "points": sweep.points,
            "collect": sweep.collect,
        }
    )
    path = sweep.folder / PLAN
    if path.exists() and path.read_text(encoding="utf-8") != plan:
        raise InputError(f"{sweep.folder}: output: expected a new folder or one of this very sweep, found another's")
    if not path.exists() and sweep.folder.exists() and any(sweep.folder.iterdir()):
        raise InputError(f"{sweep.folder}: output: expected a new folder, found one that holds other files")
    write_atomically(path, plan.encode(), "plan of the sweep", make_folder=True)


def forget_failures(sweep: Sweep) -> int:
    """Let runs that did not complete be run again; how many they are."""
    failed = [run for run in sweep.runs if (row := finished_row(run.folder)) and row.status != "completed"]
    for run in failed:
        (run.folder / ROW).unlink()
    return len(failed)


def drop_results(sweep: Sweep) -> None:
    """Delete the results files of the runs; the table stays."""
    for run in sweep.runs:
        (run.folder / RESULTS).unlink(missing_ok=True)
