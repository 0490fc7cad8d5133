"""Patches on a cantilever: ffrobot against CalculiX (solid elements) and the exact composite beam.

    apt install calculix-ccx
    python tools/bench/peers/calculix_patches.py

A strip of aluminium (0.3 m × 20 mm) under a volt's free strain d31/t_p along x in patches of 60 × 0.5 mm, ν = 0: in
CalculiX thermal strain in elements C3D20R with an orthotropic coefficient of expansion. Prints tip deflections in µm.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[2] / "actuation"))

from patched_strip import D31, E_P, END, START, T_P, VOLT, B, E, L, exact, tip

ELEMENTS = 120  # along the strip
LAYERS = 4  # through its height


def calculix_tip(height: float, faces: tuple[int, ...]) -> float:
    """Of the same in C3D20R elements; patches on the faces at +y (1) and -y (-1), driven against each other; m."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "strip.inp").write_text(_deck(height, faces), encoding="utf-8")
        subprocess.run(["ccx", "strip"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        lines = (Path(folder) / "strip.dat").read_text(encoding="utf-8").splitlines()
    values = [line.split() for line in lines if len(line.split()) == 4]
    return float(np.mean([float(row[2]) for row in values]))


def _deck(height: float, faces: tuple[int, ...]) -> str:
    """A structured mesh: the strip, and one layer of elements for each patch; nodes on a grid of half steps."""
    y = np.linspace(-height / 2, height / 2, 2 * LAYERS + 1)
    lower, upper = (np.array([0.5, 1.0]) * T_P for _ in range(2))
    y = np.concatenate([y[0] - lower[::-1], y, y[-1] + upper])
    x, z = np.linspace(0.0, L, 2 * ELEMENTS + 1), np.linspace(0.0, B, 5)
    number = lambda i, j, k: 1 + i + len(x) * (j + len(y) * k)  # noqa: E731
    corners = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    middles = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
    middles += [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    sets: dict[str, list[list[int]]] = {"STRIP": [], "UPPER": [], "LOWER": []}
    for i in range(0, 2 * ELEMENTS, 2):
        under = x[i] > START - 1e-9 and x[i + 2] < END + 1e-9
        for j in range(0, len(y) - 1, 2):
            face = -1 if j == 0 else 1 if j == len(y) - 3 else 0
            if face and not (under and face in faces):
                continue
            name = {0: "STRIP", 1: "UPPER", -1: "LOWER"}[face]
            for k in (0, 2):
                sets[name].append([number(i + a, j + b, k + c) for a, b, c in corners + middles])
    used = sorted({node for elements in sets.values() for element in elements for node in element})
    lines = ["*NODE"]
    for node in used:
        rest, i = divmod(node - 1, len(x))
        k, j = divmod(rest, len(y))
        lines.append(f"{node}, {x[i]:.9g}, {y[j]:.9g}, {z[k]:.9g}")
    count = 0
    for name, elements in sets.items():
        if elements:
            lines.append(f"*ELEMENT, TYPE=C3D20R, ELSET={name}")
        for element in elements:
            count += 1
            numbers = [str(count), *map(str, element)]
            lines += [", ".join(numbers[:11]) + ",", ", ".join(numbers[11:])]
    inside = [n for n in used if abs(x[(n - 1) % len(x)]) < 1e-12]
    tip = [n for n in used if abs(x[(n - 1) % len(x)] - L) < 1e-12]
    for name, nodes in (("ROOT", inside), ("TIP", tip), ("EVERY", used)):
        lines += [f"*NSET, NSET={name}", *(f"{n}," for n in nodes)]
    # ν = 0 and a root that holds x everywhere, y and z at its middle only: no section is hindered
    middle = number(0, len(y) // 2, 2)
    lines += ["*BOUNDARY", "ROOT, 1, 1", f"{middle}, 2, 3", f"{number(0, len(y) // 2, 0)}, 2, 2"]
    for name, modulus, strain in (("STRIP", E, 0.0), ("UPPER", E_P, -1.0), ("LOWER", E_P, 1.0)):
        if sets[name]:
            free = strain * D31 * VOLT / T_P
            lines += [f"*MATERIAL, NAME=M{name}", "*ELASTIC", f"{modulus:g}, 0."]
            lines += ["*EXPANSION, TYPE=ORTHO, ZERO=0.", f"{free:.9g}, 0., 0."]
            lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}"]
    lines += ["*INITIAL CONDITIONS, TYPE=TEMPERATURE", "EVERY, 0."]
    lines += ["*STEP", "*STATIC", "*TEMPERATURE", "EVERY, 1.", "*NODE PRINT, NSET=TIP", "U", "*END STEP"]
    return "\n".join(lines) + "\n"


def main() -> None:
    """A row for each height and face."""
    print("height (mm)  ψ      face  ffrobot  exact beam  CalculiX  ffrobot/CalculiX − 1 (%)")
    for height in (0.004, 0.002):
        for face, faces in (("both", (1, -1)), ("+y", (1,))):
            found, peer = tip(height, face, {}), calculix_tip(height, faces)
            values = [1e6 * value for value in (found, exact(height, len(faces)), peer)]
            psi = E * height / (E_P * T_P)
            row = "  ".join(f"{value:8.3f}" for value in values)
            print(f"{1e3 * height:11g}  {psi:5.2f}  {face:4}  {row}  {100 * (found / peer - 1):.2f}")


if __name__ == "__main__":
    main()
