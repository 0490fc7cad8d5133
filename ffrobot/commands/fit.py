"""The command `fit`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from ..common.errors import InputError
from ..present.logs import FILE, logging_options, python_option
from .options import output_option, protect


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
def fit(
    file: Path,
    measured: Path | None,
    frf: Path | None,
    vary: tuple[str, ...],
    motors: Literal["free", "locked"] | None,
    output: Path | None,
    force: bool,
) -> None:
    """Fit keys of a link or a scene to measured natural frequencies or FRFs, and write new files.

    \b
    ffrobot fit arm.toml --measured modes.csv --vary material.youngs_modulus
    ffrobot fit scene.toml --measured robot.csv --vary joint.elbow.stiffness,links.arm.material.youngs_modulus
    ffrobot fit scene.toml --frf hammer.toml --vary joint.elbow.stiffness,joint.elbow.damping

    A link vibrates under its reference condition, a robot at the start of its scene. KEY=KEY: common factor.
    Prints uncertainties of the values, and rejects keys that the measurement cannot distinguish. FRFs of a robot are
    compared in the poses of their tests; a picture shows measured and fitted curves.
    """  # noqa: D301 (click wants the backspace itself)
    from ..present.console import summary_console
    from ..run.inputs import files_of

    table = measured or frf
    if table is None or (measured and frf):
        raise InputError("fit: expected one of --measured and --frf, found " + ("both" if table else "none"))
    protect([*files_of(file), table])
    keys, console = [key for text in vary for key in text.split(",")], summary_console()
    if measured:
        from ..fit.fitting import fit_measured, print_fit

        print_fit(fit_measured(file, measured, keys, output, motors=motors, force=force), console)
    else:
        from ..fit.frf import fit_responses, print_responses
        from ..fit.frf_picture import draw_responses

        fitted = fit_responses(file, table, keys, output, motors=motors or "locked", force=force)
        print_responses(fitted, console)
        picture = draw_responses(fitted, Path(fitted.files[-1]).with_suffix(".png"))
        console.print(f"figure: {picture}", soft_wrap=True)
