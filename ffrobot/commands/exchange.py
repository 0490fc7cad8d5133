"""The commands `import` and `export`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import click

from ..common.errors import InputError
from ..present.logs import FILE, logging_options
from .options import POSITIVE, output_option, protect, reading


@click.command(name="import")
@click.argument("file", metavar="ROBOT.urdf|BODY|MOTION", type=FILE)
@output_option("DIR|BODY.h5|PATH.csv", "Folder of the scene; file of a body or of waypoints.", required=True)
@click.option(
    "--flexible", metavar="LINK=FILE.toml", multiple=True, help="Flexible link with its link file; repeatable."
)
@click.option("--force", is_flag=True, help="Replacement of existing files.")
@click.option("--fix-inertia", is_flag=True, help="Smallest correction of unphysical inertias, with a report.")
@click.option(
    "--density",
    metavar="KG/M3",
    type=POSITIVE,
    help="Estimate masses of links without <inertial> from their shapes, filled with this density.",
)
@click.option(
    "--radius", metavar="M", type=POSITIVE, help="Radius of cylinders along links without shapes, with --density."
)
@click.option(
    "--keep-rest",
    is_flag=True,
    help="Keep the mass that a link has beyond its flexible link file, as a payload on the flexible link.",
)
@logging_options
def import_(
    file: Path,
    output: Path,
    flexible: tuple[str, ...],
    density: float | None,
    radius: float | None,
    *,
    force: bool,
    fix_inertia: bool,
    keep_rest: bool,
) -> None:
    """Import a robot description (URDF) as a 3D scene, or flexible bodies or motions of other programs.

    DIR/scene.toml has bodies and joints. Links are rigid with their <inertial> unless --flexible names a link file.
    Fixed joints merge links to one body, or fix them to the ground. Append trajectories and analyses yourself.

    BODY.SID_FEM (standard input data, Wallrapp) and BODY.fem (MBDyn) become modal body files, which scenes take as
    `modal = "BODY.h5"`.

    MOTION.json or .yaml (a JointTrajectory) and bags of ROS (the first JointTrajectory, else JointStates) become
    waypoints, which trajectories of joints take as `waypoints = "PATH.csv"`.
    """
    from ..exchange.export import MOTIONS, READERS, import_body, import_motion, print_export, print_import
    from ..exchange.urdf.import_urdf import import_urdf
    from ..exchange.urdf.shape_masses import Filling
    from ..present.console import summary_console

    links, suffix = _links(flexible), file.suffix.lower()
    is_motion = suffix in MOTIONS or file.is_dir()
    if is_motion or suffix in READERS:
        if links or fix_inertia or density or radius or keep_rest or (force and not is_motion):
            allowed, what = ("--output and --force", "a motion") if is_motion else ("--output", "a body")
            raise InputError(f"{file}: expected a URDF for options other than {allowed}", what)
        protect(file)
        made = import_motion(file, output, force=force) if is_motion else import_body(file, output)
        print_export(made, summary_console())
        return
    if instead := ELSEWHERE.get(suffix):
        raise InputError(f"{file}: expected a URDF, a body or a motion", f"none of these: {instead}")
    if radius and density is None:
        raise InputError("--radius: expected --density with it", "none")
    if keep_rest and not links:
        raise InputError("--keep-rest: expected --flexible with it", "none")
    protect(file, *links.values())
    filling = None if density is None else Filling(density, radius)
    imported = import_urdf(
        file, output, links, force=force, fix_inertia=fix_inertia, filling=filling, keep_rest=keep_rest
    )
    print_import(imported, summary_console())


def _links(pairs: tuple[str, ...]) -> Mapping[str, Path]:
    """`LINK=FILE.toml` by link."""
    files = dict[str, Path]()
    for pair in pairs:
        name, sign, path = pair.partition("=")
        if not (name and sign and path):
            raise InputError("--flexible: expected LINK=FILE.toml", f'"{pair}"')
        if name in files:
            raise InputError(f'--flexible: expected one file for link "{name}"', "two")
        files[name] = Path(path)
    return files


CONVERTED = "another program has to convert it to URDF"
ELSEWHERE = {
    ".csv": 'trajectories take tables as they are, waypoints = "PATH.csv"',
    ".toml": "ffrobot solve takes scenes, ffrobot link takes links",
    **dict.fromkeys((".step", ".stp", ".msh", ".inp", ".bdf"), "ffrobot link --inspect drafts a link file of a part"),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), f"a scene of USD: {CONVERTED}"),
    **dict.fromkeys((".slx", ".mdl"), f"a model of Simulink: {CONVERTED}"),
    ".sdf": f"SDF: {CONVERTED}",
    ".mjcf": f"MJCF of MuJoCo: {CONVERTED}",
    ".mnf": "a flexible body of Adams: export its finite element mesh, for ffrobot link --inspect, or SID",
    ".mat": "a file of MATLAB: write its table as CSV",
    ".xacro": "xacro: run `xacro FILE.xacro > ROBOT.urdf` first",
}
"""Remedy for files that `import` does not read, by suffix."""


@click.command()
@click.argument("file", metavar="RESULTS.h5|BODY.h5|SCENE.toml", type=FILE)
@click.option("--format", "file_format", metavar="FORMAT", required=True, help="One of those above.")
@click.option(
    "--analysis",
    metavar="NAME",
    help="Analysis; default: the first with moving joints, for fmu and c the first linear or forward one.",
)
@click.option(
    "--side",
    type=click.Choice(["motor", "joint"]),
    help="Side of compliant gears whose positions a JointTrajectory has [motor].",
)
@output_option("FILE", "Output file [next to the input, by analysis].")
@click.option("--force", is_flag=True, help="Replacement of an existing file.")
@logging_options
def export(
    file: Path,
    file_format: str,
    analysis: str | None,
    side: Literal["motor", "joint"] | None,
    output: Path | None,
    *,
    force: bool,
) -> None:
    """Export results, a modal body or a scene in a format of other programs.

    \b
    csv               time, and position, velocity and torque of every joint, and of motors before compliant gears
    joint-trajectory  JSON in the layout of ROS 2's trajectory_msgs/JointTrajectory, with effort
    rosbag2           a folder, the bag of ROS 2 with that message; needs rosbags (extra "ros")
    fmu               FMI 2.0, model exchange and co-simulation, of a linear model; co-simulation of the controllers
                      of closed-loop control (--analysis); with C sources, compiled where there is a C compiler
    c                 a header file with the matrices of either
    sid               SID_FEM, standard input data of flexible bodies (Wallrapp)
    mbdyn             .fem of MBDyn's modal joint
    craig-bampton     .npz with M, K, C in interface coordinates and fixed-interface modes
    exudyn            .npz of EXUDYN's ObjectFFRFreducedOrderInterface
    urdf              of a 3D scene, for viewers: links rigid, shapes simple
    fmu               of a scene: FMI 2.0, co-simulation, of a forward motion under torques and voltages
    """
    from ..exchange.export import export_file, print_export
    from ..present.console import summary_console

    with reading(file):
        print_export(export_file(file, file_format, analysis, output, force=force, side=side), summary_console())
