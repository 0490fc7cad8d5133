"""How figures look: the width of a printed column, colours that everyone can tell apart."""

from __future__ import annotations

import re
import textwrap
from contextlib import AbstractContextManager
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from ..projection import COLORS

SIZE = (3.5, 2.7)  # inches: one column of a journal page

MARKERS = ("s", "^", "o", "D", "v", "P", "X")
DASHES = ("-", "--", "-.", ":")
MARKERS_A_CURVE = 14
TITLE_CHARACTERS = 52  # in a line
LEGEND_CHARACTERS = 60  # in a line of a figure as wide as SIZE; 6 stand for the sample of a curve
ORDERED = "viridis"  # for series with an order: patches along a link, configurations over time

SETTINGS: dict[str, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.grid": True,
    "axes.formatter.limits": (-3, 5),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.0,
    "lines.markersize": 3.5,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
    "svg.hashsalt": "ffrobot",  # the same figure gives the same file
}


SUPERSCRIPTS = str.maketrans("−0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Ticks(ScalarFormatter):
    """Labels of ticks as plain text: the parser of formulas takes a seventh of the time to draw a figure."""

    def get_offset(self) -> str:
        """The power of ten of all labels, "×10⁻⁵"."""
        return re.sub(r"1e([−\d]+)$", lambda found: "×10" + found[1].translate(SUPERSCRIPTS), super().get_offset())


def style() -> AbstractContextManager[None]:
    """The settings of matplotlib within which figures are drawn and written."""
    return matplotlib.rc_context(SETTINGS)


def new_axes(title: str) -> tuple[Figure, Axes]:
    """An empty figure with its axes."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    lines = [title] if "$" in title else textwrap.wrap(title, TITLE_CHARACTERS)  # no line ends within a formula
    axes.set_title("\n".join(lines), loc="left")
    axes.locator_params(axis="x", nbins=6)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(Ticks())
    return figure, axes


def line_style(k: int, points: int, *, alone: bool = False) -> dict[str, Any]:
    """Style of the k-th curve, of so many `points`: sparse markers and dashes keep curves that coincide apart.

    A curve that is `alone` has none: on one that rings they look like samples.
    """
    if alone and points > 1:
        return {"color": COLORS[k % len(COLORS)]}
    every = max(1, points // MARKERS_A_CURVE)
    return {
        "color": COLORS[k % len(COLORS)],
        "linestyle": DASHES[k % len(DASHES)],
        "marker": MARKERS[k % len(MARKERS)],
        "markevery": ((k * every // 3) % every, every),
        "markerfacecolor": "white",
    }


def shades(count: int) -> list[Any]:
    """Colours of `count` ordered series, dark to light."""
    colormap = matplotlib.colormaps[ORDERED]
    return [colormap(0.9 * k / max(1, count - 1)) for k in range(count)]


def literal(figure: Figure) -> Figure:
    """The figure with `$`, `_`, `^` and backslashes of its titles and labels drawn as they are: names are no formulas.

    Figures that users describe themselves may have formulas; ticks always have.
    """
    for axes in figure.axes:
        titles = (axes.title, axes._left_title, axes._right_title, axes.xaxis.label, axes.yaxis.label)  # type: ignore[attr-defined]
        legends = [one for one in (axes.get_legend(), *figure.legends) if one is not None]
        for text in (*titles, *axes.texts, *(text for one in legends for text in one.get_texts())):
            text.set_parse_math(False)
    return figure


def legend(axes: Axes) -> None:
    """A legend below the axes, where it hides nothing, in as many columns as its texts leave room for.

    One curve needs none.
    """
    handles, labels = axes.get_legend_handles_labels()
    figure = axes.get_figure(root=True)
    if figure is not None and len(labels) > 1:
        room = LEGEND_CHARACTERS * figure.get_figwidth() / SIZE[0]
        columns = max(1, min(len(labels), int(room) // (max(map(len, labels)) + 6)))
        look: dict[str, Any] = {"ncols": columns, "handlelength": 1.8, "columnspacing": 1.0}
        figure.legend(handles, labels, loc="outside lower center", **look)
