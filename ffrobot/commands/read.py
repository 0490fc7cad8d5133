"""The commands that say what files hold: `info`, `feasibility`, `linear` and `pose`."""

from pathlib import Path

import click

from ..present.logs import FILE, logging_options, python_option
from .options import output_option, protect_scene, reading, scene_argument


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

    With a catalog: motors and gears that can do it, for each joint.
    """
    from ..present.console import summary_console
    from ..present.feasibility import feasibility_tables, print_motor_choice

    with reading(results_file):
        if catalog is None:
            summary_console().print(feasibility_tables(results_file, analysis))
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
@scene_argument
@python_option
@logging_options
def pose(scene_file: Path) -> None:
    """Print the posture in which a scene starts, and the other ones that reach the same places (elbow, wrist)."""
    from ..present.console import Display, summary_console
    from ..present.start_postures import print_start

    protect_scene(scene_file)
    with Display() as display:
        print_start(scene_file, display, summary_console())
