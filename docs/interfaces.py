"""Writes docs/reference/commands.md and python.md from the program: python docs/interfaces.py."""

from __future__ import annotations

import inspect
import re
from dataclasses import is_dataclass
from functools import cached_property
from pathlib import Path

import click

import ffrobot
from ffrobot.actuation.control.linear_model import LinearModel
from ffrobot.cli import cli
from ffrobot.design.optimise import Front
from ffrobot.design.optimum_record import Optimum
from ffrobot.design.sensitivity import Sensitivity
from ffrobot.design.uncertainty_record import Uncertainty
from ffrobot.fe_models.link import LinkOutcome
from ffrobot.fit.fitting import Fit
from ffrobot.fit.frf import PoseComparison, ResponseFit
from ffrobot.results.verdict import AnalysisVerdict, Verdict
from ffrobot.smooth.smoothing import Smoothed

FUNCTIONS = (
    "solve", "load_scene", "make_scene", "make_link", "read_modal_body", "fit_measured", "fit_responses",
    "smooth_motion", "sensitivity", "optimise", "trade_off", "uncertainty", "write_study", "plot_results",
    "write_report", "view_file", "write_movie",
)  # fmt: skip
CLASSES = ("Results", "Scene", "ModalBody", "Watcher")
RETURNED = (
    LinkOutcome, Verdict, AnalysisVerdict, LinearModel, Fit, ResponseFit, PoseComparison, Sensitivity, Optimum, Front,
    Uncertainty, Smoothed,
)  # fmt: skip
ERRORS = ("FfrobotError", "InputError", "SolveError", "FfrobotWarning")

COMMANDS = """# Commands

<!-- written by docs/interfaces.py from the program -->

This page has what `ffrobot COMMAND --help` prints. `ffrobot optimize`, `--minimize` and `--maximize` are accepted
spellings.

Exit codes: 0; 1 if a solve failed; 2 for wrong input; 130 after Ctrl-C; 143 after SIGTERM. Computing a link keeps no
partial result: the signal ends the process, which shells show by the same numbers.

No output replaces an input of its command, or a file of another kind, not even with `--force`. A log file is a new file
or an earlier log.
"""
PYTHON = """# Python

<!-- written by docs/interfaces.py from the program -->

This page lists the public names of the package `ffrobot`; [Vary a design in Python](../howto/python.md) uses them.
`import ffrobot` takes a few milliseconds: modules are loaded when needed. `ffrobot.__version__` is its version.
"""


def interface_pages() -> dict[str, str]:
    """Name and text of the two pages."""
    return {"commands.md": commands_page(), "python.md": python_page()}


def write_interface_pages(folder: Path) -> None:
    """Write the two pages into `folder`."""
    for name, text in interface_pages().items():
        (folder / name).write_text(text, encoding="utf-8")


def commands_page() -> str:
    """The help of every command."""
    parts = [COMMANDS]
    for name, command in cli.commands.items():
        if command.hidden:
            continue
        settings = {**cli.context_settings, "terminal_width": 100, "max_content_width": 100}
        context = click.Context(command, info_name=f"ffrobot {name}", **settings)
        lines = [line.rstrip() for line in command.get_help(context).splitlines()]
        parts.append(f"## ffrobot {name}\n\n```text\n" + "\n".join(lines) + "\n```\n")
    return "\n".join(parts)


def python_page() -> str:
    """Functions, classes and errors with their docstrings."""
    parts = [PYTHON, "## Functions\n"]
    for name in FUNCTIONS:
        function = getattr(ffrobot, name)
        parts.append(f"### {name}\n\n```python\n{_call(name, function)}\n```\n\n{_markdown(function)}\n")
    parts.append("## Classes\n")
    parts += [_class(getattr(ffrobot, name)) for name in CLASSES]
    parts.append("## Returned objects\n")
    parts += map(_class, RETURNED)
    parts.append("## Errors\n")
    parts += [_class(getattr(ffrobot, name)) for name in ERRORS]
    return "\n".join(parts)


def members(one: type) -> dict[str, str]:
    """Docstrings of the program's public methods and properties by name, inherited ones too."""
    found = {}
    own = {name for base in one.__mro__ if base.__module__.startswith("ffrobot.") for name in vars(base)}
    for name in sorted(own):
        value = inspect.getattr_static(one, name)
        is_method = inspect.isfunction(value) or isinstance(value, classmethod | staticmethod)
        if (name.startswith("_") and name != "__getitem__") or not (
            is_method or isinstance(value, property | cached_property)
        ):
            continue
        found[name] = " ".join((inspect.getdoc(value) or "").split())
    return found


def _class(one: type) -> str:
    own = "\n\n".join(_markdown(base) for base in one.__mro__ if base is one or is_dataclass(base))
    listed = (f"* `{name}`: {text}" for name, text in members(one).items() if text)
    return "\n".join([f"### {one.__name__}\n\n{own}\n", *listed]).rstrip("\n") + "\n"


def _call(name: str, function: object) -> str:
    """The signature without types, a parameter each where they do not fit into a line."""
    parameters = list(inspect.signature(function).parameters.values())  # type: ignore[arg-type]
    texts = []
    for k, one in enumerate(parameters):
        if one.kind is one.KEYWORD_ONLY and (k == 0 or parameters[k - 1].kind is not one.KEYWORD_ONLY):
            texts.append("*")
        text = f"**{one.name}" if one.kind is one.VAR_KEYWORD else one.name
        texts.append(text if one.default is one.empty else f"{text}={one.default!r}")
    whole = f"ffrobot.{name}({', '.join(texts)})"
    return whole if len(whole) <= 100 else f"ffrobot.{name}(\n    " + ",\n    ".join(texts) + ",\n)"


def _markdown(one: object) -> str:
    """A docstring: sections become lists, an example becomes code."""
    found = []
    for block in re.split(r"\n\n(?=\S)", inspect.getdoc(one) or ""):
        head, _, rest = block.partition(":\n")
        body = inspect.cleandoc("\n" + rest)
        if head not in ("Args", "Attributes", "Returns", "Raises", "Warns", "Example"):
            found.append(block)
        elif head == "Example":
            found.append(f"Example:\n\n```python\n{body}\n```")
        elif head == "Returns":
            found.append(f"Returns: {' '.join(body.split())}")
        else:
            entries = [" ".join(entry.split()) for entry in re.split(r"\n(?=\S)", body)]
            lines = [re.sub(r"^([\w, ]+):", r"`\1`:", entry) for entry in entries]
            found.append(f"{head}:\n\n" + "\n".join(f"* {line}" for line in lines))
    return "\n\n".join(found)


if __name__ == "__main__":
    write_interface_pages(Path(__file__).parent / "reference")
