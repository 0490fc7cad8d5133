"""Draws the four figures of docs/theory.md: python docs/theory_sketches.py."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Rectangle
from scipy.integrate import trapezoid

INK, LINK, MOTOR, AXIS = "#333333", "#0072B2", "#D55E00", "#009E73"
FOLDER = Path(__file__).parent / "theory"
X = np.linspace(0.0, 1.0, 60)


def draw_all(folder: Path = FOLDER) -> None:
    """Write the figures as SVG."""
    matplotlib.rcParams["svg.hashsalt"] = "ffrobot"  # the same sketch makes the same file
    folder.mkdir(exist_ok=True)
    sketches: dict[str, tuple[Callable[[Axes], None], tuple[float, float, float, float]]] = {
        "floating_frame": (floating_frame, (-0.5, 3.3, -0.45, 1.75)),
        "attachment_modes": (attachment_modes, (-0.15, 4.75, -1.05, 0.75)),
        "gear": (gear, (-0.2, 4.5, -0.75, 1.15)),
        "patch": (patch, (-0.2, 3.4, -0.75, 1.15)),
    }
    for name, (sketch, (left, right, low, high)) in sketches.items():
        figure = Figure(figsize=(6.4, 6.4 * (high - low) / (right - left)), facecolor="white")
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        ax.axis("off")
        sketch(ax)
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None, "Creator": None})


def floating_frame(ax: Axes) -> None:
    """Global axes, the frame at R with A, the undeformed link, x, Φp and r."""
    _axes(ax, np.zeros(2), 0.0, 0.5, ("x", "y"), INK)
    root, angle = np.array([0.95, 0.35]), np.deg2rad(22.0)
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    straight = root + 2.0 * X[:, None] * along
    bent = straight + 0.55 * (X**2)[:, None] * across
    ax.plot(*straight.T, "--", color=LINK, linewidth=1.0)
    ax.plot(*bent.T, color=LINK, linewidth=6, alpha=0.35, solid_capstyle="round")
    _axes(ax, root, angle, 0.5, (r"$\bar{x}$", r"$\bar{y}$"), LINK)
    at = 46
    _arrow(ax, np.zeros(2), root, INK, r"$\mathbf{R}$", (0.1, -0.08))
    _arrow(ax, root, straight[at], LINK, r"$\mathbf{A}\,\mathbf{x}$", (0.12, -0.13))
    _arrow(ax, straight[at], bent[at], MOTOR, r"$\mathbf{A}\,\mathbf{\Phi}(\mathbf{x})\,\mathbf{p}$", (0.42, 0.1))
    _arrow(ax, np.zeros(2), bent[at], AXIS, r"$\mathbf{r}$", (-0.05, 0.14))
    ax.text(-0.42, -0.33, "global axes", fontsize=8, color=INK)
    ax.text(1.75, 0.33, "undeformed link", fontsize=8, color=LINK, rotation=22)


def attachment_modes(ax: Axes) -> None:
    """K⁻¹b as the sum of a part in the eigenmodes and of the residual, of a cantilever under a tip moment."""
    static, part = X**2, np.zeros_like(X)
    for x in (1.8751040687, 4.6940911330):  # clamped–free
        ratio = (np.cosh(x) + np.cos(x)) / (np.sinh(x) + np.sin(x))
        mode = np.cosh(x * X) - np.cos(x * X) - ratio * (np.sinh(x * X) - np.sin(x * X))
        part += mode * trapezoid(mode * static, X)
    shapes = (
        (0.0, static, r"$\mathbf{K}^{-1}\mathbf{b}$: static shape", "="),
        (1.65, part, r"$\mathbf{X}\mathbf{X}^T\mathbf{M}\mathbf{K}^{-1}\mathbf{b}$: in two eigenmodes", "+"),
        (3.3, 8.0 * (static - part), r"$\mathbf{R}$: residual, 8 times as large", ""),
    )
    for left, shape, text, sign in shapes:
        ax.plot([left, left], [-0.16, 0.16], color=INK, linewidth=2.5)
        ax.plot([left, left + 1.2], [0.0, 0.0], "--", color=LINK, linewidth=0.8)
        ax.plot(left + 1.2 * X, 0.5 * shape, color=LINK, linewidth=4, alpha=0.5)
        ax.text(left + 0.6, -0.55, text, fontsize=8, color=INK, ha="center")
        ax.text(left + 1.4, 0.0, sign, fontsize=13, color=INK, ha="center", va="center")
    _turn(ax, np.array([1.2, 0.5]), 0.16, -60.0, 120.0, r"$\mathbf{b}$", (0.27, -0.02))


def gear(ax: Axes) -> None:
    """Body a with the rotor, the gear N, the compliant spring and body b, with ψ, θ_m, δ and γ."""
    ax.add_patch(Rectangle((0.0, -0.45), 2.55, 0.2, color=LINK, alpha=0.35))
    ax.text(0.1, -0.63, "body a: stator, gear housing", fontsize=8, color=LINK)
    ax.add_patch(Rectangle((0.35, -0.2), 0.55, 0.5, facecolor="white", edgecolor=MOTOR, linewidth=1.8))
    ax.text(0.625, 0.05, "rotor\n$J$", fontsize=8, color=MOTOR, ha="center", va="center")
    ax.add_patch(Rectangle((1.45, -0.25), 0.6, 0.6, facecolor="white", edgecolor=INK, linewidth=1.5))
    ax.text(1.75, 0.05, "gear\n$N : 1$", fontsize=8, color=INK, ha="center", va="center")
    for left, right in ((0.9, 1.45), (2.05, 2.5), (3.1, 3.45)):
        ax.plot([left, right], [0.05, 0.05], color=INK, linewidth=1.5)
    coil = np.linspace(2.5, 3.1, 13)
    ax.plot(coil, 0.05 + 0.09 * np.array([0.0, *([1.0, -1.0] * 5), 1.0, 0.0]), color=AXIS, linewidth=1.4)
    ax.text(2.8, -0.22, "$k$, $d$\ntwist $\\delta$", fontsize=8, color=AXIS, ha="center", va="center")
    ax.add_patch(Rectangle((3.45, -0.45), 0.85, 1.0, color=LINK, alpha=0.35))
    ax.text(3.875, 0.05, "body b", fontsize=8, color=LINK, ha="center", va="center")
    for x, text, color in (
        (1.15, r"$\psi = \alpha_a + N\theta_m$", MOTOR),
        (2.28, r"$\theta_m$ on a", INK),
        (3.28, r"$\gamma = \theta_m - \delta$ on a", AXIS),
    ):
        ax.add_patch(Arc((x, 0.05), 0.2, 0.62, theta1=-70, theta2=70, color=color, linewidth=1.5))
        ax.annotate("", (x + 0.03, 0.36), (x + 0.08, 0.26), arrowprops={"arrowstyle": "-|>", "color": color})
        ax.text(x, 0.62 if x != 2.28 else 0.85, text, fontsize=8, color=color, ha="center")
    ax.text(0.625, 0.42, r"$\tau/N$", fontsize=8, color=MOTOR, ha="center")


def patch(ax: Axes) -> None:
    """A link with a pair of patches: their ends, thicknesses, and the moment cV at both ends."""
    ax.plot([0.0, 0.0], [-0.28, 0.28], color=INK, linewidth=2.5)
    ax.add_patch(Rectangle((0.0, -0.1), 3.0, 0.2, color=LINK, alpha=0.35))
    for low in (0.1, -0.18):
        ax.add_patch(Rectangle((0.9, low), 1.2, 0.08, color=MOTOR, alpha=0.75))
    for x, text in ((0.9, "$x_1$"), (2.1, "$x_2$")):
        ax.plot([x, x], [-0.5, 0.45], ":", color=INK, linewidth=0.9)
        ax.text(x, -0.62, text, fontsize=9, color=INK, ha="center")
    _turn(ax, np.array([0.9, 0.0]), 0.34, 130.0, 230.0, "$cV$", (-0.5, 0.0))
    _turn(ax, np.array([2.1, 0.0]), 0.34, 50.0, -50.0, "$cV$", (0.5, 0.0))
    ax.annotate("", (2.75, 0.1), (2.75, -0.1), arrowprops={"arrowstyle": "<->", "color": INK})
    ax.text(2.83, 0.0, "$t_b$", fontsize=9, color=INK, va="center")
    ax.text(1.5, 0.26, r"$t_p$, $E_p$, $d_{31}$, voltage $V$", fontsize=8, color=MOTOR, ha="center")
    ax.plot(3.0 * X, 0.72 + 0.0 * X, color=INK, linewidth=0.8)
    ax.plot([0.9, 0.9, 2.1, 2.1], [0.72, 0.98, 0.98, 0.72], color=AXIS, linewidth=1.6)
    ax.text(1.5, 1.03, "induced curvature", fontsize=8, color=AXIS, ha="center")
    ax.add_patch(Circle((3.0, 0.0), 0.03, color=INK))


def _axes(ax: Axes, at: np.ndarray, angle: float, size: float, names: tuple[str, str], color: str) -> None:
    for turn, name in zip((angle, angle + np.pi / 2), names, strict=True):
        way = np.array([np.cos(turn), np.sin(turn)])
        ax.annotate("", at + size * way, at, arrowprops={"arrowstyle": "->", "color": color, "linewidth": 1.3})
        ax.text(*(at + (size + 0.08) * way), name, color=color, fontsize=9, ha="center", va="center")


def _arrow(ax: Axes, begin: np.ndarray, end: np.ndarray, color: str, text: str, shift: tuple[float, float]) -> None:
    ax.annotate(
        "", end, begin, arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0}
    )
    ax.text(*(0.5 * (begin + end) + shift), text, color=color, fontsize=10, ha="center", va="center")


def _turn(
    ax: Axes, at: np.ndarray, radius: float, begin: float, end: float, text: str, shift: tuple[float, float]
) -> None:
    """A moment as an arc from `begin` to `end`, degrees."""
    low, high = min(begin, end), max(begin, end)
    ax.add_patch(Arc((at[0], at[1]), 2 * radius, 2 * radius, theta1=low, theta2=high, color=MOTOR, linewidth=1.8))
    angle, sense = np.deg2rad(end), np.sign(end - begin)
    tip = at + radius * np.array([np.cos(angle), np.sin(angle)])
    tangent = sense * np.array([-np.sin(angle), np.cos(angle)])
    ax.annotate("", tip + 0.02 * tangent, tip - 0.06 * tangent, arrowprops={"arrowstyle": "-|>", "color": MOTOR})
    ax.text(*(at + shift), text, color=MOTOR, fontsize=9, ha="center", va="center")


if __name__ == "__main__":
    draw_all()
