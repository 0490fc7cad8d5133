"""The command line: its commands, and how a command ends."""

import gc
import os
import signal
import sys
import traceback
import warnings
from copy import copy

import click

from .commands.design import optimise, sensitivity, sweep, uncertainty
from .commands.exchange import export, import_
from .commands.results import feasibility, info, linear, plot, report, view
from .commands.stages import link, pose, solve
from .commands.studies import bench, fit, map_, smooth
from .common.errors import FfrobotError
from .common.interrupts import SIGNALS, EndOfCommand
from .common.parallel import end_all, is_first
from .common.version import VERSION
from .present.console import describe, ready_streams, without_output
from .present.logs import LOGGER, log_warning


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION)
def cli() -> None:
    """Dynamics of robots with flexible links: motor torques, vibrations and patch voltages for a path.

    \b
    Stage 1:  ffrobot link  LINK.toml   finite elements → modal body file
    Stage 2:  ffrobot solve SCENE.toml  modal bodies → torques and voltages
    Then:     ffrobot info, ffrobot plot, ffrobot view, ffrobot report
    """


@cli.command()
@click.argument("kind", type=click.Choice(["link", "scene", "spatial", "figures"]))
def schema(kind: str) -> None:
    """Print the JSON schema of link, scene or figures files, or of 3D scenes alone, for editors.

    \b
    ffrobot schema scene > scene.schema.json
    and, as the first line of a scene file:  #:schema ./scene.schema.json
    """
    import json

    from .schema import schema as schema_of

    click.echo(json.dumps(schema_of(kind), indent=2, ensure_ascii=False))


for command in (
    link, solve, info, feasibility, plot, view, report, linear, pose, sweep, map_, fit, smooth, sensitivity, optimise,
    uncertainty, import_, export, bench,
):  # fmt: skip
    cli.add_command(command)
optimize = copy(optimise)
optimize.hidden = True  # the American spelling
cli.add_command(optimize, "optimize")


def main() -> None:
    """Run the command line; docs/reference/commands.md lists exit codes."""
    gc.set_threshold(200_000)  # what a command loads stays: searching it repeatedly costs a sixth of the start
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it would read the metadata of all packages
    os.environ["MPLBACKEND"] = "agg"  # figures are files; Jupyter names a module of its own, which is not here
    stop = EndOfCommand()
    LOGGER.propagate = False  # libraries give the root logger handlers of their own
    ready_streams()
    warnings.showwarning = log_warning
    for number in SIGNALS:
        signal.signal(number, stop)
    try:
        cli(standalone_mode=False)
        sys.stdout.flush()
        if stop.number:  # the exception was raised where Python ignores it, as in a finaliser
            sys.exit(128 + stop.number)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except Exception as error:
        if stop.number:  # not only Abort: libraries turn a KeyboardInterrupt into what they like, ImportError for one
            click.echo("ffrobot: stopped", err=True)
            sys.exit(128 + stop.number)
        message = describe(error)
        if message is None:
            LOGGER.error("failed", exc_info=True)
            traceback.print_exc()
            end_all()
            sys.exit(1)
        if is_first():
            cause = error.__cause__  # such as what a reader met in a file: damage, or a fault of the program
            LOGGER.error("%s", message, exc_info=None if isinstance(cause, FfrobotError) else cause)
            click.echo(f"ffrobot: {message}", err=True)
        without_output()
        sys.exit(error.exit_code if isinstance(error, FfrobotError) else 1)
    finally:  # nothing is left to keep: at the interpreter's end an interrupt would be a traceback
        gc.freeze()  # else the interpreter searches all that is loaded for garbage at its end
        for number in SIGNALS:
            signal.signal(number, signal.SIG_DFL)
