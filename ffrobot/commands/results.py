"""The commands on results files: `info`, `feasibility`, `linear`, `plot`, `view` and `report`."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ..common.errors import InputError
from ..common.outputs import protected
from ..design.studies import FiniteRange
from ..present.logs import FILE, together
from .options import output_option, reading

MOST = 100_000  # frames of a view
SECONDS, SCALE = FiniteRange(0.1, 600.0), FiniteRange(0.0)
movie_options = together(
    click.option("--movie", metavar="FILE.gif|.mp4", type=FILE, help="Movie of the motion, and no other file."),
    click.option("--seconds", metavar="S", type=SECONDS, default=8.0, help="Duration of the movie [8]."),
    click.option("--analysis", metavar="NAME", help="Analysis of the movie, or of the grid."),
    click.option("--scale", metavar="S", type=SCALE, help="Scale of deflections [chosen for visibility]."),
)


@click.command()
@click.argument("file", metavar="FILE.h5", type=FILE)
def info(file: Path) -> None:
    """List the contents of a modal body file or a results file."""
    from ..present.info import describe

    with reading(file):
        click.echo(describe(file))


@click.command()
@click.argument("results_file", metavar="RESULTS.h5", type=FILE)
@click.option("--analysis", metavar="NAME", help="Single analysis.")
@click.option("--catalog", metavar="MOTORS.csv", type=FILE, help="Catalog of motors to choose from (CSV or TOML).")
def feasibility(results_file: Path, analysis: str | None, catalog: Path | None) -> None:
    """Compare required torques and voltages of a results file with the limits, and list remedies.

    With a catalog: motors and gears that suffice, for each joint.
    """
    from ..present.console import summary_console
    from ..present.feasibility import feasibility_tables, print_motor_choice

    with reading(results_file):
        if catalog is None:
            summary_console().print(feasibility_tables(results_file, analysis), crop=False)
        else:
            print_motor_choice(results_file, catalog, analysis, summary_console())


@click.command()
@click.argument("results_file", metavar="RESULTS.h5", type=FILE)
@click.option("--analysis", metavar="NAME", help="Analysis [the first linear one].")
@output_option("FILE.npz|FILE.mat", "Output file [RESULTS.npz].")
def linear(results_file: Path, analysis: str | None, output: Path | None) -> None:
    """Export a linear model, or the controllers of closed-loop control: matrices A, B, C, D and their names."""
    from ..results.file import Results

    path = output or results_file.with_suffix(".npz")
    with reading(results_file), Results(results_file) as results:
        name = results.export_linear(analysis, path)
        what = "controllers" if results.has(f"{name}/control") else "linear model"
    click.echo(f"{path}: {what} of {name}")


@click.command()
@click.argument("file", metavar="RESULTS.h5|BODY.h5", type=FILE)
@output_option("DIR", "Folder for the figures; FILE.figures if absent.")
@click.option("--format", "formats", metavar="png,pdf,svg", default="png,pdf", help="One or several formats [png,pdf].")
@click.option(
    "--only", metavar="NAME", multiple=True, help='Figures of this name, or like "moment_*", or "*"; repeatable.'
)
@movie_options
def plot(
    file: Path, output: Path | None, formats: str, only: tuple[str, ...], movie: Path | None, **options: Any
) -> None:
    """Draw the figures of a results file, or mesh and modes of a modal body file.

    A file figures.toml next to the results selects the figures; default: the main ones of the standard figures. With
    --movie, a movie of the motion instead.
    """
    from ..pictures.figures.movie import write_motion
    from ..pictures.figures.plot import plot_file
    from ..pictures.movie_file import MovieOptions

    with reading(file):
        if movie is not None:
            _tell([movie], write_motion(file, movie, MovieOptions(**options)))
            return
        source = click.get_current_context().get_parameter_source
        if given := [name for name in options if source(name) is not ParameterSource.DEFAULT]:
            raise InputError(f"--{given[0]}: expected it with --movie only", "figures")
        paths = plot_file(file, output or file.with_suffix(".figures"), formats.lower().split(","), only)
    _tell(paths)


@click.command()
@click.argument("file", metavar="RESULTS.h5|BODY.h5", type=FILE)
@output_option("DIR", "Folder for the files; FILE.view if absent.")
@click.option(
    "--frames", metavar="N", type=click.IntRange(1, MOST), default=201, help="Largest number of time steps [201]."
)
@click.option("--time", metavar="SECONDS", type=FiniteRange(), help="Time of the picture [largest deflections].")
@click.option("--pictures/--no-pictures", default=None, help="PNG pictures [if PyVista can draw].")
@movie_options
def view(file: Path, output: Path | None, movie: Path | None, seconds: float, **options: Any) -> None:
    """Write links and motions as solids: VTKHDF files for ParaView, pictures by PyVista.

    Of a modal body file, the link with its mode shapes; of a results file, the moving and deforming bodies. With
    --movie, a movie by PyVista instead.
    """
    from ..pictures.movie_file import MovieOptions
    from ..pictures.view import Options, view_file, view_movie

    with reading(file):
        if movie is not None:
            wanted = MovieOptions(options["analysis"], seconds, options["scale"])
            _tell([movie], view_movie(file, movie, wanted))
            return
        viewed = view_file(file, output or file.with_suffix(".view"), Options(**options))
    _tell(viewed.paths, viewed.notes)


def _tell(paths: Iterable[Path], notes: Iterable[str] = ()) -> None:
    for path in paths:
        click.echo(path)
    for note in notes:
        click.echo(f"ffrobot: {note}", err=True)


@click.command()
@click.argument("results_files", metavar="RESULTS.h5|FOLDER …", nargs=-1, required=True, type=FILE)
@output_option("FILE.html", "Output file [RESULTS.html or FOLDER.html, of the first].")
def report(results_files: tuple[Path, ...], output: Path | None) -> None:
    """Write one self-contained HTML page: motion, histories, modes, tables.

    Several results files are compared side by side. Folders of sensitivity, optimize and uncertainty add their
    diagrams: tornado diagrams, designs of a search, bands, rankings. The page needs no network and no other file.
    """
    from ..pictures.report import write_report
    from ..pictures.studies.study import study_files

    studies = {file: study_files(file) for file in results_files}
    first = results_files[0]
    path = output or (first.parent / f"{first.resolve().name}.html" if first.is_dir() else first.with_suffix(".html"))
    solved = [file for file, inside in studies.items() if not inside]
    with protected(file for inside in studies.values() for file in inside), reading(*solved):
        write_report(results_files, path)
    click.echo(path)
