"""The command `smooth`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..common.errors import InputError
from ..common.files import write_atomically
from ..present.logs import FILE, logging_options
from .options import POSITIVE, output_option, protect, scene_argument


@click.command()
@scene_argument
@click.option("--path", "motion", metavar="MOTION", type=FILE, help="Recorded motion [trajectories of the scene].")
@click.option(
    "--servo",
    metavar="[JOINT=]HZ|FILE|NUM/DEN",
    multiple=True,
    help="Position controllers: natural frequency, CSV of a measured response, or polynomials.  [default: 20]",
)
@click.option(
    "--damping-ratio", type=POSITIVE, default=0.8, show_default=True, help="Damping ratio of controllers given by HZ."
)
@click.option(
    "--point", metavar="BODY.POINT", help="Point whose vibration counts.  [default: a tool, or of the last body]"
)
@click.option(
    "--settled", metavar="M", type=POSITIVE, default=1e-4, show_default=True, help="Allowed vibration at the end."
)
@click.option("--acceleration", metavar="LIMIT", type=POSITIVE, help="Limit of all joints (rad/s², m/s²).")
@click.option("--jerk", metavar="LIMIT", type=POSITIVE, help="Limit of all joints (rad/s³, m/s³).")
@click.option("--degrees", is_flag=True, help="Angles of the file are in degrees.")
@click.option("--rate", metavar="HZ", type=POSITIVE, default=125.0, show_default=True, help="Rate of new set points.")
@click.option(
    "--write",
    "kind",
    metavar="averaged|slower|shaped|inverted",
    default="",
    help="Kind of motion to write.  [default: the first to settle]",
)
@output_option(
    "OUT.json|.csv|.rosbag2", "New motion, with OUT.png and OUT.report.html [SCENE.smooth.json next to the input]."
)
@click.option("--force", is_flag=True, help="Replacement of an existing file.")
@logging_options
def smooth(
    scene_file: Path, motion: Path | None, servo: tuple[str, ...], output: Path | None, *, force: bool, **how: Any
) -> None:
    """Find out why a robot vibrates on a recorded motion, and a motion on the same path that leaves less vibration.

    MOTION is a CSV table of joint positions with times, a JointTrajectory (JSON, YAML), or a bag of ROS. Compliant
    gears (`stiffness` of joints) and flexible links vibrate; motors follow set points through position controllers.
    New motions are averaged, slower, shaped for natural frequencies, or inverted: motors lead by the strain of their
    gears. Each is simulated; OUT is the one that settles first, or that of --write.
    """
    from ..present.console import Display, summary_console
    from ..run.inputs import files_of
    from ..smooth.printed import picture, print_smooth, write_page
    from ..smooth.smoothing import check_target, smooth_motion

    pairs = [text.rpartition("=") for text in servo] or [("", "", "20")]
    controllers = {joint: value for joint, _, value in pairs}
    if len(controllers) < len(pairs) or ("" in controllers and len(controllers) > 1):
        raise InputError("--servo: expected one for all joints, or JOINT=… for each", ", ".join(servo))
    protect([*files_of(scene_file), *([motion] if motion else []), *map(Path, controllers.values())])
    target = output or scene_file.with_suffix(".smooth.json")
    check_target(target, force=force)
    given = {key: value for key, value in how.items() if value is not None}
    with Display() as display:
        of_all = controllers.get("", controllers)
        found = smooth_motion(scene_file, motion, servo=of_all, watcher=display, **given)
    console = summary_console()
    print_smooth(found, console)
    if found.candidates:
        found.write(target, force=force)
        console.print(f"written    {target}: {found.best.name}", soft_wrap=True, markup=False)
    else:
        console.print("written    no other motion", soft_wrap=True)
    figure, page = target.with_suffix(".png"), target.with_suffix(".report.html")
    write_atomically(figure, picture(found, "png"), "picture", ours=True)
    console.print(f"figure     {figure}", soft_wrap=True)
    write_page(found, motion, page)
    console.print(f"report     {page}", soft_wrap=True)
