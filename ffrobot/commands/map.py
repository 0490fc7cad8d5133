"""The command `map`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..common.errors import InputError
from ..present.logs import FILE, logging_options, python_option
from .options import batch_options, output_option, protect, scene_argument

if TYPE_CHECKING:
    from ..batch.batch import Batch
    from ..common.arrays import Array


@click.command("map")
@scene_argument
@click.option("--over", metavar="NAME=VALUES", multiple=True, required=True, help="Axis of the grid; repeatable.")
@click.option(
    "--point", metavar="BODY.POINT", help="Tool or point.  [default: that of the path, a tool, or of the last body]"
)
@click.option(
    "--orientation",
    type=click.Choice(["auto", "start", "free"]),
    default="auto",
    show_default="start, if the path of the scene has an orientation",
    help="Orientation of the tool over x, y, z.",
)
@click.option("--modes", type=click.IntRange(1, 50), default=3, show_default=True, help="Natural frequencies per pose.")
@click.option(
    "--response", metavar="FIRST:LAST:COUNT", help="Frequency response of the point, with these frequencies (Hz)."
)
@click.option("--milling", metavar="CUTTER.toml", type=FILE, help="Milling process: stable depths of cut.")
@click.option(
    "--covariance", metavar="FITTED.covariance.toml", type=FILE, help="Errors of a fit: deviations of stable depths."
)
@click.option("--figures/--no-figures", default=True, show_default=True, help="Pictures of the map.")
@batch_options("Number of parallel processes.")
@output_option("DIR", "Folder of the map [SCENE.map next to the input].")
@python_option
@logging_options
def map_(
    scene_file: Path,
    over: tuple[str, ...],
    point: str | None,
    orientation: str,
    modes: int,
    response: str | None,
    milling: Path | None,
    covariance: Path | None,
    figures: bool,
    batch: Batch,
    output: Path | None,
) -> None:
    """Map of the workspace: natural frequencies, stiffness, torque and deflection at rest, pose by pose.

    \b
    --over shoulder=-90*deg:90*deg:31 --over elbow=0:2:21    a grid of joint coordinates (rad or m)
    --over x=0.2:0.8:31 --over z=0.2:1.0:31                  a grid of places of the point (m), inverse kinematics
    --over turn=-90*deg:90*deg:7 --milling cutter.toml       turns of the tool about its axis

    Motors keep the pose; links and compliant gears deflect under weight and loads. Joints that the grid leaves open
    stay as near to the start of the scene as they can. The same command resumes a stopped map.
    """  # noqa: D301 (click wants the backspace itself)
    from ..map.map_file import TABLE, print_map, write_map
    from ..map.pose_map import make_map, plan_map
    from ..milling.process import read_milling
    from ..present.console import Display, summary_console
    from ..run.inputs import files_of

    if covariance and not milling:
        raise InputError("--covariance: expected --milling, too", "none")
    errors = None
    if covariance:  # what reads it loads more than a map does
        from ..fit.covariance import read_covariance, with_deviations

        errors = read_covariance(covariance)
    folder = output or scene_file.with_suffix(".map")
    protect([*files_of(scene_file), *(file for file in (milling, covariance) if file)])
    plan = plan_map(
        scene=scene_file,
        over=over,
        folder=folder,
        point=point,
        orientation=orientation,
        count=modes,
        frequencies=_frequencies(response),
        milling=read_milling(milling) if milling else None,
    )
    with Display() as display:
        made = make_map(plan, batch, display)
        if errors:
            display.stage("deviations of stable depths")
            made = with_deviations(made, errors)
    path, console = write_map(made), summary_console()
    print_map(made, console)
    if figures:
        from ..pictures.studies.pose_map import draw_map

        for picture in draw_map(made):
            console.print(f"figure     {picture}", soft_wrap=True)
    console.print(f"table      {folder / TABLE}", soft_wrap=True)
    console.print(f"map        {path}", soft_wrap=True)


def _frequencies(text: str | None) -> Array:
    """FIRST:LAST:COUNT in Hz, evenly spaced; none without a text."""
    import numpy as np

    if text is None:
        return np.zeros(0)
    try:
        first, last, count = text.split(":")
        ends, number = (float(first), float(last)), int(count)
    except ValueError:
        ends, number = (0.0, 0.0), 0
    if not (0.0 <= ends[0] <= ends[1] < np.inf and 1 <= number <= 10_000):
        raise InputError("--response: expected FIRST:LAST:COUNT in Hz, such as 1:100:200", f'"{text}"')
    return np.linspace(*ends, number)
