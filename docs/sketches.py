"""Draws the sketches of docs/theory.md and of the pages of conventions: python docs/sketches.py."""

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
FOLDER = Path(__file__).parent
X = np.linspace(0.0, 1.0, 60)


def draw_all(folder: Path = FOLDER) -> None:
    """Write the figures as SVG."""
    matplotlib.rcParams["svg.hashsalt"] = "ffrobot"  # the same sketch makes the same file
    for name, (sketch, height, (left, right, low, high), color) in SKETCHES.items():
        figure = Figure(figsize=(6.4, height), facecolor=color)
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        ax.axis("off")
        sketch(ax)
        path = folder / f"{name}.svg"
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path, metadata={"Date": None, "Creator": None})


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
    _head(ax, at, radius, np.deg2rad(end), float(np.sign(end - begin)), MOTOR)
    ax.text(*(at + shift), text, color=MOTOR, fontsize=9, ha="center", va="center")


THETA = (np.deg2rad(25.0), np.deg2rad(70.0))  # absolute angles of the two frames
LENGTH = (1.5, 1.0)


def conventions(ax: Axes) -> None:
    """Two links: global and body axes, angles, a moment on both its sides, deflection, a load."""
    root = np.zeros(2)
    elbow, tip = _link(ax, root, 0, "1"), None
    tip = _link(ax, elbow, 1, "2")
    _axes(ax, np.array([-0.55, 0.0]), 0.0, 0.32, ("x", "y"), INK)
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
    _turn(ax, elbow, 0.2, 20.0, 150.0, r"$\tau$ on the second", (-0.28, 0.27))
    _turn(ax, elbow, 0.28, 270.0, 190.0, r"$-\tau$ on the first", (-0.2, -0.42))
    ax.annotate("", tip + np.array([0.42, 0.0]), tip, arrowprops={"arrowstyle": "-|>", "color": MOTOR})
    ax.text(*(tip + np.array([0.2, 0.06])), "load x > 0", fontsize=8, color=MOTOR)


def _link(ax: Axes, origin: np.ndarray, k: int, name: str) -> np.ndarray:
    """A link with its frame at the root, undeformed (dashed) and bent towards +y; returns where its tip is."""
    theta, length = THETA[k], LENGTH[k]
    along, across = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
    s = np.linspace(0.0, 1.0, 50)[:, None]
    bent = origin + length * s * along + 0.16 * length * s * (1 - s) * 2 * across
    ax.plot(*bent.T, color=LINK, linewidth=5, alpha=0.35, solid_capstyle="round")
    ax.plot(*np.array([origin, origin + length * along]).T, "--", color=LINK, linewidth=0.8)
    _axes(ax, origin, theta, 0.34, (f"$x_{name}$", f"$y_{name}$"), LINK)
    middle = origin + 0.55 * length * along
    ax.annotate("", middle + 0.08 * length * across, middle, arrowprops={"arrowstyle": "-|>", "color": LINK})
    if k == 0:
        ax.text(*(middle + 0.17 * across - 0.1 * along), "deflection > 0", fontsize=8, color=LINK, ha="center",
                rotation=np.rad2deg(theta))  # fmt: skip
    return np.asarray(origin + length * along)


def _angle(ax: Axes, at: np.ndarray, radius: float, begin: float, end: float, text: str, color: str) -> None:
    """An angle from `begin` to `end`, rad, with its first leg and an arrow head."""
    leg = at + (radius + 0.12) * np.array([np.cos(begin), np.sin(begin)])
    ax.plot(*np.array([at, leg]).T, ":", color=color, linewidth=0.9)
    ax.add_patch(Arc(tuple(at), 2 * radius, 2 * radius, theta1=np.rad2deg(begin), theta2=np.rad2deg(end), color=color))
    _head(ax, at, radius, end, 1.0, color)
    middle = 0.5 * (begin + end) if begin else 0.35 * end
    ax.text(*(at + (radius + 0.06) * np.array([np.cos(middle), np.sin(middle)])), text, color=color, fontsize=8,
            va="center")  # fmt: skip


def _head(ax: Axes, at: np.ndarray, radius: float, angle: float, sense: float, color: str) -> None:
    tip = at + radius * np.array([np.cos(angle), np.sin(angle)])
    tangent = sense * np.array([-np.sin(angle), np.cos(angle)])
    ax.annotate("", tip + 0.01 * tangent, tip - 0.05 * tangent, arrowprops={"arrowstyle": "-|>", "color": color})


AZIMUTH, ELEVATION = np.radians(-62.0), np.radians(22.0)  # of the viewer
RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
TOWARDS = np.array([np.cos(ELEVATION) * np.cos(AZIMUTH), np.cos(ELEVATION) * np.sin(AZIMUTH), np.sin(ELEVATION)])
PAGE = np.stack([RIGHT, np.cross(TOWARDS, RIGHT)])  # rows: right and up on the page
COLUMN, UPPER, FORE = 0.8, 1.25, 0.95
YAW, LIFT, BEND = np.radians(22.0), np.radians(38.0), np.radians(-62.0)


def conventions_in_3d(ax: Axes) -> None:
    """An arm of yaw, pitch, pitch: global and body axes, angles about axes, a deflection, the order of rotations."""
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
    _arrow_3d(ax, tip, bent[-1], LINK)
    _text(ax, bent[-1] + [0.06, 0.0, -0.1], r"deflection $\Phi p$, here $-z$", LINK)
    _frame_3d(ax, np.array([-0.85, 0.0, 0.0]), np.eye(3), 0.42, "xyz", INK)
    _text(ax, [-0.85, 0.0, -0.22], "global axes", INK)
    _frame_3d(ax, shoulder, A[1], 0.5, (r"$x_{upper}$", r"$y_{upper}$", r"$z_{upper}$"), AXIS)
    _turn_3d(ax, np.array([0.0, 0.0, 0.3]), np.eye(3)[:, 2], A[0][:, 0], 0.3, "waist: about z", MOTOR, (0.3, -0.1))
    _turn_3d(ax, elbow, -A[0][:, 1], A[1][:, 0], 0.26, r"elbow: axis $-y$ of the first", MOTOR, (0.05, 0.34))
    for place in (foot, shoulder, elbow, tip):
        ax.plot(*on_page(place), "o", color="white", markeredgecolor=INK, markersize=7, zorder=5)
    _order(ax)


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


def _arrow_3d(ax: Axes, begin: np.ndarray, end: np.ndarray, color: str) -> None:
    style = {"arrowstyle": "-|>", "color": color, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", on_page(end), on_page(begin), arrowprops=style)


def _frame_3d(ax: Axes, at: np.ndarray, A: np.ndarray, size: float, names: tuple[str, ...] | str, color: str) -> None:
    for axis, name in zip(A.T, names, strict=True):
        _arrow_3d(ax, at, at + size * axis, color)
        ax.text(*on_page(at + 1.16 * size * axis), name, fontsize=8, color=color, ha="center", va="center")


def _turn_3d(
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
    _arrow_3d(ax, circle[-4], circle[-1], color)
    ax.text(*(on_page(at) + where), text, fontsize=8, color=color)


def pipeline(ax: Axes) -> None:
    """From link and scene files to results: files as boxes, the two stages between them."""
    boxes = (
        (0.0, 0.62, "link file", "arm.toml, STEP, mesh", INK),
        (1.45, 0.62, "stage 1", "elements → modes", LINK),
        (2.9, 0.62, "modal body", "arm.h5", INK),
        (2.9, 0.0, "scene file", "joints, path, motors", INK),
        (4.35, 0.31, "stage 2", "multibody dynamics", LINK),
        (5.8, 0.31, "results", "scene.results.h5", INK),
        (7.25, 0.31, "answers", "summary, page, Python", MOTOR),
    )
    for x, y, name, about, color in boxes:
        ax.add_patch(Rectangle((x, y), 1.15, 0.44, facecolor="white", edgecolor=color, linewidth=1.2))
        ax.text(x + 0.575, y + 0.28, name, ha="center", va="center", fontsize=7.5, color=color, weight="bold")
        ax.text(x + 0.575, y + 0.12, about, ha="center", va="center", fontsize=4.8, color=INK)
    for begin, end in (
        ((1.15, 0.84), (1.45, 0.84)), ((2.6, 0.84), (2.9, 0.84)), ((4.05, 0.84), (4.35, 0.62)),
        ((4.05, 0.22), (4.35, 0.44)), ((5.5, 0.53), (5.8, 0.53)), ((6.95, 0.53), (7.25, 0.53)),
    ):  # fmt: skip
        _arrow(ax, np.array(begin), np.array(end), INK, "", (0.0, 0.0))
    ax.text(2.02, 1.16, "ffrobot link", ha="center", fontsize=5.5, color=LINK, family="monospace")
    ax.text(4.92, 0.85, "ffrobot solve", ha="center", fontsize=5.5, color=LINK, family="monospace")
    ax.text(7.82, 0.85, "report, plot", ha="center", fontsize=5.5, color=MOTOR, family="monospace")


SKETCHES: dict[str, tuple[Callable[[Axes], None], float, tuple[float, float, float, float], str | None]] = {
    "pipeline": (pipeline, 6.4 * 1.4 / 8.6, (-0.1, 8.5, -0.1, 1.3), "white"),
    "theory/floating_frame": (floating_frame, 6.4 * 2.2 / 3.8, (-0.5, 3.3, -0.45, 1.75), "white"),
    "theory/attachment_modes": (attachment_modes, 6.4 * 1.8 / 4.9, (-0.15, 4.75, -1.05, 0.75), "white"),
    "theory/gear": (gear, 6.4 * 1.9 / 4.7, (-0.2, 4.5, -0.75, 1.15), "white"),
    "theory/patch": (patch, 6.4 * 1.9 / 3.6, (-0.2, 3.4, -0.75, 1.15), "white"),
    "reference/conventions": (conventions, 3.9, (-0.75, 3.05, -0.42, 1.9), None),
    "reference/conventions_space": (conventions_in_3d, 4.2, (-1.1, 2.75, -0.55, 1.98), None),
}
"""By file: what draws it, its height (inches), the range of both axes, and its background."""


if __name__ == "__main__":
    draw_all()
