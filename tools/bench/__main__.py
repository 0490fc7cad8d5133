"""Benchmarks of ffrobot itself: `PYTHONPATH=tools .venv/bin/python -m bench -o DIR`, from the source tree."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from ffrobot.bench import OF_A_SCENE
from ffrobot.bench.precision import Settings
from ffrobot.present.console import Display, summary_console

from .source_tree import PARTS, PEER, SourceTree

REPOSITORY = Path(__file__).parents[2]


@click.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder.")
@click.option("--repeat", type=click.IntRange(1), default=5, show_default=True, help="Number of repetitions.")
@click.option("--budget", type=float, default=20.0, show_default=True, help="Largest duration of a run, s.")
@click.option(
    "--part", "parts", multiple=True, type=click.Choice([*OF_A_SCENE, *PARTS, PEER]), help="Single part; repeatable."
)
@click.option("--peer", is_flag=True, help="Measure EXUDYN too.")
@click.option("--peer-python", type=click.Path(path_type=Path), default=sys.executable, help="Interpreter with EXUDYN.")
def main(output: Path, repeat: int, budget: float, parts: tuple[str, ...], peer: bool, peer_python: Path) -> None:
    """Measure the two cases of the paper, growth with size, and ratios to hand-written code."""
    wanted = (*(parts or (*OF_A_SCENE, *PARTS)), *([PEER] if peer else []))
    with Display() as display:
        campaign = SourceTree(output, Settings(repeat, budget), display, summary_console())
        campaign.everything(REPOSITORY, wanted, peer_python)


main()
