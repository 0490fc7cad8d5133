"""The commands that compare designs: `sensitivity`, `optimise` and `uncertainty`.

Options have the names of the arguments of the functions in `design` that do the work, which have the defaults, too.
"""

# ruff: noqa: ANN401 (what those functions take, they check)

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..common.errors import InputError, SolveError
from ..present.logs import FILE, logging_options, python_option
from .options import F, protect, runs_options

if TYPE_CHECKING:
    from ..design.finding import Finding


def study_options(folder: str, figures: str) -> Callable[[F], F]:
    """Give a command its scene and the options of all studies: `figures` says what these are."""

    def add(command: F) -> F:
        for option in (
            logging_options,
            python_option,
            runs_options(folder),
            click.option("--figures/--no-figures", default=True, show_default=True, help=figures),
            click.argument("scene_file", metavar="SCENE.toml", type=FILE),
        ):
            command = option(command)
        return command

    return add


def _study(
    find: Callable[..., Finding], scene_file: Path, *args: object, folder: Path, figures: bool, **how: Any
) -> None:
    """Find, print, and write tables, the file for reports, and figures.

    Raises `SolveError` where that is not what was asked for.
    """
    from ..present.console import summary_console
    from ..present.progress import Display
    from ..run.inputs import files_of

    protect(files_of(scene_file))
    with Display() as display:
        found = find(scene_file, *args, folder, watcher=display, **how)
    found.print(summary_console())
    for path in (*found.write_tables(folder), *found.write_study(folder, figures=figures)):
        click.echo(f"written    {path}")
    if found.shortfall:
        raise SolveError(f"{scene_file}: {found.shortfall}")


@click.command()
@click.option("--of", metavar="RESPONSE", multiple=True, required=True, help="Scalar response; repeatable.")
@click.option("--to", metavar="KEY,KEY …", multiple=True, required=True, help="Parameters; repeatable.")
@click.option(
    "--step",
    type=click.FloatRange(1e-6, 0.2),
    default=0.01,
    show_default=True,
    help="Largest change of a parameter, relative to its value.",
)
@click.option(
    "--tolerance",
    type=click.FloatRange(1e-10, 1e-3),
    help="Tolerance of the runs, if the scene has a larger one.  [default: 1e-07 with reused time steps, else 1e-09]",
)
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
    central differences otherwise, with error estimates and in percent per percent. A peak is followed at its own
    time; a note reports if another peak becomes the largest. The same command resumes a stopped study and recomputes
    changed runs.
    """  # noqa: D301 (click wants the backspace itself)
    from ..design.sensitivity import sensitivity as find

    keys = [key for text in to for key in text.split(",")]
    _study(find, scene_file, of, keys, folder=output or scene_file.with_suffix(".sensitivity"), **how)


METHODS = ("auto", "slsqp", "trust-constr", "differential-evolution", "all")


@click.command()
@click.option("--minimise", "--minimize", metavar="RESPONSE", help="Response to minimize, as in sensitivity.")
@click.option("--maximise", "--maximize", metavar="RESPONSE", help="Response to maximize.")
@click.option("--against", metavar="RESPONSE", help="Second response to minimize: Pareto front of both.")
@click.option(
    "--points", type=click.IntRange(3, 1000), default=8, show_default=True, help="Number of designs on that front."
)
@click.option("--subject-to", metavar='"RESPONSE <= NUMBER"', multiple=True, help='Limit, or with ">="; repeatable.')
@click.option(
    "--vary", metavar="KEY=LOW:HIGH", multiple=True, required=True, help="Parameter with its range or set; repeatable."
)
@click.option("--method", type=click.Choice(METHODS), default="auto", show_default=True, help="The optimiser.")
@click.option("--starts", type=click.IntRange(1, 1000), default=1, show_default=True, help="Searches along gradients.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of random numbers.")
@click.option(
    "--runs", type=click.IntRange(1, 100_000), default=1000, show_default=True, help="Largest number of runs."
)
@click.option(
    "--tolerance",
    type=click.FloatRange(1e-10, 1e-3),
    default=1e-8,
    show_default=True,
    help="Tolerance of the runs, if the scene has a larger one.",
)
@study_options("SCENE.optimum", "Diagrams of the designs.")
def optimise(scene_file: Path, vary: tuple[str, ...], output: Path | None, **how: Any) -> None:
    """Optimisation: parameters and discrete choices that minimize an objective within limits.

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
    """  # noqa: D301 (click wants the backspace itself)
    folder, points = output or scene_file.with_suffix(".optimum"), how.pop("points")
    if how["against"] is None:
        from ..design.optimise import optimise as find

        del how["against"]
        _study(find, scene_file, vary, folder=folder, **how)
        return
    from ..design.front import trade_off

    method, starts, maximised, _ = (how.pop(key) for key in ("method", "starts", "maximise", "seed"))
    if maximised is not None or how["minimise"] is None:
        raise InputError("--against: expected --minimise RESPONSE with it: both responses are minimized")
    if method not in ("auto", "slsqp") or starts != 1:
        raise InputError(
            "--against: expected --method slsqp and one start: each search begins at its neighbour's design"
        )
    _study(trade_off, scene_file, vary, folder=folder, points=points, **how)


@click.command()
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
@study_options("SCENE.uncertainty", "Diagrams of bands and rankings.")
def uncertainty(
    scene_file: Path, of: tuple[str, ...], spread: tuple[str, ...], output: Path | None, trajectories: int, **how: Any
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
    error estimate. The same command resumes a stopped study; failed runs are listed and omitted.
    """  # noqa: D301 (click wants the backspace itself)
    folder = output or scene_file.with_suffix(".uncertainty")
    if how["by"] == "screening":
        from ..design.screening import screening

        if how["indices"]:
            raise InputError("uncertainty: --indices: expected --by samples next to it, found --by screening")
        rest = {key: value for key, value in how.items() if key not in ("samples", "by", "indices")}
        _study(screening, scene_file, of, spread, folder=folder, trajectories=trajectories, **rest)
        return
    from ..design.uncertainty import uncertainty as find

    _study(find, scene_file, of, spread, folder=folder, **how)
