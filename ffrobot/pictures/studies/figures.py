"""Diagrams of a study as figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from ..figures.plot import write_figure
from ..figures.style import literal, style
from .bars import draw_bars
from .diagrams import Band, Bars, Diagram, Parallel, Points, Progress
from .histories import draw_band, draw_progress
from .parallel_coordinates import draw_parallel
from .points import draw_points


def write_diagrams(diagrams: Sequence[Diagram], folder: Path) -> list[Path]:
    """A figure for each, as PNG and PDF; the files written."""
    with style():
        return [path for one in diagrams for path in write_figure(literal(_draw(one)), folder, one.name)]


def _draw(diagram: Diagram) -> Figure:
    match diagram:
        case Bars():
            return draw_bars(diagram)
        case Parallel():
            return draw_parallel(diagram)
        case Band():
            return draw_band(diagram)
        case Progress():
            return draw_progress(diagram)
        case Points():
            return draw_points(diagram)
