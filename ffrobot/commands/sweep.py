"""The command `sweep`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..common.errors import SolveError
from ..present.logs import logging_options, python_option
from .options import protect, runs_options, scene_argument

if TYPE_CHECKING:
    from ..batch.batch import Batch

MOST = 100_000  # runs


@click.command()
@scene_argument
@click.option("--vary", metavar="KEY=VALUES", multiple=True, required=True, help="Key with its values; repeatable.")
@click.option(
    "--sample", metavar="N", type=click.IntRange(1, MOST), help="N points of a Latin hypercube, not the full grid."
)
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True, help="Seed of the sample.")
@click.option(
    "--collect",
    metavar="DATASET[:max|rms|first|last|lowest]",
    multiple=True,
    help='Further columns, also "residual POINT" and "settling POINT"; repeatable.',
)
@click.option("--keep/--no-keep", default=True, show_default=True, help="Retention of the results files of the runs.")
@runs_options("SCENE.sweep", "Folder of the sweep")
@python_option
@logging_options
def sweep(
    scene_file: Path,
    vary: tuple[str, ...],
    sample: int | None,
    seed: int,
    collect: tuple[str, ...],
    batch: Batch,
    retry: bool,
    keep: bool,
    output: Path | None,
) -> None:
    """Parameter sweep: solve a scene for many values of its keys; one table of all runs, failed ones included.

    \b
    --vary links.link1.geometry.section.height=0.01:0.03:9   a key of a body's link file, 9 values
    --vary pzt.link1.thickness=1e-4:1e-3:5:log               evenly spaced in the logarithm
    --vary 'initial.state="static","undeformed"'             a list
    --vary gravity.1=-9.81,0                                 an entry of a list by its number, from 0

    Entries of lists of tables are selected by name or body. The same command resumes a stopped sweep. -j runs in
    parallel on one machine, mpirun and --scheduler on several. The exit code is 1 if no run completes.
    """  # noqa: D301 (click wants the backspace itself)
    from ..present.console import Display, summary_console
    from ..run.inputs import files_of
    from ..sweep.runs import missing_columns
    from ..sweep.sweep import drop_results, forget_failures, plan_sweep, print_table, run_sweep, stale_rows

    folder = output or scene_file.with_suffix(".sweep")
    protect(files_of(scene_file))
    plan = plan_sweep(scene_file, vary, folder, sample, seed, collect)
    if retry:
        forget_failures(plan)
    if changes := stale_rows(plan):
        click.echo(f"ffrobot: {changes}", err=True)
    with Display() as display:
        rows = run_sweep(plan, batch, display)
    for line in missing_columns(rows, plan.collect, plan.folder):
        click.echo(f"ffrobot: {line}", err=True)
    if not keep:
        drop_results(plan)
    print_table(plan.table, plan.keys, rows, plan.collected, summary_console())
    if not any(row.status == "completed" for row in rows):
        raise SolveError(f"{plan.table}: no run completed")
