"""Charts as Plotly's JavaScript takes them: plain dictionaries, numbers as binary text."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass, field
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common.arrays import Array
from ..projection import COLORS

MAX_POINTS = 4000  # of a curve; more cannot be told apart on a screen

DASHES = ("solid", "dash", "dashdot", "dot")
# Violet to green (viridis, its dark end brighter: dark pages), for series with an order: patches along a link, modes.
SHADES = np.array([[110, 80, 170], [65, 115, 175], [33, 145, 140], [94, 201, 98]], dtype=float)


@dataclass
class Chart:
    """One diagram of the page.

    Attributes:
        name: unique on the page; letters, digits, `_`.
        title, x_label, y_label: with units.
        traces: in Plotly's terms.
        limits: horizontal lines.
        includes: values that the range of y has at least.
        equal_axes: one metre is as long on both.
    """

    name: str
    title: str
    y_label: str
    x_label: str = "time (s)"
    traces: list[dict[str, Any]] = field(default_factory=list)
    limits: tuple[float, ...] = ()
    includes: tuple[float, ...] = ()
    equal_axes: bool = False

    def add(self, label: str, x: Array, y: Array, **style: Any) -> None:  # noqa: ANN401 (a trace's own keys)
        """Add a curve y(x)."""
        mode = "lines" if len(y) > 1 else "markers"
        self.traces.append({"type": "scatter", "mode": mode, "name": plain(label), **_coordinates(x, y), **style})
        if mode == "lines":  # else Plotly leaves out points that it takes for straight: corners on smooth curves
            self.traces[-1]["line"] = {**self.traces[-1].get("line", {}), "simplify": False}

    @property
    def layout(self) -> dict[str, Any]:
        """Plotly's layout of this chart."""
        lines = [
            {
                "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": limit, "y1": limit,
                "line": limit_style(),
            }
            for limit in self.limits
        ]  # fmt: skip
        if lines:
            text = "limits " + ", ".join(f"{limit:g}" for limit in self.limits)
            lines[0]["label"] = {"text": text, "textposition": "start", "font": {"color": COLORS[1]}}
        y_axis: dict[str, Any] = {"title": {"text": self.y_label}, "automargin": True, "exponentformat": "power"}
        if self.includes:
            y_axis |= {"autorangeoptions": {"include": list(self.includes)}}
        if self.equal_axes:
            y_axis |= {"scaleanchor": "x"}
        return {
            "title": {"text": plain(self.title)},
            "xaxis": {"title": {"text": self.x_label, "standoff": 5}},
            "yaxis": y_axis,
            "shapes": lines,
            "showlegend": len(self.traces) > 1,
        }


def plain(text: str) -> str:
    """`text` as Plotly shows it literally: it would take <b> for bold."""
    return escape(text, quote=False)


def encoded(values: NDArray[Any], kind: str = "f4") -> dict[str, str]:
    """Plotly's typed array: base64 of little-endian numbers, row by row; "f4" keeps 7 digits."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    entry = {"dtype": kind, "bdata": b64encode(array.tobytes()).decode("ascii")}
    if array.ndim == 2:
        entry["shape"] = f"{array.shape[0]}, {array.shape[1]}"
    return entry


def limit_style() -> dict[str, Any]:
    """Of lines that say what a motor or a patch can do."""
    return {"color": COLORS[1], "dash": "dash", "width": 1.5}


def style(k: int) -> dict[str, Any]:
    """Colour, dashes and width of the k-th curve of a chart: thinner and thinner, so that none hides another."""
    width = max(1.2, 3.6 * 0.75**k)
    return {"line": {"color": COLORS[k % len(COLORS)], "dash": DASHES[k // len(COLORS) % len(DASHES)], "width": width}}


def shades(count: int) -> list[str]:
    """Colours of `count` ordered series, dark to light."""
    where = np.linspace(0.0, len(SHADES) - 1.0, count)
    channels = [np.interp(where, np.arange(len(SHADES)), SHADES[:, k]) for k in range(3)]
    return [f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in zip(*channels, strict=True)]


def kept_outputs(values: Array) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Which of many points (T,) a curve is drawn through: all, or the least and the largest of each stretch."""
    if len(values) <= MAX_POINTS or np.isnan(values).any():
        return np.arange(len(values))
    edges = np.linspace(0, len(values), MAX_POINTS // 2, dtype=np.intp)
    stretches = [np.arange(a, b) for a, b in pairwise(edges)]
    extremes = [(s[np.argmin(values[s])], s[np.argmax(values[s])]) for s in stretches]
    return np.unique(np.array([0, len(values) - 1, *np.ravel(extremes)], dtype=np.intp))


def _coordinates(x: Array, y: Array) -> dict[str, Any]:
    """X and y of a trace; equal steps take two numbers instead of an array."""
    kept = kept_outputs(y)
    steps = np.diff(x[kept])
    if len(steps) > 1 and np.all(np.abs(steps - steps[0]) <= 1e-9 * np.abs(x[-1] - x[0])):
        return {"x0": float(x[0]), "dx": float((x[-1] - x[0]) / len(steps)), "y": encoded(y[kept])}
    return {"x": encoded(x[kept], "f8"), "y": encoded(y[kept])}
