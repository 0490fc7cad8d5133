"""The command `bench`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from ..bench import OF_A_SCENE, PARTS, PEER
from ..present.logs import FILE, logging_options, python_option
from .options import POSITIVE, protect


def _texts(context: click.Context, parameter: click.Parameter, value: str | None) -> list[str] | None:
    """The parts of a list with commas."""
    return None if value is None else [part.strip() for part in value.split(",")]


def _numbers(context: click.Context, parameter: click.Parameter, value: str | None) -> list[float] | None:
    """Likewise, as numbers."""
    try:
        return None if value is None else [float(part) for part in value.split(",")]
    except ValueError:
        raise click.BadParameter(f'expected numbers with commas between them, found "{value}"') from None


@click.command()
@click.argument("scene_file", metavar="[SCENE.toml]", required=False, type=FILE)
@click.option("-o", "--output", metavar="DIR", type=FILE, help="Folder [SCENE.bench next to the scene; ./bench].")
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
@click.option(
    "--part",
    "parts",
    multiple=True,
    type=click.Choice([*PARTS, PEER]),
    help="Single part; repeatable [all but the peer].",
)
@click.option("--peer", type=click.Choice(["exudyn"]), help="Other program that is measured too, as part peer.")
@click.option("--peer-python", metavar="PYTHON", type=FILE, help="Interpreter with the peer [this one].")
@click.option("--source", metavar="DIR", type=FILE, default=Path(), help="ffrobot's source tree [.].")
@python_option
@logging_options
def bench(
    scene_file: Path | None,
    output: Path | None,
    analysis: str | None,
    integrators: list[str] | None,
    tolerances: list[float] | None,
    repeat: int,
    budget: float,
    parts: tuple[str, ...],
    peer: str | None,
    peer_python: Path | None,
    source: Path,
) -> None:
    """Measure run time against error, and where the error comes from.

    With a scene: one of its analyses with every integrator at every tolerance, against a reference that two
    integrators agree on. Then the error of its mesh, of its number of modes and of time integration. Without a scene,
    in ffrobot's source tree: the same for the two cases of the paper, the growth of time with modes, links and outputs,
    and ratios to hand-written code for the two-link case. Tables as CSV and JSON, figures as PNG and PDF.
    """
    from ..bench.campaign import Campaign, Settings
    from ..bench.precision import INTEGRATORS, TOLERANCES
    from ..present.console import summary_console
    from ..present.progress import Display
    from ..run.inputs import files_of

    if scene_file is not None and (peer or set(parts) - set(OF_A_SCENE)):
        raise click.UsageError(f"of a scene, only the parts {' and '.join(OF_A_SCENE)} can be measured")
    if scene_file is None and analysis is not None:
        raise click.UsageError("--analysis goes with a scene")
    if scene_file is not None:
        protect(files_of(scene_file))
    settings = Settings(integrators or INTEGRATORS, tolerances or TOLERANCES, repeat, budget)
    folder = output or (scene_file.with_suffix(".bench") if scene_file else Path("bench"))
    with Display() as display:
        if scene_file is not None:
            campaign = Campaign(folder, settings, display, summary_console())
            campaign.scene(scene_file, analysis, folder, parts or OF_A_SCENE)
        else:
            wanted = (*(parts or PARTS), *([PEER] if peer else []))
            tree = _source_tree(source)(folder, settings, display, summary_console())
            tree.everything(source, wanted, peer_python or Path(sys.executable))


def _source_tree(source: Path) -> Any:  # noqa: ANN401 (a class outside the package)
    """`SourceTree` of tools/bench. Raises `InputError` where `source` is no source tree."""
    from importlib import import_module

    from ..common.errors import InputError

    if not (source / "tools" / "bench" / "source_tree.py").is_file():
        raise InputError(f"{source}: --source: expected ffrobot's source tree, found no tools/bench in it")
    sys.path.insert(0, str(source.resolve() / "tools"))
    return import_module("bench.source_tree").SourceTree
