"""Draws docs/reference/conventions.svg, the sketch of the page of conventions: python docs/conventions_sketch.py."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc

INK, LINK, MOTOR, AXIS = "#333333", "#0072B2", "#D55E00", "#009E73"
THETA = (np.deg2rad(25.0), np.deg2rad(70.0))  # absolute angles of the two frames
LENGTH = (1.5, 1.0)


def draw(path: Path) -> None:
    """Two links: global and body axes, angles, a moment on both its sides, deflection, a load."""
    matplotlib.rcParams["svg.hashsalt"] = "ffrobot"  # the same sketch gives the same file
    figure = Figure(figsize=(6.4, 3.9))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    ax.set(xlim=(-0.75, 3.05), ylim=(-0.42, 1.9), aspect="equal")
    ax.axis("off")
    root = np.zeros(2)
    elbow, tip = _link(ax, root, 0, "1"), None
    tip = _link(ax, elbow, 1, "2")
    _frame(ax, np.array([-0.55, 0.0]), 0.0, 0.32, ("x", "y"), INK)
    ax.annotate("", (-0.55, 0.72), (-0.55, 1.12), arrowprops={"arrowstyle": "->", "color": INK})
    ax.text(-0.5, 0.9, "gravity = [0, −9.81]", color=INK, fontsize=8)
    _angle(ax, root, 0.75, 0.0, THETA[0], r"$\theta_1$: absolute", AXIS)
    _angle(ax, elbow, 0.55, 0.0, THETA[1], r"$\theta_2$: absolute", AXIS)
    _angle(ax, elbow, 0.82, THETA[0], THETA[1], r"$\gamma$: joint, relative", MOTOR)
    for place in (root, elbow, tip):
        ax.plot(*place, "o", color="white", markeredgecolor=INK, markersize=7, zorder=5)
    ax.plot([-0.14, 0.14], [-0.1, -0.1], color=INK, linewidth=1.5)
    ax.plot([-0.14, 0.0, 0.14], [-0.1, 0.0, -0.1], color=INK, linewidth=1.0)
    ax.text(0.18, -0.14, '"ground"', fontsize=8, color=INK)
    _moment(ax, elbow, 0.2, 20.0, 150.0, r"$\tau$ on the second", (-0.28, 0.27))
    _moment(ax, elbow, 0.28, 270.0, 190.0, r"$-\tau$ on the first", (-0.2, -0.42))
    ax.annotate("", tip + np.array([0.42, 0.0]), tip, arrowprops={"arrowstyle": "-|>", "color": MOTOR})
    ax.text(*(tip + np.array([0.2, 0.06])), "load x > 0", fontsize=8, color=MOTOR)
    figure.savefig(path, metadata={"Date": None, "Creator": None})


def _link(ax: Axes, origin: np.ndarray, k: int, name: str) -> np.ndarray:
    """A link with its frame at the root, undeformed (dashed) and bent towards +y; returns where its tip is."""
    theta, length = THETA[k], LENGTH[k]
    along, across = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
    s = np.linspace(0.0, 1.0, 50)[:, None]
    bent = origin + length * s * along + 0.16 * length * s * (1 - s) * 2 * across
    ax.plot(*bent.T, color=LINK, linewidth=5, alpha=0.35, solid_capstyle="round")
    ax.plot(*np.array([origin, origin + length * along]).T, "--", color=LINK, linewidth=0.8)
    _frame(ax, origin, theta, 0.34, (f"$x_{name}$", f"$y_{name}$"), LINK)
    middle = origin + 0.55 * length * along
    ax.annotate("", middle + 0.08 * length * across, middle, arrowprops={"arrowstyle": "-|>", "color": LINK})
    if k == 0:
        ax.text(*(middle + 0.17 * across - 0.1 * along), "deflection > 0", fontsize=8, color=LINK, ha="center",
                rotation=np.rad2deg(theta))  # fmt: skip
    return np.asarray(origin + length * along)


def _frame(ax: Axes, at: np.ndarray, theta: float, size: float, names: tuple[str, str], color: str) -> None:
    for angle, name in zip((theta, theta + np.pi / 2), names, strict=True):
        end = at + size * np.array([np.cos(angle), np.sin(angle)])
        ax.annotate("", end, at, arrowprops={"arrowstyle": "->", "color": color, "linewidth": 1.2})
        ax.text(*(end + 0.06 * np.array([np.cos(angle), np.sin(angle)])), name, color=color, fontsize=9, ha="center",
                va="center")  # fmt: skip


def _angle(ax: Axes, at: np.ndarray, radius: float, begin: float, end: float, text: str, color: str) -> None:
    """An angle from `begin` to `end`, rad, with its first leg and an arrow head."""
    leg = at + (radius + 0.12) * np.array([np.cos(begin), np.sin(begin)])
    ax.plot(*np.array([at, leg]).T, ":", color=color, linewidth=0.9)
    ax.add_patch(Arc(tuple(at), 2 * radius, 2 * radius, theta1=np.rad2deg(begin), theta2=np.rad2deg(end), color=color))
    _head(ax, at, radius, end, 1.0, color)
    middle = 0.5 * (begin + end) if begin else 0.35 * end
    ax.text(*(at + (radius + 0.06) * np.array([np.cos(middle), np.sin(middle)])), text, color=color, fontsize=8,
            va="center")  # fmt: skip


def _moment(
    ax: Axes, at: np.ndarray, radius: float, begin: float, end: float, text: str, where: tuple[float, float]
) -> None:
    """A moment as an arc from `begin` to `end` (degrees), counter-clockwise where that is the larger."""
    low, high = min(begin, end), max(begin, end)
    ax.add_patch(Arc(tuple(at), 2 * radius, 2 * radius, theta1=low, theta2=high, color=MOTOR, linewidth=1.8))
    _head(ax, at, radius, np.deg2rad(end), 1.0 if end > begin else -1.0, MOTOR)
    ax.text(*(at + where), text, color=MOTOR, fontsize=8, ha="center")


def _head(ax: Axes, at: np.ndarray, radius: float, angle: float, sense: float, color: str) -> None:
    tip = at + radius * np.array([np.cos(angle), np.sin(angle)])
    tangent = sense * np.array([-np.sin(angle), np.cos(angle)])
    ax.annotate("", tip + 0.01 * tangent, tip - 0.05 * tangent, arrowprops={"arrowstyle": "-|>", "color": color})


if __name__ == "__main__":
    draw(Path(__file__).parent / "reference" / "conventions.svg")
