"""The commands that compare designs: `sensitivity` and `optimise`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..present.logs import FILE, logging_options, python_option
from .options import runs_options
from .protect import protect


@click.command()
@click.argument("scene_file", metavar="SCENE.toml", type=FILE)
@click.option("--of", "goals", metavar="RESPONSE", multiple=True, required=True, help="Scalar response; repeatable.")
@click.option("--to", "keys", metavar="KEY,KEY …", multiple=True, required=True, help="Parameters; repeatable.")
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
@click.option("--figures/--no-figures", default=True, show_default=True, help="Tornado diagrams.")
@runs_options("SCENE.sensitivity")
@python_option
@logging_options
def sensitivity(
    scene_file: Path,
    goals: tuple[str, ...],
    keys: tuple[str, ...],
    step: float,
    tolerance: float | None,
    processes: int,
    retry: bool,
    figures: bool,
    output: Path | None,
) -> None:
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
    from ..design.record import print_sensitivity, write_sensitivity
    from ..design.sensitivity import sensitivity as find
    from ..design.studies import keep_study
    from ..present.progress import Display
    from ..present.summary import summary_console
    from ..run.inputs import files_of

    folder = output or scene_file.with_suffix(".sensitivity")
    protect(files_of(scene_file))
    to = [key for text in keys for key in text.split(",")]
    with Display() as display:
        found = find(
            scene_file, goals, to, folder,
            processes=processes, step=step, tolerance=tolerance, retry=retry, watcher=display,
        )  # fmt: skip
    print_sensitivity(found, summary_console())
    write_sensitivity(found, folder / "sensitivity.csv")
    click.echo(f"written    {folder / 'sensitivity.csv'}")
    for path in keep_study(found, folder, figures=figures):
        click.echo(f"written    {path}")


METHODS = ("auto", "slsqp", "trust-constr", "differential-evolution", "all")


@click.command()
@click.argument("scene_file", metavar="SCENE.toml", type=FILE)
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
    "--runs", "most", type=click.IntRange(1, 100_000), default=1000, show_default=True, help="Largest number of runs."
)
@click.option(
    "--tolerance",
    type=click.FloatRange(1e-10, 1e-3),
    default=1e-8,
    show_default=True,
    help="Tolerance of the runs, if the scene has a larger one.",
)
@click.option("--figures/--no-figures", default=True, show_default=True, help="Diagrams of the designs.")
@runs_options("SCENE.optimum")
@python_option
@logging_options
def optimise(scene_file: Path, output: Path | None, figures: bool, **options: Any) -> None:  # noqa: ANN401 (of `optimise.optimise`)
    """Optimisation: parameters and discrete choices that minimize an objective within limits.

    \b
    --minimise mass                                 responses as in "ffrobot sensitivity"
    --subject-to "peak joints.elbow.moment <= 20"
    --vary links.arm.geometry.section.outer=0.02:0.08
    --vary joint.1.gear_ratio=10:200:log            steps in the logarithm
    --vary trajectory.tip.duration,analysis.inverse.end=0.5:2     one parameter for several keys
    --vary "joint.1.gear_ratio in {50, 80, 100}"    a discrete set
    --vary "joint.1.gear_ratio,joint.1.rotor_inertia in {50:2e-5, 100:1.2e-5}"     rows of one
    --minimise mass --against "rms tip_error" --points 6     the least mass for six tip errors (Pareto front)

    Gradient searches start from the scene's own values (and --starts - 1 others); discrete sets are enumerated or
    searched by differential evolution. The same command resumes a stopped study. DIR/best has the optimal scene,
    DIR/designs.csv all designs with their responses, DIR/designs.png their parallel coordinates. The exit code is 1
    if no design satisfies the limits.
    """  # noqa: D301 (click wants the backspace itself)
    from ..common.errors import SolveError
    from ..design.optimise import optimise as find
    from ..design.optimum import print_optimum, write_optimum
    from ..design.studies import keep_study
    from ..present.progress import Display
    from ..present.summary import summary_console
    from ..run.inputs import files_of

    folder = output or scene_file.with_suffix(".optimum")
    protect(files_of(scene_file))
    points = options.pop("points")
    if options["against"] is not None:
        _trade_off(scene_file, folder, points, options, figures=figures)
        return
    del options["against"]
    with Display() as display:
        found = find(scene_file, options.pop("vary"), folder, watcher=display, **options)
    print_optimum(found, summary_console())
    write_optimum(found, folder / "optimum.csv")
    for path in (found.best_scene, found.designs, folder / "optimum.csv"):
        click.echo(f"written    {path}")
    for path in keep_study(found, folder, figures=figures):
        click.echo(f"written    {path}")
    if not found.feasible:
        raise SolveError(f"{scene_file}: no design found that keeps all limits: see the table of limits")


def _trade_off(scene_file: Path, folder: Path, points: int, options: dict[str, Any], *, figures: bool) -> None:
    """Of two goals: searches along gradients from one design to the next."""
    from ..common.errors import InputError, SolveError
    from ..design.front import trade_off
    from ..design.front_record import print_front, write_front
    from ..design.studies import keep_study
    from ..present.progress import Display
    from ..present.summary import summary_console

    method, starts, maximised, _ = (options.pop(key) for key in ("method", "starts", "maximise", "seed"))
    if maximised is not None or options["minimise"] is None:
        raise InputError("--against: expected --minimise RESPONSE with it: both responses are minimized")
    if method not in ("auto", "slsqp") or starts != 1:
        raise InputError(
            "--against: expected --method slsqp and one start: each search begins at its neighbour's design"
        )
    with Display() as display:
        found = trade_off(scene_file, options.pop("vary"), folder, points=points, watcher=display, **options)
    print_front(found, summary_console())
    write_front(found, folder / "front.csv")
    click.echo(f"written    {folder / 'front.csv'}")
    for path in keep_study(found, folder, figures=figures):
        click.echo(f"written    {path}")
    if not all(one.feasible for one in found.points):
        raise SolveError(f"{scene_file}: not all designs of the curve keep the limits: see the table")
