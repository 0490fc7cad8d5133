"""The manipulator with solid links against the same with beams, from a static start: frequencies, forces, a figure.

    .venv/bin/python cases/two_link_solid/compare.py

The scene is that of cases/two_link; only the start (at rest under gravity, nothing rings) and the links are exchanged.
"""

import re
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np

import ffrobot
from ffrobot.results.file import Results

mpl.use("Agg")
from matplotlib import pyplot as plt

HERE = Path(__file__).parent
BEAMS = HERE.parent / "two_link"
THEORY = '\n[model]\ntheory = "{}"\n'


def solved(links: str) -> Results:
    """PCID from the static start with links "solid", "timoshenko" or "euler-bernoulli"."""
    scene = (HERE / "scene.toml").read_text()
    head, inverse = scene.split("[[analysis]]")[:2]
    head = re.sub(r'state = "undeformed"', 'state = "static"', head)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(head + "[[analysis]]" + inverse.replace("1e-7", "1e-6"))
        for name in ("link1.toml", "link2.toml"):
            text = (HERE / name if links == "solid" else BEAMS / name).read_text()
            (Path(folder) / name).write_text(text if links == "solid" else text + THEORY.format(links))
        return ffrobot.solve(path)


def histories(results: Results) -> dict[str, np.ndarray]:
    """Tip force and joint moments over time."""
    force = results["inverse/trajectories/tip/force"]
    moments = {f"moment {joint} (N·m)": results[f"inverse/joints/{joint}/moment"] for joint in ("O", "A")}
    return {"tip force x (N)": force[:, 0], "tip force y (N)": force[:, 1], **moments}


def print_frequencies(solutions: dict[str, Results]) -> None:
    """Differences of ω from the Timoshenko beam's, in percent."""
    for link in ("link1", "link2"):
        print(f"\n{link}: bending frequency of the Timoshenko beam (Hz), and in % of it what others differ")
        base = solutions["timoshenko"].modal_body(link).frequency
        others = {name: s.modal_body(link).frequency / base - 1 for name, s in solutions.items()}
        for k in range(5):
            print(
                f"  {base[k]:10.4f}"
                + "".join(f"  {n} {100 * o[k]:+.3f}" for n, o in others.items() if n != "timoshenko")
            )


def draw(curves: dict[str, dict[str, np.ndarray]], time: np.ndarray) -> None:
    """The histories over each other, and what solid and Timoshenko differ, in percent of the peak."""
    figure, axes = plt.subplots(4, 2, figsize=(9, 9), sharex=True, layout="constrained")
    for (left, right), quantity in zip(axes, curves["solid"], strict=True):
        for name, style in (("euler-bernoulli", ":"), ("timoshenko", "-"), ("solid", "--")):
            left.plot(time, curves[name][quantity], style, label=name)
        base = curves["timoshenko"][quantity]
        for name, style in (("euler-bernoulli", ":"), ("solid", "--")):
            right.plot(
                time, 100 * (curves[name][quantity] - base) / np.abs(base).max(), style, label=f"{name} − timoshenko"
            )
        left.set_ylabel(quantity)
        right.set_ylabel("% of peak")
    for axis in axes[0]:
        axis.legend(fontsize="small")
    for axis in axes[-1]:
        axis.set_xlabel("time (s)")
    figure.savefig(HERE / "figures" / "static_start.png", dpi=120)


def main() -> None:
    """Print the tables and draw the figure."""
    solutions = {links: solved(links) for links in ("solid", "timoshenko", "euler-bernoulli")}
    print_frequencies(solutions)
    curves = {name: histories(solution) for name, solution in solutions.items()}
    print("\nlargest difference from the Timoshenko run, % of its peak")
    for quantity, base in curves["timoshenko"].items():
        peak = np.abs(base).max()
        print(
            f"  {quantity:18}"
            + "".join(
                f"  {name} {100 * np.abs(curves[name][quantity] - base).max() / peak:.3f}"
                for name in ("solid", "euler-bernoulli")
            )
        )
    (HERE / "figures").mkdir(exist_ok=True)
    draw(curves, solutions["solid"].time("inverse"))


if __name__ == "__main__":
    main()
