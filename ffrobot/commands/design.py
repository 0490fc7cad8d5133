"""The commands that compare designs: `sweep`, `sensitivity`, `optimise` and `uncertainty`.

Options of the last three are parameters of the functions of `design.studies` that do the work.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..common.errors import InputError, SolveError
from ..design import studies
from ..present.logs import logging_options, python_option, together
from .options import F, options_of, protect_scene, runs_options, scene_argument

if TYPE_CHECKING:
    from ..batch.batch import Batch
    from ..design.finding import Finding


def study_options(folder: str, figures: str) -> Callable[[F], F]:
    """Decorator: add the options of studies and SCENE; `folder`: default of `-o`; `figures`: help of `--figures`."""
    return together(
        logging_options,
        python_option,
        runs_options(folder),
        click.option("--figures/--no-figures", default=True, show_default=True, help=figures),
        scene_argument,
    )


def _study(
    find: "Callable[..., Finding]",
    scene_file: Path,
    *args: object,
    folder: Path,
    figures: bool,
    batch: "Batch",
    **how: Any,
) -> None:
    """Find, print, and write tables, the file for reports, and figures. Raises `SolveError` for a shortfall."""
    from ..present.console import Display, summary_console

    protect_scene(scene_file)
    with Display() as display:
        study = find(scene_file, *args, folder, executor=batch, watcher=display, **how)
    study.print(summary_console())
    for path in (*study.write_tables(folder), *study.write_study(folder, figures=figures)):
        click.echo(f"written    {path}")
    if study.shortfall:
        raise SolveError(f"{scene_file}: {study.shortfall}")


@click.command()
@options_of(studies.sensitivity, "of", "to", "step", "tolerance")
@study_options("SCENE.sensitivity", "Tornado diagrams.")
def sensitivity(scene_file: Path, of: tuple[str, ...], to: tuple[str, ...], output: Path | None, **how: Any) -> None:
    """Sensitivity analysis: derivatives of scalar responses by parameters of a scene and its links.

    \b
    --of "peak joints.elbow.moment"             largest absolute value; rms, mean, integral likewise
    --of "at 0.3 inverse.points.arm.tip.deflection"   at a time (s), of the analysis "inverse"
    --of "energy joints.elbow"                  integral of the motor's power (J)
    --of "peak pzt.arm.required_voltage"        largest voltage
    --of "frequency 2 arm"  --of "mass arm"     of a link
    --to payload.0.mass,links.arm.geometry.length     keys as in sweeps

    Derivatives are finite differences of runs with the same time steps if these can be reused, and extrapolated
    central differences otherwise, with error estimates and in percent per percent. Derivatives of a peak are those at
    its own time; a note appears if another peak becomes the largest. The same command resumes a stopped study and
    recomputes changed runs.
    """
    keys = [key for text in to for key in text.split(",")]
    _study(studies.sensitivity, scene_file, of, keys, folder=output or scene_file.with_suffix(".sensitivity"), **how)


@click.command()
@options_of(studies.optimise, "minimise", "maximise")
@options_of(studies.trade_off, "against", "points")
@options_of(studies.optimise, "subject_to", "vary", "method")
@options_of(studies.optimise, "starts", "seed", "runs", "tolerance")
@study_options("SCENE.optimum", "Diagrams of the designs.")
def optimise(scene_file: Path, vary: tuple[str, ...], output: Path | None, **how: Any) -> None:
    """Optimization: parameters and discrete choices that minimize an objective within limits.

    \b
    --minimise mass                                 responses as in "ffrobot sensitivity"
    --subject-to "peak joints.elbow.moment <= 20"
    --vary links.arm.geometry.section.outer=0.02:0.08
    --vary joint.1.gear_ratio=10:200:log            steps in the logarithm
    --vary trajectory.tip.duration,analysis.inverse.end=0.5:2     one parameter for several keys
    --vary "joint.1.gear_ratio in {50, 80, 100}"    a discrete set
    --vary "joint.1.gear_ratio,joint.1.rotor_inertia in {50:2e-5, 100:1.2e-5}"     pairs
    --vary "motor elbow in motors.csv" --minimise "motors mass"     a catalog as in feasibility; also cost, share
    --minimise mass --against "rms tip_error" --points 6     the least mass for six tip errors (Pareto front)

    Gradient searches start from the scene's own values (and --starts - 1 others); discrete sets are enumerated or
    searched by differential evolution. The same command resumes a stopped study. DIR/best has the optimal scene,
    DIR/designs.csv all designs with their responses, DIR/designs.png their parallel coordinates. The exit code is 1
    if no design satisfies the limits.
    """
    folder, points = output or scene_file.with_suffix(".optimum"), how.pop("points")
    if how["against"] is None:
        del how["against"]
        _study(studies.optimise, scene_file, vary, folder=folder, **how)
        return
    method, starts, maximised, _ = (how.pop(key) for key in ("method", "starts", "maximise", "seed"))
    if maximised is not None or how["minimise"] is None:
        raise InputError("--against: expected --minimise RESPONSE with it: both responses are minimized")
    if method not in ("auto", "slsqp") or starts != 1:
        raise InputError(
            "--against: expected --method slsqp and one start: each search begins at its neighbor's design"
        )
    _study(studies.trade_off, scene_file, vary, folder=folder, points=points, **how)


@click.command()
@options_of(studies.uncertainty, "of", "spread", "samples")
@options_of(studies.uncertainty, "seed", "by", "indices")
@study_options("SCENE.uncertainty", "Diagrams of bands and rankings.")
def uncertainty(
    scene_file: Path, of: tuple[str, ...], spread: tuple[str, ...], output: Path | None, **how: Any
) -> None:
    """Uncertainty quantification: propagate distributions of scene and link parameters to the results.

    \b
    --of "peak joints.elbow.moment"            responses as in `sensitivity`: mean, deviation, quantiles
    --of joints.elbow.moment                   a history: a band
    --spread payload.0.mass=±5%                uniform within 5 % (also "+-5%")
    --spread joint.elbow.stiffness=±20         … within 20 of the scene's value
    --spread links.arm.material.youngs_modulus=normal:3%     a normal distribution, its deviation
    --spread gravity.1=uniform:-9.83:-9.78     between two values

    --by gradients ranks many parameters with two runs for each. Every number has an error estimate. The same command
    resumes a stopped study; failed runs are listed and omitted.
    """
    _study(studies.uncertainty, scene_file, of, spread, folder=output or scene_file.with_suffix(".uncertainty"), **how)


@click.command()
@scene_argument
@click.option("--vary", metavar="KEY=VALUES", multiple=True, required=True, help="Key with its values; repeatable.")
@click.option(
    "--sample", metavar="N", type=click.IntRange(1, 100_000), help="N points of a Latin hypercube, not the full grid."
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
    scene_file: Path, vary: tuple[str, ...], output: Path | None, batch: "Batch", retry: bool, keep: bool, **which: Any
) -> None:
    """Parameter sweep: solve a scene for many values of its keys; one table of all runs, failed ones included.

    \b
    --vary links.link1.geometry.section.height=0.01:0.03:9   a key of a body's link file, 9 values
    --vary pzt.link1.thickness=1e-4:1e-3:5:log               evenly spaced in the logarithm
    --vary 'initial.state="static","undeformed"'             a list
    --vary gravity.1=-9.81,0                                 an entry of a list by its number, from 0

    Entries of lists of tables are selected by name or body. The same command resumes a stopped sweep. -j runs in
    parallel on one machine, mpirun and --scheduler on several. The exit code is 1 if no run completes.
    """
    from ..present.console import Display, summary_console
    from ..sweep.sweep import drop_results, forget_failures, plan_sweep, print_table, run_sweep, stale_rows

    folder = output or scene_file.with_suffix(".sweep")
    protect_scene(scene_file)
    plan = plan_sweep(scene_file, vary, folder, **which)
    if retry:
        forget_failures(plan)
    if changes := stale_rows(plan):
        click.echo(f"ffrobot: {changes}", err=True)
    with Display() as display:
        rows = run_sweep(plan, batch, display)
    if not keep:
        drop_results(plan)
    print_table(plan, rows, summary_console())
    if not any(row.status == "completed" for row in rows):
        raise SolveError(f"{plan.table}: no run completed")
