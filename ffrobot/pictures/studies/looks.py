"""What designs look like by their state, in figures and in the report."""

from __future__ import annotations

from dataclasses import dataclass

from ..figures.palette import COLORS
from .diagrams import State


@dataclass(frozen=True)
class Look:
    """Of the lines and points of designs; the last of `LOOKS` are drawn last."""

    label: str
    color: str
    width: float
    dash: str  # of matplotlib
    marker: str  # of matplotlib

    @property
    def plotly(self) -> tuple[str, str]:
        """Dashes and marker in Plotly's words."""
        return (
            {"-": "solid", ":": "dot", "--": "dash"}[self.dash],
            {"o": "circle", "x": "x-thin-open", "^": "triangle-up-open", "D": "diamond"}[self.marker],
        )


LOOKS: dict[State, Look] = {
    "failed": Look("failed", "#8b95a3", 0.8, ":", "x"),
    "exceeded": Look("beyond a limit", COLORS[5], 0.8, "--", "^"),
    "kept": Look("within limits", COLORS[4], 0.8, "-", "o"),
    "best": Look("best", COLORS[1], 2.4, "-", "D"),
}
