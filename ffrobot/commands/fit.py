"""The command `fit`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import click

from ..present.logs import FILE, logging_options, python_option
from .options import output_option, protect


@click.command()
@click.argument("file", metavar="LINK.toml|SCENE.toml", type=FILE)
@click.option("--measured", metavar="MODES.csv", type=FILE, required=True, help="Table with mode, frequency (Hz), …")
@click.option("--vary", metavar="KEY,KEY …", multiple=True, required=True, help="Keys to fit; repeatable.")
@click.option(
    "--motors", type=click.Choice(["free", "locked"]), help="Motors of a robot during the measurement [free]."
)
@output_option("FILE.toml", "Output file [FILE.fitted.toml].")
@click.option("--force", is_flag=True, help="Replacement of files of an earlier fit.")
@python_option
@logging_options
def fit(
    file: Path,
    measured: Path,
    vary: tuple[str, ...],
    motors: Literal["free", "locked"] | None,
    output: Path | None,
    force: bool,
) -> None:
    """Fit keys of a link or a scene to measured natural frequencies, and write new files.

    \b
    ffrobot fit arm.toml --measured modes.csv --vary material.youngs_modulus
    ffrobot fit scene.toml --measured robot.csv --vary joint.elbow.stiffness,links.arm.material.youngs_modulus

    A link vibrates under its reference condition, a robot at the start of its scene. KEY=KEY: common factor.
    Prints uncertainties of the values, and rejects keys that the frequencies cannot distinguish.
    """  # noqa: D301 (click wants the backspace itself)
    from ..fit.fitting import fit_measured, print_fit
    from ..present.console import summary_console
    from ..run.inputs import files_of

    protect([*files_of(file), measured])
    keys = [key for text in vary for key in text.split(",")]
    fitted = fit_measured(file, measured, keys, output, motors=motors, force=force)
    print_fit(fitted, summary_console())
