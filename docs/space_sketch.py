"""Draws docs/reference/conventions_space.svg, the sketch of conventions in space: python docs/space_sketch.py."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

INK, LINK, MOTOR, AXIS = "#333333", "#0072B2", "#D55E00", "#009E73"
AZIMUTH, ELEVATION = np.radians(-62.0), np.radians(22.0)  # of the viewer
RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
TOWARDS = np.array([np.cos(ELEVATION) * np.cos(AZIMUTH), np.cos(ELEVATION) * np.sin(AZIMUTH), np.sin(ELEVATION)])
PAGE = np.stack([RIGHT, np.cross(TOWARDS, RIGHT)])  # rows: right and up on the page
COLUMN, UPPER, FORE = 0.8, 1.25, 0.95
YAW, LIFT, BEND = np.radians(22.0), np.radians(38.0), np.radians(-62.0)


def draw(path: Path) -> None:
    """An arm of yaw, pitch, pitch: global and body axes, angles about axes, a deflection, the order of rotations."""
    matplotlib.rcParams["svg.hashsalt"] = "ffrobot"  # the same sketch gives the same file
    figure = Figure(figsize=(6.4, 4.2))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(-1.1, 2.75), ylim=(-0.55, 1.98), aspect="equal")
    ax.axis("off")
    A = [about(2, YAW), about(2, YAW) @ about(1, -LIFT), about(2, YAW) @ about(1, -LIFT - BEND)]
    foot, shoulder = np.zeros(3), np.array([0.0, 0.0, COLUMN])
    elbow = shoulder + UPPER * A[1][:, 0]
    tip = elbow + FORE * A[2][:, 0]
    for first, last, width in ((foot, shoulder, 9), (shoulder, elbow, 7), (elbow, tip, 5)):
        ax.plot(*np.array([on_page(first), on_page(last)]).T, color=LINK, linewidth=width, alpha=0.3,
                solid_capstyle="round")  # fmt: skip
    bent = elbow + np.linspace(0, 1, 40)[:, None] * FORE * A[2][:, 0]
    bent = bent - 0.16 * (np.linspace(0, 1, 40) ** 2)[:, None] * A[2][:, 2]
    ax.plot(*on_page(bent).T, color=LINK, linewidth=1.6)
    _arrow(ax, tip, bent[-1], LINK)
    _text(ax, bent[-1] + [0.06, 0.0, -0.1], r"deflection $\Phi p$, here $-z$", LINK)
    _frame(ax, np.array([-0.85, 0.0, 0.0]), np.eye(3), 0.42, "xyz", INK)
    _text(ax, [-0.85, 0.0, -0.22], "global axes", INK)
    _frame(ax, shoulder, A[1], 0.5, (r"$x_{upper}$", r"$y_{upper}$", r"$z_{upper}$"), AXIS)
    _turn(ax, np.array([0.0, 0.0, 0.3]), np.eye(3)[:, 2], A[0][:, 0], 0.3, "waist: about z", MOTOR, (0.3, -0.1))
    _turn(ax, elbow, -A[0][:, 1], A[1][:, 0], 0.26, r"elbow: axis $-y$ of the first", MOTOR, (0.05, 0.34))
    for place in (foot, shoulder, elbow, tip):
        ax.plot(*on_page(place), "o", color="white", markeredgecolor=INK, markersize=7, zorder=5)
    _order(ax)
    figure.savefig(path, metadata={"Date": None, "Creator": None})


def _order(ax: Axes) -> None:
    """Roll, pitch, yaw: three right-handed rotations about fixed axes."""
    x, y = 0.32, -0.13
    ax.text(x, y, r"rpy: about fixed axes, first $x$ (roll), then $y$ (pitch), then $z$ (yaw)", fontsize=8, color=INK)
    ax.text(x, y - 0.14, r"$A = R_z(\mathrm{yaw})\,R_y(\mathrm{pitch})\,R_x(\mathrm{roll})$", fontsize=8, color=INK)
    ax.text(x, y - 0.28, "positive: counter-clockwise, seen against the axis", fontsize=8, color=INK)


def about(axis: int, angle: float) -> np.ndarray:
    """The right-handed rotation about a coordinate axis."""
    c, s, (j, k) = np.cos(angle), np.sin(angle), ((axis + 1) % 3, (axis + 2) % 3)
    A = np.eye(3)
    A[j, j] = A[k, k] = c
    A[j, k], A[k, j] = -s, s
    return A


def on_page(points: np.ndarray | list[float]) -> np.ndarray:
    """(…, 2) of (…, 3)."""
    return np.asarray(points) @ PAGE.T


def _text(ax: Axes, at: np.ndarray | list[float], text: str, color: str) -> None:
    ax.text(*on_page(at), text, fontsize=8, color=color, ha="left", va="center")


def _arrow(ax: Axes, begin: np.ndarray, end: np.ndarray, color: str) -> None:
    style = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", on_page(end), on_page(begin), arrowprops=style)


def _frame(ax: Axes, at: np.ndarray, A: np.ndarray, size: float, names: tuple[str, ...] | str, color: str) -> None:
    for axis, name in zip(A.T, names, strict=True):
        _arrow(ax, at, at + size * axis, color)
        ax.text(*on_page(at + 1.16 * size * axis), name, fontsize=8, color=color, ha="center", va="center")


def _turn(
    ax: Axes, at: np.ndarray, axis: np.ndarray, start: np.ndarray, radius: float, text: str, color: str,
    where: tuple[float, float],
) -> None:  # fmt: skip
    """A right-handed turn about an axis: the axis, dashed, and three quarters of a circle with its head."""
    ax.plot(*on_page(np.array([at - 0.36 * axis, at + 0.36 * axis])).T, "--", color=color, linewidth=0.9)
    angle = np.linspace(0.3, 4.6, 60)[:, None]
    first = start - (start @ axis) * axis
    first = first / np.linalg.norm(first)
    circle = at + radius * (np.cos(angle) * first + np.sin(angle) * np.cross(axis, first))
    ax.plot(*on_page(circle).T, color=color, linewidth=1.5)
    _arrow(ax, circle[-4], circle[-1], color)
    ax.text(*(on_page(at) + where), text, fontsize=8, color=color)


if __name__ == "__main__":
    draw(Path(__file__).parent / "reference" / "conventions_space.svg")
