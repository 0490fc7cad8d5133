"""Figures of what was measured; each row type has one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ..pictures.figures.plot import write_figure
from ..pictures.figures.style import legend, line_style, new_axes, style
from .measuring import KINDS

Rows = Sequence[Mapping[str, Any]]
Curves = Mapping[str, tuple[Sequence[float], Sequence[float]]]

# Over a curve's points at their best: a run's smallest time is what the machine can do.
TIME = "seconds_min"

MOST_TICKS = 6  # at the points themselves


def draw_work_precision(rows: Rows, peer: Rows, title: str, folder: Path) -> list[Path]:
    """Run time against error, a figure for each kind of quantity and a curve for each integrator (and the peer)."""
    written: list[Path] = []
    time, error = "least run time (s)", "error / peak"
    for kind in KINDS:
        key = f"error_{kind}"
        curves = {name: _points(rows, "integrator", name, TIME, key) for name in _names(rows, "integrator")}
        for gravity in _names(peer, "gravity"):
            curves[f"EXUDYN, {gravity} gravity"] = _points(peer, "gravity", gravity, "seconds", key)
        written += _draw(curves, f"{title}: {kind}", time, error, folder, f"work_precision_{kind}")
    return written


def draw_axes(rows: Rows, title: str, folder: Path) -> list[Path]:
    """Error of each kind against run time, along the axes of mesh and modes."""
    written: list[Path] = []
    for axis in ("mesh", "modes"):
        along = [row for row in rows if row["axis"] == axis]
        curves = {kind: _points(along, "axis", axis, "times", f"error_{kind}") for kind in KINDS}
        label = "times the elements of the links" if axis == "mesh" else "times the modes of the links"
        written += _draw(curves, f"{title}: {axis}", label, "error / peak", folder, f"error_{axis}")
    return written


def draw_growth(rows: Rows, folder: Path) -> list[Path]:
    """Time against size: of an evaluation with modes and links, and of a run with outputs."""
    kinds = [kind for kind in _names(rows, "with") if kind != "outputs"]
    curves = {kind: _points(rows, "with", kind, "size", TIME) for kind in kinds}
    outputs = {"a run of 0.1 s": _points(rows, "with", "outputs", "size", TIME)}
    return [
        *_draw(curves, "accelerations and multipliers", "modes, links", "least time each (s)", folder, "growth"),
        *_draw(outputs, "outputs of a run", "outputs", "least run time (s)", folder, "growth_outputs"),
    ]


def _names(rows: Rows, column: str) -> list[str]:
    return list(dict.fromkeys(row[column] for row in rows))


def _points(rows: Rows, column: str, name: str, x: str, y: str) -> tuple[list[float], list[float]]:
    """Values of x and y of the rows called `name` that have both."""
    pairs = [(row.get(x), row.get(y)) for row in rows if row[column] == name]
    found = [(float(a), float(b)) for a, b in pairs if a and b]
    return [a for a, _ in found], [b for _, b in found]


def _draw(curves: Curves, title: str, x_label: str, y_label: str, folder: Path, name: str) -> list[Path]:
    """Curves on logarithmic axes, PNG and PDF; nothing where all are empty."""
    shown = {label: points for label, points in curves.items() if points[0]}
    if not shown:
        return []
    with style():
        picture: Figure
        picture, axes = new_axes(title)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for k, (label, (x, y)) in enumerate(shown.items()):
            axes.plot(x, y, label=label, **line_style(k, len(x)))
        values = sorted({value for x, _ in shown.values() for value in x})
        if len(values) <= MOST_TICKS and values[-1] < 10 * values[0]:  # those between powers of ten run into each other
            axes.set_xticks(values, [f"{value:g}" for value in values])
            axes.set_xticks([], minor=True)
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        legend(axes)
        return write_figure(picture, folder, name)
