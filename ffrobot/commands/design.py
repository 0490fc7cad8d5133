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
@click.option("--of", "goals", metavar="GOAL", multiple=True, required=True, help="A scalar result; repeatable.")
@click.option("--to", "keys", metavar="KEY,KEY …", multiple=True, required=True, help="Numbers; repeatable.")
@click.option(
    "--step",
    type=click.FloatRange(1e-6, 0.2),
    default=0.01,
    show_default=True,
    help="Largest change of a key, of its value.",
)
@click.option(
    "--tolerance",
    type=click.FloatRange(1e-10, 1e-3),
    help="Of the runs, where the scene has a larger one.  [default: 1e-07 where steps are repeated, 1e-09 elsewhere]",
)
@click.option("--figures/--no-figures", default=True, show_default=True, help="Whether tornado diagrams are drawn.")
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
    """Say what matters: derivatives of scalar results by numbers of a scene and its links.

    \b
    --of "peak joints.elbow.moment"             largest absolute value; rms, mean, integral likewise
    --of "at 0.3 inverse.points.arm.tip.deflection"   at a time (s), of the analysis "inverse"
    --of "energy joints.elbow"                  integral of the motor's power (J)
    --of "peak pzt.arm.required_voltage"        largest voltage
    --of "frequency 2 arm"  --of "mass arm"     of a link
    --to payload.0.mass,links.arm.geometry.length     keys as in sweeps

    Derivatives are differences of runs that take the same steps in time, where these can be repeated, and extrapolated
    central ones elsewhere, with an estimate of their error, beside them percent per percent.
    A peak is followed at its own time; where another one overtakes it, that is told. The same command takes up what
    was stopped, and computes again what has changed.
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
@click.option("--minimise", "--minimize", metavar="GOAL", help="What shall be least, a goal as of sensitivity.")
@click.option("--maximise", "--maximize", metavar="GOAL", help="Or what shall be largest.")
@click.option("--against", metavar="GOAL", help="Of which less is wanted too: a curve of both, the least of each.")
@click.option("--points", type=click.IntRange(3, 1000), default=8, show_default=True, help="Designs on that curve.")
@click.option("--subject-to", metavar='"GOAL <= NUMBER"', multiple=True, help='A limit, or with ">="; repeatable.')
@click.option("--vary", metavar="KEY=LOW:HIGH", multiple=True, required=True, help="What may change; repeatable.")
@click.option("--method", type=click.Choice(METHODS), default="auto", show_default=True, help="The optimiser.")
@click.option("--starts", type=click.IntRange(1, 1000), default=1, show_default=True, help="Searches along gradients.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Of what is drawn.")
@click.option("--runs", "most", type=click.IntRange(1, 100_000), default=1000, show_default=True, help="At most.")
@click.option(
    "--tolerance",
    type=click.FloatRange(1e-10, 1e-3),
    default=1e-8,
    show_default=True,
    help="Of the runs, where the scene has a larger one.",
)
@click.option("--figures/--no-figures", default=True, show_default=True, help="Whether the designs are drawn.")
@runs_options("SCENE.optimum")
@python_option
@logging_options
def optimise(scene_file: Path, output: Path | None, figures: bool, **options: Any) -> None:  # noqa: ANN401 (of `optimise.optimise`)
    """Find the best design: the numbers and rows of catalogues with which a goal is least, within limits.

    \b
    --minimise mass                                 goals as of "ffrobot sensitivity"
    --subject-to "peak joints.elbow.moment <= 20"
    --vary links.arm.geometry.section.outer=0.02:0.08
    --vary joint.1.gear_ratio=10:200:log            steps in the logarithm
    --vary trajectory.tip.duration,analysis.inverse.end=0.5:2     one number for several keys
    --vary "joint.1.gear_ratio in {50, 80, 100}"    a catalogue
    --vary "joint.1.gear_ratio,joint.1.rotor_inertia in {50:2e-5, 100:1.2e-5}"     rows of one
    --minimise mass --against "rms tip_error" --points 6     the least mass for six tip errors (Pareto front)

    Numbers are sought along gradients from the scene's own values (and --starts - 1 others), catalogues by trying all
    rows or by differential evolution. The same command takes up what was stopped. The best design's scene is in
    DIR/best, all designs with their goals in DIR/designs.csv and, as parallel coordinates, DIR/designs.png. Exit code 1
    where no design keeps the limits.
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
        raise InputError("--against: expected --minimise GOAL beside it: of both goals less is wanted")
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
