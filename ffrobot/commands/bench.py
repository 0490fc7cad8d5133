"""The command `bench`."""

from __future__ import annotations

from pathlib import Path

import click

from ..bench import OF_A_SCENE
from ..present.logs import logging_options, python_option
from .options import POSITIVE, output_option, protect, scene_argument


def _texts(context: click.Context, parameter: click.Parameter, value: str | None) -> list[str] | None:
    """The parts of a list with commas."""
    return None if value is None else [part.strip() for part in value.split(",")]


def _numbers(context: click.Context, parameter: click.Parameter, value: str | None) -> list[float] | None:
    """Likewise, as numbers."""
    try:
        return None if value is None else [float(part) for part in value.split(",")]
    except ValueError:
        raise click.BadParameter(f'expected numbers with commas between them, found "{value}"') from None


@click.command()
@scene_argument
@output_option("DIR", "Folder [SCENE.bench next to the scene].")
@click.option("--analysis", metavar="NAME", help="Analysis of the scene [the first that integrates].")
@click.option("--integrators", metavar="A,B", callback=_texts, help="Integrators [all, and auto].")
@click.option("--tolerances", metavar="T,T", callback=_numbers, help="Tolerances [1e-2 … 1e-7].")
@click.option(
    "--repeat", metavar="N", type=click.IntRange(1), default=5, show_default=True, help="Number of repetitions."
)
@click.option(
    "--budget",
    metavar="S",
    type=POSITIVE,
    default=20.0,
    show_default=True,
    help="Largest duration of a run, s; longer ones stay in the tables without errors.",
)
@click.option("--part", "parts", multiple=True, type=click.Choice(OF_A_SCENE), help="Single part; repeatable [both].")
@python_option
@logging_options
def bench(
    scene_file: Path,
    output: Path | None,
    analysis: str | None,
    integrators: list[str] | None,
    tolerances: list[float] | None,
    repeat: int,
    budget: float,
    parts: tuple[str, ...],
) -> None:
    """Measure run time against error, and where the error comes from.

    One of the scene's analyses with every integrator at every tolerance, against a reference that two integrators
    agree on. Then the error of its mesh, of its number of modes and of time integration. Tables as CSV and JSON,
    figures as PNG and PDF.
    """
    from ..bench.campaign import Campaign
    from ..bench.precision import INTEGRATORS, TOLERANCES, Settings
    from ..present.console import Display, summary_console
    from ..run.inputs import files_of

    protect(files_of(scene_file))
    settings = Settings(integrators or INTEGRATORS, tolerances or TOLERANCES, repeat, budget)
    folder = output or scene_file.with_suffix(".bench")
    with Display() as display:
        campaign = Campaign(folder, settings, display, summary_console())
        campaign.scene(scene_file, analysis, folder, parts or OF_A_SCENE)
