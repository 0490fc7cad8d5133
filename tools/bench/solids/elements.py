"""Accuracy against cost of solid elements: the paper's bar, clamped at its root, 20 modes.

    .venv/bin/python tools/bench/solids/elements.py [--repeat 3]

Error: largest relative error of the first five in-plane bending frequencies, against cubic tetrahedra on a fine mesh
(graded by nothing: the clamp's singularity leaves about 0.01 % unresolved). Time: assembly, factorisation and
eigensolve, as stage 1 does them, forms compiled before; the least of the repeats. The table goes to elements.csv and
elements.png beside this file; from it come the defaults in mesh/records.py.
"""

import argparse
import csv
import time
from pathlib import Path

import matplotlib as mpl
import numpy as np

from ffrobot.common.validation import validate
from ffrobot.fe_models.link_records.link import SolidLink
from ffrobot.fe_models.solid.link import solid_modal_body

mpl.use("Agg")
from matplotlib import pyplot as plt

HERE = Path(__file__).parent
BAR = {
    "name": "bar",
    "material": {"youngs_modulus": 2.068427e11, "poissons_ratio": 0.3, "density": 7850.0},
    "geometry": {
        "kind": "solid",
        "length": 1.0,
        "section": {"shape": "rectangle", "height": 0.015, "width": 0.025},
    },
    "reference": {"condition": "cantilever"},
    "modes": {"count": 20, "family": "all", "attachment_modes": False},
}
REFERENCE = {"cell": "tetrahedron", "order": 3, "divisions": [150, 3, 4]}
# Divisions along x, y, z from coarse to fine, by element.
LADDERS = {
    ("hexahedron", 1): [(160, 2, 3), (320, 4, 6)],
    ("tetrahedron", 1): [(160, 2, 3), (320, 4, 6)],
    ("hexahedron", 2): [(20, 1, 1), (40, 1, 1), (60, 2, 1), (100, 2, 2)],
    ("tetrahedron", 2): [(40, 1, 1), (80, 1, 1), (100, 2, 2), (160, 3, 4)],
    ("hexahedron", 3): [(12, 1, 1), (24, 1, 1), (40, 1, 1)],
    ("tetrahedron", 3): [(18, 1, 1), (36, 1, 1), (60, 1, 2)],
}
FREE = {("tetrahedron", 2): [0.02, 0.012], ("tetrahedron", 3): [0.04, 0.025, 0.015]}  # gmsh sizes, m


def run(mesh: dict[str, object]) -> tuple[int, float, np.ndarray]:
    """Unknowns, seconds from assembly to modes, first five in-plane bending frequencies in Hz."""
    link = validate(SolidLink, BAR | {"mesh": mesh}, Path("bar.toml"))
    stamps: list[tuple[float, str]] = []
    body = solid_modal_body(link, Path("bar.toml"), lambda line: stamps.append((time.perf_counter(), line)))
    times = {line.removeprefix("bar: ").split()[0]: moment for moment, line in stamps}
    unknowns = next(int(line.split()[-2]) for _, line in stamps if "factorising" in line)
    bending = [k for k, family in enumerate(body.family) if family == "in-plane-bending"][:5]
    return unknowns, times["integrating"] - times["assembling"], body.frequency[bending]


def rows(repeat: int) -> list[list[object]]:
    """element, mesh, unknowns, seconds, largest error in %."""
    _, _, exact = run(REFERENCE)
    table = []
    for meshes in (LADDERS, FREE):
        for (cell, order), ladder in meshes.items():
            for step in ladder:
                mesh = {"cell": cell, "order": order}
                mesh |= {"divisions": list(step)} if isinstance(step, tuple) else {"size": step}
                runs = [run(mesh) for _ in range(repeat + 1)][1:]
                error = 100 * float(np.max(np.abs(runs[0][2] / exact - 1)))
                name = "x".join(map(str, step)) if isinstance(step, tuple) else f"gmsh {step:g} m"
                seconds = min(seconds for _, seconds, _ in runs)
                table.append([f"P{order} {cell}", name, runs[0][0], f"{seconds:.3f}", f"{error:.3f}"])
                print(*table[-1], sep="\t", flush=True)
    return table


def draw(table: list[list[object]]) -> None:
    """Error over time, a curve for each element."""
    figure, axes = plt.subplots(figsize=(6.5, 4.5), layout="constrained")
    groups: dict[str, list[tuple[float, float]]] = {}
    for element, name, _, seconds, error in table:
        label = f"{element}, {'gmsh' if str(name).startswith('gmsh') else 'structured'}"
        groups.setdefault(label, []).append((float(str(seconds)), float(str(error))))
    for (label, points), marker in zip(groups.items(), "os^v<>DP", strict=False):
        axes.loglog(*zip(*sorted(points), strict=True), marker=marker, label=label)
    axes.axhline(0.1, color="gray", linestyle=":")
    axes.axvline(0.2, color="gray", linestyle=":")
    axes.set_xlabel("assembly and eigensolve (s)")
    axes.set_ylabel("largest error of bending modes 1–5 (%)")
    axes.legend(fontsize="small")
    figure.savefig(HERE / "elements.png", dpi=120)


def main() -> None:
    """Measure, write, draw."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--repeat", type=int, default=3)
    table = rows(parser.parse_args().repeat)
    with (HERE / "elements.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["element", "mesh", "unknowns", "seconds", "error %"], *table])
    draw(table)


if __name__ == "__main__":
    main()
