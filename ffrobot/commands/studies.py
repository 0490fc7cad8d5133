"""The commands that study one robot: `bench`, `fit`, `map` and `smooth`."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..bench import OF_A_SCENE
from ..common.errors import InputError
from ..common.files import write_atomically
from ..present.logs import FILE, logging_options, python_option
from .options import POSITIVE, batch_options, output_option, protect_scene, scene_argument

if TYPE_CHECKING:
    from ..batch.batch import Batch
    from ..common.arrays import Array


def _texts(context: click.Context, parameter: click.Parameter, value: str | None) -> list[str] | None:
    return None if value is None else [part.strip() for part in value.split(",")]


def _numbers(context: click.Context, parameter: click.Parameter, value: str | None) -> list[float] | None:
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
def bench(scene_file: Path, output: Path | None, analysis: str | None, parts: tuple[str, ...], **how: Any) -> None:
    """Measure run time against error, and the contributions to the error.

    One of the scene's analyses with every integrator at every tolerance, against a reference that two integrators
    agree on. Then the error of its mesh, of its number of modes and of time integration. Tables as CSV and JSON,
    figures as PNG and PDF.
    """
    from ..bench.campaign import Campaign
    from ..bench.precision import Settings
    from ..present.console import Display, summary_console

    protect_scene(scene_file)
    settings = Settings(**{key: value for key, value in how.items() if value is not None})
    folder = output or scene_file.with_suffix(".bench")
    with Display() as display:
        campaign = Campaign(folder, settings, display, summary_console())
        campaign.scene(scene_file, analysis, folder, parts or OF_A_SCENE)


@click.command()
@click.argument("file", metavar="LINK.toml|SCENE.toml", type=FILE)
@click.option("--measured", metavar="MODES.csv", type=FILE, help="Table with mode, frequency (Hz), …")
@click.option("--frf", metavar="TESTS.toml", type=FILE, help="Tests with frequency response functions (FRFs).")
@click.option("--vary", metavar="KEY,KEY …", multiple=True, required=True, help="Keys to fit; repeatable.")
@click.option(
    "--motors",
    type=click.Choice(["free", "locked"]),
    help="Motors of a robot during the measurement [free; with --frf locked].",
)
@output_option("FILE.toml", "Output file [FILE.fitted.toml].")
@click.option("--force", is_flag=True, help="Replacement of files of an earlier fit.")
@python_option
@logging_options
def fit(file: Path, measured: Path | None, frf: Path | None, vary: tuple[str, ...], **how: Any) -> None:
    """Fit keys of a link or a scene to measured natural frequencies or FRFs, and write new files.

    \b
    ffrobot fit arm.toml --measured modes.csv --vary material.youngs_modulus
    ffrobot fit scene.toml --measured robot.csv --vary joint.elbow.stiffness,links.arm.material.youngs_modulus
    ffrobot fit scene.toml --frf hammer.toml --vary joint.elbow.stiffness,joint.elbow.damping

    A link vibrates under its reference condition, a robot at the start of its scene. KEY=KEY: common factor.
    Prints uncertainties of the values, and rejects keys that the measurement cannot distinguish. FRFs of a robot are
    compared in the poses of their tests; a picture shows measured and fitted curves.
    """
    from ..fit.fitting import fit_measured, print_fit
    from ..present.console import summary_console

    table = measured or frf
    if table is None or (measured and frf):
        raise InputError("fit: expected one of --measured and --frf, found " + ("both" if table else "none"))
    protect_scene(file, table)
    keys, console = [key for text in vary for key in text.split(",")], summary_console()
    if measured:
        print_fit(fit_measured(file, measured, keys, **how), console)
    else:
        from ..fit.frf import draw_responses, fit_responses

        fitted = fit_responses(file, table, keys, **how | {"motors": how["motors"] or "locked"})
        print_fit(fitted, console)
        picture = draw_responses(fitted, Path(fitted.files[-1]).with_suffix(".png"))
        console.out(f"figure: {picture}")


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
@click.option(
    "--modes", "count", type=click.IntRange(1, 50), default=3, show_default=True, help="Natural frequencies per pose."
)
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
    response: str | None,
    milling: Path | None,
    covariance: Path | None,
    figures: bool,
    batch: "Batch",
    output: Path | None,
    **which: Any,
) -> None:
    """Map of the workspace: natural frequencies, stiffness, torque and deflection at rest, pose by pose.

    \b
    --over shoulder=-90*deg:90*deg:31 --over elbow=0:2:21    a grid of joint coordinates (rad or m)
    --over x=0.2:0.8:31 --over z=0.2:1.0:31                  a grid of places of the point (m), inverse kinematics
    --over turn=-90*deg:90*deg:7 --milling cutter.toml       turns of the tool about its axis

    Motors keep the pose; links and compliant gears deflect under weight and loads. Joints that the grid leaves open
    stay as near to the start of the scene as they can. The same command resumes a stopped map.
    """
    from ..map.map_file import TABLE, print_map, write_map
    from ..map.pose_map import make_map, plan_map
    from ..milling.process import read_milling
    from ..present.console import Display, summary_console

    if covariance and not milling:
        raise InputError("--covariance: expected --milling, too", "none")
    errors = None
    if covariance:  # what reads it loads more than a map does
        from ..fit.covariance import read_covariance, with_deviations

        errors = read_covariance(covariance)
    folder = output or scene_file.with_suffix(".map")
    protect_scene(scene_file, milling, covariance)
    cutter = read_milling(milling) if milling else None
    plan = plan_map(scene=scene_file, folder=folder, frequencies=_frequencies(response), milling=cutter, **which)
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
            console.out(f"figure     {picture}")
    console.out(f"table      {folder / TABLE}")
    console.out(f"map        {path}")


def _frequencies(text: str | None) -> "Array":
    """FIRST:LAST:COUNT in Hz, evenly spaced; none without a text."""
    import numpy as np

    if text is None:
        return np.zeros(0)
    with suppress(ValueError):
        first, last, count = text.split(":")
        if 0.0 <= float(first) <= float(last) < np.inf and 1 <= int(count) <= 10_000:
            return np.linspace(float(first), float(last), int(count))
    raise InputError("--response: expected FIRST:LAST:COUNT in Hz, such as 1:100:200", f'"{text}"')


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
    """Find why a robot vibrates on a recorded motion, and compute a motion on the same path with less vibration.

    MOTION is a CSV table of joint positions with times, a JointTrajectory (JSON, YAML), or a bag of ROS. Compliant
    gears (`stiffness` of joints) and flexible links vibrate; motors follow set points through position controllers.
    New motions are averaged, slower, shaped for natural frequencies, or inverted: motors lead by the strain of their
    gears. Each is simulated; OUT is the one that settles first, or that of --write.
    """
    from ..present.console import Display, summary_console
    from ..smooth.printed import picture, print_smooth, write_page
    from ..smooth.smoothing import check_target, smooth_motion

    pairs = [text.rpartition("=") for text in servo] or [("", "", "20")]
    controllers = {joint: value for joint, _, value in pairs}
    if len(controllers) < len(pairs) or ("" in controllers and len(controllers) > 1):
        raise InputError("--servo: expected one for all joints, or JOINT=… for each", ", ".join(servo))
    protect_scene(scene_file, motion, *map(Path, controllers.values()))
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
        console.out(f"written    {target}: {found.best.name}")
    else:
        console.out("written    no other motion")
    figure, page = target.with_suffix(".png"), target.with_suffix(".report.html")
    write_atomically(figure, picture(found, "png"), "picture", ours=True)
    console.out(f"figure     {figure}")
    write_page(found, motion, page)
    console.out(f"report     {page}")
