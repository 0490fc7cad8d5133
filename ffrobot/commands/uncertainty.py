"""The command `uncertainty`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import click

from ..present.logs import FILE, logging_options, python_option
from .options import runs_options
from .protect import protect


@click.command()
@click.argument("scene_file", metavar="SCENE.toml", type=FILE)
@click.option("--of", metavar="RESPONSE|HISTORY", multiple=True, required=True, help="Response or history; repeatable.")
@click.option(
    "--spread",
    metavar="KEY=SPREAD",
    multiple=True,
    required=True,
    help="Uncertain parameter with its distribution; repeatable.",
)
@click.option(
    "--samples", metavar="N", type=int, default=200, show_default=True, help="Number of samples of a Latin hypercube."
)
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True, help="Seed of the samples.")
@click.option(
    "--by", type=click.Choice(["samples", "gradients", "screening"]), default="samples", show_default=True,
    help="Method: samples, two runs per parameter, or elementary effects of many parameters (Morris).",
)  # fmt: skip
@click.option("--indices", is_flag=True, help="Sobol indices, with N/2 more runs per parameter.")
@click.option(
    "--trajectories", metavar="R", type=int, default=10, show_default=True,
    help="Number of trajectories of --by screening, each with one run per parameter and one more.",
)  # fmt: skip
@click.option("--figures/--no-figures", default=True, show_default=True, help="Diagrams of bands and rankings.")
@runs_options("SCENE.uncertainty")
@python_option
@logging_options
def uncertainty(
    scene_file: Path,
    of: tuple[str, ...],
    spread: tuple[str, ...],
    samples: int,
    seed: int,
    by: Literal["samples", "gradients", "screening"],
    indices: bool,
    trajectories: int,
    processes: int,
    retry: bool,
    figures: bool,
    output: Path | None,
) -> None:
    """Uncertainty quantification: propagate distributions of scene and link parameters to the results.

    \b
    --of "peak joints.elbow.moment"            responses as in `sensitivity`: mean, deviation, quantiles
    --of joints.elbow.moment                   a history: a band
    --spread payload.0.mass=±5%                uniform within 5 % (also "+-5%")
    --spread joint.elbow.stiffness=±20         … within 20 of the scene's value
    --spread links.arm.material.youngs_modulus=normal:3%     a normal distribution, its deviation
    --spread gravity.1=uniform:-9.83:-9.78     between two values

    --by screening finds the influential ones of many parameters with R runs for each and R more. Every number has an
    error estimate. The same command resumes a stopped study; failed runs are reported and omitted.
    """  # noqa: D301 (click wants the backspace itself)
    from ..common.errors import InputError
    from ..design.screening import Screening, screening
    from ..design.screening_record import print_screening, write_screening
    from ..design.studies import keep_study
    from ..design.uncertainty import Uncertainty
    from ..design.uncertainty import uncertainty as find
    from ..design.uncertainty_record import print_uncertainty, write_uncertainty
    from ..present.progress import Display
    from ..present.summary import summary_console
    from ..run.inputs import files_of

    if by == "screening" and indices:
        raise InputError("uncertainty: --indices: expected --by samples next to it, found --by screening")
    folder = output or scene_file.with_suffix(".uncertainty")
    protect(files_of(scene_file))
    runs: dict[str, Any] = {"seed": seed, "processes": processes, "retry": retry}
    found: Screening | Uncertainty
    with Display() as display:
        if by == "screening":
            found = screening(scene_file, of, spread, folder, trajectories=trajectories, watcher=display, **runs)
        else:
            found = find(
                scene_file, of, spread, folder, samples=samples, by=by, indices=indices, watcher=display, **runs
            )
    if isinstance(found, Screening):
        print_screening(found, summary_console())
        tables = [write_screening(found, folder)]
    else:
        print_uncertainty(found, summary_console())
        tables = write_uncertainty(found, folder)
    for path in (*tables, *keep_study(found, folder, figures=figures)):
        click.echo(f"written    {path}")
