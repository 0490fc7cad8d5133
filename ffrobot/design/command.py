"""The command line of `ffrobot sensitivity`. Heavy imports happen inside, as in `cli`."""

from __future__ import annotations

from pathlib import Path

import click

from ..present.logs import FILE, logging_options, python_option


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
    default=1e-9,
    show_default=True,
    help="Of the runs, where the scene has a larger one.",
)
@click.option(
    "-j", "--processes", type=click.IntRange(1, 1000), default=1, show_default=True, help="Runs side by side."
)
@click.option("--retry", is_flag=True, help="Run again what failed before.")
@click.option("--figures/--no-figures", default=True, show_default=True, help="Whether tornado diagrams are drawn.")
@click.option("-o", "--output", metavar="DIR", type=FILE, help="Folder [SCENE.sensitivity beside the input].")
@python_option
@logging_options
def sensitivity(
    scene_file: Path,
    goals: tuple[str, ...],
    keys: tuple[str, ...],
    step: float,
    tolerance: float,
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

    Derivatives are extrapolated central differences with an estimate of their error, beside them percent per percent.
    A peak is followed at its own time; where another one overtakes it, that is told. The same command takes up what
    was stopped, and computes again what has changed.
    """  # noqa: D301 (click wants the backspace itself)
    from ..common.outputs import protected
    from ..present.progress import Display
    from ..present.summary import summary_console
    from ..run.inputs import files_of
    from .record import print_sensitivity, write_sensitivity
    from .sensitivity import sensitivity as find

    folder = output or scene_file.with_suffix(".sensitivity")
    click.get_current_context().with_resource(protected(files_of(scene_file)))
    to = [key for text in keys for key in text.split(",")]
    with Display() as display:
        found = find(
            scene_file, goals, to, folder,
            processes=processes, step=step, tolerance=tolerance, retry=retry, watcher=display,
        )  # fmt: skip
    print_sensitivity(found, summary_console())
    write_sensitivity(found, folder / "sensitivity.csv")
    click.echo(f"written    {folder / 'sensitivity.csv'}")
    if figures:
        from .tornado import write_tornados

        for path in write_tornados(found, folder):
            click.echo(f"written    {path}")
