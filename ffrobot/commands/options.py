"""Types of options, and options that commands which make many runs share."""

import inspect
import re
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin

import click

from ..common.outputs import protected
from ..design.studies import FiniteRange
from ..present.logs import FILE, together

F = TypeVar("F", bound=Callable[..., object])

POSITIVE = FiniteRange(0.0, min_open=True)
scene_argument = click.argument("scene_file", metavar="SCENE.toml", type=FILE)


def output_option(metavar: str, text: str, *, required: bool = False) -> Callable[[F], F]:
    """Decorator: add option `-o`, the file or folder that is written; `text`: its help."""
    return click.option("-o", "--output", metavar=metavar, type=FILE, required=required, help=text)


def batch_options(text: str) -> Callable[[F], F]:
    """Decorator: add `-j` (help `text`) and `--scheduler`; the command receives their `Batch` as argument `batch`."""

    def decorate(command: F) -> F:
        @wraps(command)
        def run(*args: object, processes: int | None, scheduler: str | None, **named: object) -> object:
            from ..batch.batch import batch_of

            with batch_of(processes, scheduler) as batch:
                return command(*args, batch=batch, **named)

        return together(
            click.option(
                "-j",
                "--processes",
                type=click.IntRange(1, 1000),
                help=f"{text}  [default: one for each processor, those of mpirun]",
            ),
            click.option(
                "--scheduler",
                metavar="ADDRESS",
                envvar="FFROBOT_SCHEDULER",
                help="Dask scheduler whose workers replace these processes, such as tcp://node1:8786.",
            ),
        )(run)  # type: ignore[return-value]

    return decorate


def runs_options(folder: str, of: str = "Folder") -> Callable[[F], F]:
    """Decorator: add `-j`, `--scheduler`, `--retry`, `-o`; help of `-o`: `of`, default `folder` next to the input."""
    return together(
        output_option("DIR", f"{of} [{folder} next to the input]."),
        click.option("--retry", is_flag=True, help="Repetition of failed runs."),
        batch_options("Number of parallel runs."),
    )


def options_of(function: Callable[..., object], *names: str) -> Callable[[F], F]:
    """Decorator: add the parameters `names` of `function` as options, with types, defaults and help of its Args."""
    parameters = inspect.signature(function).parameters
    args = (inspect.getdoc(function) or "").partition("Args:\n")[2].partition("\n\n")[0]
    entries = dict(re.findall(r"^ {4}(\w+): (.+(?:\n {8}.+)*)", args, re.MULTILINE))

    def option(name: str) -> Callable[[F], F]:
        flags = dict.fromkeys(f"--{one.replace('_', '-')}" for one in (name, name.replace("mise", "mize")))
        return click.option(*flags, **_settings(parameters[name], entries[name]))

    return together(*map(option, reversed(names)))


def _settings(parameter: inspect.Parameter, entry: str) -> dict[str, Any]:
    """Settings of a parameter's option; its entry of Args begins with the help: a sentence, and maybe a bracket."""
    annotation, needed = parameter.annotation, parameter.kind is parameter.POSITIONAL_OR_KEYWORD
    kind, *about = get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)
    default = None if parameter.default is parameter.empty else parameter.default
    several = get_origin(kind) is Sequence
    match = re.match(r"(.+?)(\.(?=\s|$)(?:  \[.*\])?)", re.sub(r"\n +", " ", entry))
    assert match is not None
    text = match[1][0].upper() + match[1][1:] + "; repeatable" * several + match[2]
    settings = {"help": text, "multiple": several, "is_flag": kind is bool, "required": needed, "default": default}
    settings["show_default"] = not (default is None or several or kind is bool)
    if get_origin(kind) is Literal:
        settings["type"] = click.Choice(get_args(kind))
    return settings | {"metavar" if isinstance(one, str) else "type": one for one in about}


def protect(*files: Path | None) -> None:
    """Protect files from being overwritten by the running command, whose outputs then raise `InputError`."""
    click.get_current_context().with_resource(protected(filter(None, files)))


def protect_scene(file: Path, *others: Path | None) -> None:
    """Protect a scene or link file, all files it names, and `others` from being overwritten by the command."""
    from ..run.inputs import files_of

    protect(*files_of(file), *others)


def reading(*files: Path) -> AbstractContextManager[None]:
    """Context that refuses to overwrite `files`; errors in reading damaged ones become `InputError`."""
    from ..common import hdf5

    return hdf5.reading(*files)
