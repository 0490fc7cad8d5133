"""A clamped strip that a force beside its axis bends and twists: ffrobot's solid against CalculiX, geometrically exact.

    apt install calculix-ccx
    python tools/bench/peers/calculix_strip.py 50x2x8 80x2x12

Aluminium, 250 × 4 × 20 mm, its tip face rigid, 60 N down at 30 mm beside the axis: elements C3D20 with NLGEOM, and
ffrobot's hexahedra of order 2 with `geometric_stiffening`, on the same cells. Prints displacements of the tip, mm.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

import numpy as np

import ffrobot

E, NU, L, HEIGHT, WIDTH = 70e9, 0.33, 0.25, 0.004, 0.02
FORCE, ARM = 60.0, 0.03  # N, m
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
MIDDLES = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
MIDDLES += [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]


def calculix_tip(cells: tuple[int, int, int]) -> np.ndarray:
    """(3,) m."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "strip.inp").write_text(_deck(cells), encoding="utf-8")
        subprocess.run(["ccx", "strip"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        lines = (Path(folder) / "strip.dat").read_text(encoding="utf-8").splitlines()
    return np.array([[float(x) for x in row[1:]] for line in lines if len(row := line.split()) == 4][-1])


def _deck(cells: tuple[int, int, int]) -> str:
    number: dict[tuple[int, ...], int] = {}
    elements = []
    for cell in product(*map(range, cells)):
        nodes = [tuple(2 * c + d for c, d in zip(cell, way, strict=True)) for way in CORNERS + MIDDLES]
        elements.append([number.setdefault(node, len(number) + 1) for node in nodes])
    grid = np.array(list(number)) / (2 * np.array(cells))
    places = (grid - [0.0, 0.5, 0.5]) * [L, HEIGHT, WIDTH]
    root, tip = (1 + np.flatnonzero(grid[:, 0] == end) for end in (0.0, 1.0))
    turn, load, center = len(number) + np.array([1, 2, 3])
    lines = ["*NODE", *(f"{k}, {x:.12g}, {y:.12g}, {z:.12g}" for k, (x, y, z) in enumerate(places, 1))]
    lines += [f"{turn}, {L}, 0, 0", f"{load}, {L}, {ARM}, 0", f"{center}, {L}, 0, 0"]
    lines += ["*ELEMENT, TYPE=C3D20, ELSET=STRIP"]
    for k, of in enumerate(elements, 1):
        lines += [", ".join(map(str, [k, *of[:10]])) + ",", ", ".join(map(str, of[10:]))]
    lines += ["*NSET, NSET=ROOT", *(f"{k}," for k in root), "*NSET, NSET=TIP", *(f"{k}," for k in (*tip, load))]
    lines += ["*NSET, NSET=CENTER", f"{center},", "*MATERIAL, NAME=ALUMINIUM", "*ELASTIC", f"{E}, {NU}"]
    lines += ["*SOLID SECTION, ELSET=STRIP, MATERIAL=ALUMINIUM"]
    lines += [f"*RIGID BODY, NSET=TIP, REF NODE={center}, ROT NODE={turn}", "*BOUNDARY", "ROOT, 1, 3"]
    lines += ["*STEP, NLGEOM", "*STATIC", "0.25, 1.", "*CLOAD", f"{load}, 3, {-FORCE}"]
    return "\n".join([*lines, "*NODE PRINT, NSET=CENTER", "U", "*END STEP", ""])


def ffrobot_tip(cells: tuple[int, int, int]) -> np.ndarray:
    """(3,) m."""
    section = {"shape": "rectangle", "height": HEIGHT, "width": WIDTH}
    link = {
        "material": {"youngs_modulus": E, "poissons_ratio": NU, "density": 1e-3},
        "geometry": {"kind": "solid", "length": L, "section": section},
        "mesh": {"divisions": list(cells), "order": 2},
        "reference": {"condition": "cantilever"},
        "interface": [{"name": "tip", "coupling": "rigid"}],
    }
    payload = {"point": "strip.tip", "mass": FORCE / 9.81, "center": [0.0, ARM, 0.0], "inertia": [1e-4] * 3}
    scene = ffrobot.make_scene(
        name="strip", space="spatial", gravity=[0.0, 0.0, -9.81], geometric_stiffening=True, payload=[payload],
        body=[{"name": "strip", "link": link}], analysis=[{"name": "run", "kind": "static"}],
        joint=[{"name": "wall", "type": "weld", "between": ["ground", "strip.root"]}],
    )  # fmt: skip
    with ffrobot.solve(scene) as results:
        return np.asarray(results["run/points/strip.tip/position"][0] - [L, 0.0, 0.0])


if __name__ == "__main__":
    for text in sys.argv[1:]:
        nx, ny, nz = map(int, text.split("x"))
        exact, found = calculix_tip((nx, ny, nz)), ffrobot_tip((nx, ny, nz))
        apart = np.linalg.norm(found - exact) / np.linalg.norm(exact)
        print(f"{text}: CalculiX {1e3 * exact}, ffrobot {1e3 * found}, {100 * apart:.3f} % of the deflection apart")
