"""The command line. Heavy imports happen inside the commands that need them."""

from __future__ import annotations

import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from .bench.command import bench
from .common.errors import FfrobotError
from .common.interrupts import SIGNALS, EndOfCommand
from .common.parallel import end_all, is_first, on_first
from .design.command import sensitivity
from .exchange.command import export, import_
from .present.failures import describe, ready_streams, without_output
from .present.logs import FILE, LOGGER, logging_options, python_option

MOST = 100_000  # runs of a sweep, frames of a view

if TYPE_CHECKING:
    from .run.solution import Solution
    from .run.spatial_solution import SpatialSolution


def movie_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Which movie, of what, and how."""
    seconds = click.FloatRange(0.1, 600.0)
    for option in (
        click.option("--movie", metavar="FILE.gif|.mp4", type=FILE, help="Write a movie of the motion, no other file."),
        click.option("--seconds", metavar="S", type=seconds, default=8.0, help="That the movie plays [8]."),
        click.option("--analysis", metavar="NAME", help="Movie, or grid, of this analysis only."),
        click.option("--scale", metavar="S", type=float, help="Of deflections as drawn [as large as can be seen]."),
    ):
        command = option(command)
    return command


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="ffrobot")
def cli() -> None:
    """What motors and piezoelectric patches must do so that a flexible robot follows its path.

    \b
    Stage 1:  ffrobot link  LINK.toml   finite elements → modal body file
    Stage 2:  ffrobot solve SCENE.toml  modal bodies → moments and voltages
    Then:     ffrobot info, ffrobot plot, ffrobot view, ffrobot report
    """  # noqa: D301 (click wants the backspace itself)


@cli.command()
@click.argument("link_file", metavar="LINK.toml", type=FILE)
@click.option("-o", "--output", metavar="BODY.h5", type=FILE, help="Where to write [LINK.h5 beside the input].")
@click.option("--force", is_flag=True, help="Compute even if the file is up to date.")
@logging_options
def link(link_file: Path, output: Path | None, force: bool) -> None:
    """Compute the modal body file of one link (stage 1).

    Mesh, finite element model, modes under the reference condition of the link file, and the invariants that the
    dynamics needs. Nothing is computed when the output is up to date with the content of LINK.toml.
    """
    from .fe_models.link import make_link
    from .present.progress import Display
    from .run.inputs import files_of

    _protect(files_of(link_file))
    with Display() as display:
        outcome = make_link(link_file, output, force, display.stage)
    if not is_first():
        return
    body = outcome.body
    reused = f", {outcome.reused} from an earlier run" if outcome.reused else ""
    verb = f"computed in {outcome.seconds:.2f} s{reused}" if outcome.computed else "up to date"
    highest = body.frequency[body.eigenmode_count - 1]
    click.echo(f"{outcome.path}: {verb}; {body.modes_in_words}, {body.frequency[0]:.6g} … {highest:.6g} Hz")


@cli.command()
@click.argument("scene_file", metavar="SCENE.toml", type=FILE)
@click.option(
    "-o",
    "--output",
    metavar="RESULTS.h5",
    type=FILE,
    help="Where to write [SCENE.results.h5 beside the input].",
)
@click.option("--resume", is_flag=True, help="Go on with a run that was stopped, from its results file.")
@click.option("--strict", is_flag=True, help="Exit with 1 where there is a warning; results are written all the same.")
@python_option
@logging_options
def solve(scene_file: Path, output: Path | None, *, resume: bool, strict: bool) -> None:
    """Run the analyses of a scene (stage 2).

    Links given as .toml are taken through stage 1 first where they are not up to date. Prints a summary: time per
    stage, steps, constraint violation, and the largest voltage against its limit.

    Ctrl-C keeps what was computed; --resume goes on from there, and from the start where there are no results yet.
    """
    from .common.errors import SolveError, StoppedError
    from .common.files import check_output
    from .present.progress import Display
    from .present.summary import print_summary, summary_console
    from .results.file import FORMAT, Results
    from .results.resume import resume as resume_scene
    from .results.stopped import how_to_go_on, left_out
    from .results.write import write_results
    from .run.inputs import files_of
    from .run.solve import solve as solve_scene
    from .scene.spatial import is_spatial

    path = output or scene_file.with_suffix(".results.h5")
    _protect(files_of(scene_file))
    check_output(path, FORMAT)
    again = f"ffrobot solve {scene_file}{f' -o {output}' if output else ''} --resume"
    if is_spatial(scene_file):
        _solve_spatial(scene_file, path, again, resume=resume, strict=strict)
        return
    writing = 0.0

    def keep(solution: Solution) -> None:
        nonlocal writing
        began = time.perf_counter()
        write_results(solution, path)
        writing = time.perf_counter() - began

    with Display() as display:
        solution = resume_scene(scene_file, path, display, keep) if resume else solve_scene(scene_file, display, keep)
    if solution is None:
        click.echo(f"{path}: complete, nothing to go on with")
        return
    with Results(path) as results:
        verdict = results.verdict
    print_summary(solution, verdict, path, {**solution.seconds, "writing": writing}, summary_console())
    go_on = how_to_go_on(solution, again)
    try:
        for outcome in solution.outcomes.values():
            outcome.check_completed(go_on)
    except SolveError as error:
        raise StoppedError(str(error), display.signal) if display.signal else error from None
    if display.signal:
        done = "before all analyses" if left_out(solution) else "when all was computed and written"
        raise StoppedError(f"{scene_file}: stopped on request {done}{go_on}", display.signal)
    for name, result in solution.analyses.items() if strict else ():
        for text in result.warnings:
            raise SolveError(f'{scene_file}: analysis "{name}": {text} (a warning, and --strict)')


def _solve_spatial(scene_file: Path, path: Path, again: str, *, resume: bool, strict: bool) -> None:
    """The same for a scene in space; `again` is the command that goes on with it."""
    from .common.errors import SolveError, StoppedError
    from .present.progress import Display
    from .present.spatial import print_spatial_summary
    from .present.summary import summary_console
    from .results.file import Results
    from .results.spatial import write_spatial_results
    from .results.spatial_resume import resume_spatial
    from .results.stopped import how_to_go_on, left_out
    from .run.spatial import solve_spatial

    writing = 0.0

    def keep(solution: SpatialSolution) -> None:
        nonlocal writing
        began = time.perf_counter()
        write_spatial_results(solution, path)
        writing = time.perf_counter() - began

    with Display() as display:
        solution = (
            resume_spatial(scene_file, path, display, keep) if resume else solve_spatial(scene_file, display, keep)
        )
    if solution is None:
        click.echo(f"{path}: complete, nothing to go on with")
        return
    with Results(path) as results:
        verdict = results.verdict
    print_spatial_summary(solution, verdict, path, {**solution.seconds, "writing": writing}, summary_console())
    go_on = how_to_go_on(solution, again)
    try:
        for run in solution.outcomes.values():
            run.check_completed(go_on)
    except SolveError as error:
        raise StoppedError(str(error), display.signal) if display.signal else error from None
    if display.signal:
        done = "before all analyses" if left_out(solution) else "when all was computed and written"
        raise StoppedError(f"{scene_file}: stopped on request {done}{go_on}", display.signal)
    for name, result in solution.analyses.items() if strict else ():
        for text in result.warnings:
            raise SolveError(f'{scene_file}: analysis "{name}": {text} (a warning, and --strict)')


@cli.command()
@click.argument("file", metavar="FILE.h5", type=FILE)
def info(file: Path) -> None:
    """Say what a modal body file or a results file holds."""
    from .common.hdf5 import reading
    from .present.info import describe

    with reading(file):
        click.echo(describe(file))


@cli.command()
@click.argument("results_file", metavar="RESULTS.h5", type=FILE)
@click.option("--analysis", metavar="NAME", help="Of this analysis only.")
def feasibility(results_file: Path, analysis: str | None) -> None:
    """Say whether motors and patches can do what the analyses of a results file ask of them, and what would do."""
    from .common.hdf5 import reading
    from .present.feasibility import print_feasibility
    from .present.summary import summary_console

    with reading(results_file):
        print_feasibility(results_file, analysis, summary_console())


@cli.command()
@click.argument("file", metavar="RESULTS.h5|BODY.h5", type=FILE)
@click.option("-o", "--output", metavar="DIR", type=FILE, help="Folder for the figures; FILE.figures if absent.")
@click.option("--format", "formats", metavar="png,pdf,svg", default="png,pdf", help="One or several [png,pdf].")
@click.option("--only", metavar="NAME", multiple=True, help='Figures of this name, or like "moment_*"; repeatable.')
@movie_options
def plot(
    file: Path,
    output: Path | None,
    formats: str,
    only: tuple[str, ...],
    movie: Path | None,
    **options: Any,  # noqa: ANN401 (the fields of MovieOptions)
) -> None:
    """Draw the figures of a results file, or mesh and modes of a modal body file.

    Which ones and how, a file figures.toml beside the results says; without one, the standard figures are drawn. With
    --movie, a movie of the motion instead.
    """
    from .common.hdf5 import reading
    from .pictures.figures.movie import write_motion
    from .pictures.figures.plot import plot_file
    from .pictures.movie_file import MovieOptions

    with reading(file):
        if movie is not None:
            _tell([movie], write_motion(file, movie, MovieOptions(**options)))
            return
        paths = plot_file(file, output or file.with_suffix(".figures"), formats.lower().split(","), only)
    _tell(paths)


@cli.command()
@click.argument("file", metavar="RESULTS.h5|BODY.h5", type=FILE)
@click.option("-o", "--output", metavar="DIR", type=FILE, help="Folder for the files; FILE.view if absent.")
@click.option("--frames", metavar="N", type=click.IntRange(1, MOST), default=201, help="Time steps at most [201].")
@click.option("--time", metavar="SECONDS", type=float, help="Of the picture [where deflections are largest].")
@click.option("--pictures/--no-pictures", default=None, help="PNG pictures too [where PyVista can draw].")
@movie_options
def view(
    file: Path,
    output: Path | None,
    movie: Path | None,
    seconds: float,
    **options: Any,  # noqa: ANN401 (the fields of Options)
) -> None:
    """Write links and motions as solids: VTKHDF and XDMF files for ParaView, pictures by PyVista.

    Of a modal body file, the link with its mode shapes; of a results file, the moving and deforming bodies. With
    --movie, a movie by PyVista instead.
    """
    from .common.hdf5 import reading
    from .pictures.movie_file import MovieOptions
    from .pictures.view import Options, view_file, view_movie

    with reading(file):
        if movie is not None:
            wanted = MovieOptions(options["analysis"], seconds, options["scale"])
            _tell([movie], view_movie(file, movie, wanted))
            return
        viewed = view_file(file, output or file.with_suffix(".view"), Options(**options))
    _tell(viewed.paths, viewed.notes)


def _tell(paths: Iterable[Path], notes: Iterable[str] = ()) -> None:
    """What was written, and what was not as it should be."""
    for path in paths:
        click.echo(path)
    for note in notes:
        click.echo(f"ffrobot: {note}", err=True)


@cli.command()
@click.argument("results_files", metavar="RESULTS.h5 …", nargs=-1, required=True, type=FILE)
@click.option("-o", "--output", metavar="FILE.html", type=FILE, help="Where to write [RESULTS.html, of the first].")
def report(results_files: tuple[Path, ...], output: Path | None) -> None:
    """Write one self-contained HTML page: motion, histories, modes, tables.

    Several results files come side by side, for comparison. The page needs no network and no other file.
    """
    from .common.hdf5 import reading
    from .pictures.report import write_report

    path = output or results_files[0].with_suffix(".html")
    with reading(*results_files):
        write_report(results_files, path)
    click.echo(path)


@cli.command()
@click.argument("results_file", metavar="RESULTS.h5", type=FILE)
@click.option("--analysis", metavar="NAME", help="Of this analysis; the first linear one if absent.")
@click.option("-o", "--output", metavar="FILE.npz|FILE.mat", type=FILE, help="Where to write [RESULTS.npz].")
def linear(results_file: Path, analysis: str | None, output: Path | None) -> None:
    """Export the linear model of an analysis of kind "linear": matrices A, B, C, D with the names of their columns."""
    from .common.hdf5 import reading
    from .results.file import Results

    path = output or results_file.with_suffix(".npz")
    with reading(results_file), Results(results_file) as results:
        name = results.export_linear(analysis, path)
    click.echo(f"{path}: linear model of {name}")


@cli.command()
@click.argument("scene_file", metavar="SCENE.toml", type=FILE)
@click.option("--vary", metavar="KEY=VALUES", multiple=True, required=True, help="What takes which values; repeatable.")
@click.option(
    "--sample", metavar="N", type=click.IntRange(1, MOST), help="N points of a Latin hypercube, not the full grid."
)
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True, help="Of the sample.")
@click.option("--collect", metavar="DATASET[:max|rms|first|last]", multiple=True, help="Further columns; repeatable.")
@click.option(
    "-j", "--processes", type=click.IntRange(1, 1000), default=1, show_default=True, help="Runs side by side."
)
@click.option("--retry", is_flag=True, help="Run again what failed before.")
@click.option("--keep/--no-keep", default=True, show_default=True, help="Whether results files of the runs stay.")
@click.option("-o", "--output", metavar="DIR", type=FILE, help="Folder of the sweep [SCENE.sweep beside the input].")
@python_option
@logging_options
def sweep(
    scene_file: Path,
    vary: tuple[str, ...],
    sample: int | None,
    seed: int,
    collect: tuple[str, ...],
    processes: int,
    retry: bool,
    keep: bool,
    output: Path | None,
) -> None:
    """Solve a scene many times with some of its keys varied; one table of all runs, failed ones too.

    \b
    --vary links.link1.geometry.section.height=0.01:0.03:9   a key of a body's link file, 9 values
    --vary pzt.link1.thickness=1e-4:1e-3:5:log               evenly spaced in the logarithm
    --vary 'initial.state="static","undeformed"'             a list
    --vary gravity.1=-9.81,0                                 an entry of a list by its number, from 0

    Entries of lists of tables go by their name or body. The same command takes up a sweep that was stopped. Runs go
    side by side with -j on one machine, and on several under mpirun, where the first process hands them out.
    """  # noqa: D301 (click wants the backspace itself)
    from .present.progress import Display
    from .present.summary import summary_console
    from .run.inputs import files_of
    from .sweep import drop_results, forget_failures, plan_sweep, print_table, run_sweep, stale_rows

    folder = output or scene_file.with_suffix(".sweep")
    _protect(files_of(scene_file))
    plan = on_first(lambda: plan_sweep(scene_file, vary, folder, sample, seed, collect))
    if retry and is_first():
        forget_failures(plan)
    if is_first() and (changes := stale_rows(plan)):
        click.echo(f"ffrobot: {changes}", err=True)
    with Display() as display:
        rows = run_sweep(plan, processes, display)
    if not is_first():
        return
    if not keep:
        drop_results(plan)
    print_table(plan.table, plan.keys, rows, plan.collected, summary_console())


@cli.command()
@click.argument("file", metavar="LINK.toml|SCENE.toml", type=FILE)
@click.option("--measured", metavar="MODES.csv", type=FILE, required=True, help="Table: mode, frequency (Hz), …")
@click.option("--vary", metavar="KEY,KEY …", multiple=True, required=True, help="Keys to fit; repeatable.")
@click.option("--motors", type=click.Choice(["free", "held"]), help="Of a robot, as it was measured [free].")
@click.option("-o", "--output", metavar="FILE.toml", type=FILE, help="Where to write [FILE.fitted.toml].")
@click.option("--force", is_flag=True, help="Replace files of an earlier fit.")
@python_option
@logging_options
def fit(
    file: Path,
    measured: Path,
    vary: tuple[str, ...],
    motors: Literal["free", "held"] | None,
    output: Path | None,
    force: bool,
) -> None:
    """Fit keys of a link or a scene to measured natural frequencies; new files have what was found.

    \b
    ffrobot fit arm.toml --measured modes.csv --vary material.youngs_modulus
    ffrobot fit scene.toml --measured robot.csv --vary joint.elbow.stiffness,links.arm.material.youngs_modulus

    A link vibrates under its reference condition, a robot at the start of its scene. KEY=KEY: changed by one factor.
    Says how sure the values are; keys that the frequencies cannot tell apart are refused.
    """  # noqa: D301 (click wants the backspace itself)
    from .fit.fitting import fit_measured
    from .fit.table import print_fit
    from .present.summary import summary_console
    from .run.inputs import files_of

    _protect([*files_of(file), measured])
    keys = [key for text in vary for key in text.split(",")]
    found = fit_measured(file, measured, keys, output, motors=motors, force=force)
    print_fit(found, summary_console())


@cli.command()
@click.argument("kind", type=click.Choice(["link", "scene", "spatial", "figures"]))
def schema(kind: str) -> None:
    """Print the JSON schema of link, scene or figures files, or of scenes in space, for editors.

    \b
    ffrobot schema scene > scene.schema.json
    and, as the first line of a scene file:  #:schema ./scene.schema.json
    """  # noqa: D301 (click wants the backspace itself)
    import json

    from .schema import schema as schema_of

    click.echo(json.dumps(schema_of(kind), indent=2, ensure_ascii=False))


cli.add_command(bench)
cli.add_command(import_)
cli.add_command(export)
cli.add_command(sensitivity)


def _protect(paths: Iterable[Path]) -> None:
    """Write to none of these files as long as the command runs."""
    from .common.outputs import protected

    click.get_current_context().with_resource(protected(paths))


def main() -> None:
    """Run the command line.

    Exit code 0, 1 where a solve failed, 2 for wrong input, 130 after Ctrl-C, 143 after SIGTERM.
    """
    stop = EndOfCommand()
    LOGGER.propagate = False  # libraries give the root logger handlers of their own
    ready_streams()
    for number in SIGNALS:
        signal.signal(number, stop)
    try:
        cli(standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except Exception as error:
        if stop.number:  # not only Abort: libraries turn a KeyboardInterrupt into what they like, ImportError for one
            click.echo("ffrobot: stopped", err=True)
            sys.exit(128 + stop.number)
        message = describe(error)
        if message is None:
            LOGGER.error("failed", exc_info=True)
            traceback.print_exc()
            end_all()
            sys.exit(1)
        if is_first():
            LOGGER.error("%s", message)
            click.echo(f"ffrobot: {message}", err=True)
        without_output()
        sys.exit(error.exit_code if isinstance(error, FfrobotError) else 1)
    finally:  # nothing is left to keep: at the interpreter's end an interrupt would be a traceback
        for number in SIGNALS:
            signal.signal(number, signal.SIG_DFL)
