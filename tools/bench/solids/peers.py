"""Stage 1 of a solid link against its peers, on the same mesh: run time and memory of whole processes.

    .venv/bin/python tools/bench/solids/peers.py [--sizes 0.012 0.006 …] [--order 2] [--repeat 3]

* ffrobot: `ffrobot link`, everything that a modal body file holds;
* dolfinx: raw_dolfinx.py, 20 frequencies and nothing else;
* CalculiX: 20 frequencies with SPOOLES, second-order tetrahedra only (Debian: `apt-get install calculix-ccx`).

The part is the paper's bar, 1 m × 0.015 m × 0.025 m, clamped at its root, meshed once by gmsh and read by all three.
Runs take turns; figures are medians; forms are compiled before. Writes peers.csv beside this file.
"""

import argparse
import csv
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import gmsh
import numpy as np

HERE = Path(__file__).parent
COUNT = 20
LINK = """
name = "bar"
[material]
youngs_modulus = 2.068427e11
poissons_ratio = 0.3
density = 7850.0
[geometry]
kind = "solid"
length = 1.0
file = "bar.msh"
[mesh]
order = {order}
[reference]
condition = "cantilever"
[modes]
attachment_modes = false
count = {count}
family = "all"
"""


def mesh(folder: Path, size: float) -> None:
    """bar.msh (first order) and bar.inp (the same cells at second order, for CalculiX)."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.occ.addBox(0, -0.0075, -0.0125, 1.0, 0.015, 0.025)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [1], 1)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(folder / "bar.msh"))
    gmsh.model.mesh.setOrder(2)
    tags, points, _ = gmsh.model.mesh.getNodes()
    _, (elements,), (nodes,) = gmsh.model.mesh.getElements(3)
    deck(folder / "bar.inp", tags, points.reshape(-1, 3), elements, nodes.reshape(-1, 10))
    gmsh.finalize()


def deck(path: Path, tags: np.ndarray, points: np.ndarray, elements: np.ndarray, nodes: np.ndarray) -> None:
    """CalculiX' input; its C3D10 has gmsh's last two mid-edge nodes the other way round."""
    used = np.isin(tags, nodes)
    with path.open("w") as file:
        file.write("*NODE, NSET=ALL\n")
        np.savetxt(file, np.column_stack([tags, points])[used], fmt=["%d", "%.12g", "%.12g", "%.12g"], delimiter=",")
        file.write("*ELEMENT, TYPE=C3D10, ELSET=BAR\n")
        np.savetxt(file, np.column_stack([elements, nodes[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]]), fmt="%d", delimiter=",")
        file.write("*NSET, NSET=ROOT\n")
        np.savetxt(file, tags[used & (np.abs(points[:, 0]) < 1e-9)], fmt="%d")
        file.write("*MATERIAL, NAME=STEEL\n*ELASTIC\n2.068427e11, 0.3\n*DENSITY\n7850.\n")
        file.write("*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL\n*BOUNDARY\nROOT, 1, 3\n")
        file.write(f"*STEP\n*FREQUENCY\n{COUNT}\n*NODE FILE\nU\n*END STEP\n")


def measured(command: list[str], folder: Path) -> tuple[float, float]:
    """Wall time in s and peak memory in GB of a process."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    began = time.perf_counter()
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{command} failed with status {status}")
    return time.perf_counter() - began, usage.ru_maxrss / 1e6


def dofs(folder: Path, order: int) -> int:
    """Displacements of the model: 3 per node of order 2 counted from CalculiX' deck, of order 3 by Euler's formula."""
    lines = (folder / "bar.inp").read_text().split("*")
    second, cells = lines[1].count("\n") - 1, lines[2].count("\n") - 1
    if order == 2:
        return 3 * second
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(folder / "bar.msh"))
    vertices = len(gmsh.model.mesh.getNodes()[0])
    gmsh.finalize()
    edges = second - vertices
    faces = edges - vertices + cells + 1
    return 3 * (vertices + 2 * edges + faces)


def main() -> None:
    """Print and write one row for each mesh and program."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sizes", type=float, nargs="+", default=[0.012, 0.0052])
    parser.add_argument("--order", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    python = sys.executable
    commands = {
        "dolfinx": [python, str(HERE / "raw_dolfinx.py"), "bar.msh", str(options.order), str(COUNT)],
        "ffrobot": [str(Path(python).with_name("ffrobot")), "link", "bar.toml", "--force"],
    }
    if options.order == 2 and shutil.which("ccx"):
        commands["calculix"] = ["ccx", "bar"]
    rows = []
    for size in options.sizes:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            mesh(folder, size)
            (folder / "bar.toml").write_text(LINK.format(order=options.order, count=COUNT))
            number = dofs(folder, options.order)
            runs: dict[str, list[tuple[float, float]]] = {program: [] for program in commands}
            for turn in range(options.repeat + 1):  # the first one compiles
                for program, command in commands.items():
                    if turn or program != "calculix":
                        runs[program].append(measured(command, folder))
            for program, figures in runs.items():
                seconds, memory = (
                    statistics.median(column) for column in zip(*figures[-options.repeat :], strict=True)
                )
                rows.append([program, options.order, number, f"{seconds:.2f}", f"{memory:.2f}"])
                print(*rows[-1], sep="\t", flush=True)
    with (HERE / f"peers_p{options.order}.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["program", "order", "dofs", "seconds", "gigabytes"], *rows])


if __name__ == "__main__":
    main()
