"""Stage 1 of a solid, phase by phase: CPU seconds of each, and the peak memory.

    .venv/bin/python tools/bench/solids/phases.py h112 t105 h377 t384 h1026 t1024

h: a bar of 0.5 × 0.06 × 0.06 m in 27-node hexahedra; t: a plate of 0.4 × 0.2 × 0.03 m with six bores in ten-node
tetrahedra by gmsh; the number is that of unknowns in thousands. Each is clamped by its mean at the root and has 20
modes and the attachment modes. `--ccx` writes the plate as CalculiX' input, for the same modes. `--rounds N` has each
eigensolver find the modes N times, in turn and by the same factors. One process each: the program that is measured is
the one on the path of this Python.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

DIVISIONS = {"h12": (20, 4, 4), "h112": (42, 10, 10), "h377": (65, 15, 15), "h1026": (92, 21, 21)}
SIZES = {"t20": 0.016, "t105": 0.0081, "t384": 0.0050, "t1024": 0.0035}
LINK = """
name = "{name}"
[material]
youngs_modulus = 7.0e10
poissons_ratio = 0.33
density = 2700.0
[geometry]
kind = "solid"
{geometry}
[mesh]
order = 2
{mesh}
[reference]
condition = "cantilever"
coupling = "mean"
[modes]
count = 20
family = "all"
"""


def link_file(name: str, folder: Path, ccx: bool) -> Path:
    """The link file of a part, its mesh beside it."""
    path = folder / f"{name}.toml"
    if name in DIVISIONS:
        section = 'length = 0.5\nsection = { shape = "rectangle", height = 0.06, width = 0.06 }'
        cells = f'cell = "hexahedron"\ndivisions = {list(DIVISIONS[name])}'
        path.write_text(LINK.format(name=name, geometry=section, mesh=cells))
    else:
        plate(folder, name, ccx)
        path.write_text(LINK.format(name=name, geometry=f'length = 0.4\nfile = "{name}.msh"', mesh=""))
    return path


def plate(folder: Path, name: str, ccx: bool) -> None:
    """NAME.msh and, for CalculiX, NAME.inp."""
    import gmsh
    from peers import deck

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMin", SIZES[name])
    gmsh.option.setNumber("Mesh.MeshSizeMax", SIZES[name])
    occ = gmsh.model.occ
    box = occ.addBox(0, -0.1, -0.015, 0.4, 0.2, 0.03)
    centers = [(0.08 + 0.12 * i, -0.05 + 0.1 * j) for i in range(3) for j in range(2)]
    occ.cut([(3, box)], [(3, occ.addCylinder(x, y, -0.02, 0, 0, 0.04, 0.025)) for x, y in centers])
    occ.synchronize()
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], 1)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(folder / f"{name}.msh"))
    if ccx:
        gmsh.model.mesh.setOrder(2)
        tags, points, _ = gmsh.model.mesh.getNodes()
        _, (elements,), (nodes,) = gmsh.model.mesh.getElements(3)
        path = folder / f"{name}.inp"
        deck(path, tags, points.reshape(-1, 3), elements, nodes.reshape(-1, 10))
        path.write_text(path.read_text().replace("2.068427e11, 0.3", "7.0e10, 0.33").replace("7850.", "2700."))
    gmsh.finalize()


def measured(path: Path, rounds: int) -> None:
    """Print the phases of one run, in this process."""
    from ffrobot.fe_models.link_file import read_link
    from ffrobot.fe_models.modal_body.krylov_schur import KrylovSchur
    from ffrobot.fe_models.solid import link as stage
    from ffrobot.fe_models.solid.supports import Factors

    began = [time.process_time()]

    def phase(text: str) -> None:
        now, peak = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(f"{now - began[-1]:9.2f} s {peak:7.2f} GB", f"  {text}", sep="\n", flush=True)
        began.append(now)

    wanted, complete, solve, solves = stage.wanted_modes, KrylovSchur.complete, Factors.solve, []

    def by_each(link, flexibility, *others):
        for solver in ("slepc", "block-lanczos") * rounds:
            phase(f"modes by {solver}")
            asked = link.modes.model_copy(update={"solver": solver})
            modes = wanted(link.model_copy(update={"modes": asked}), flexibility, *others)
            phase("the rest")
        return modes

    def told(search, count):
        phase(f"is one missing? {len(solves)} solves for {sum(solves)} vectors before it")
        return complete(search, count)

    def counted(factors, loads):
        solves.append(loads.shape[1])
        return solve(factors, loads)

    KrylovSchur.complete, Factors.solve = told, counted
    if rounds:
        stage.wanted_modes = by_each
    stage.solid_modal_body(read_link(path), path, phase)
    phase(f"end: {time.process_time() - began[0]:.2f} s")


def main() -> None:
    """One process for each part."""
    parser = argparse.ArgumentParser()
    parser.add_argument("parts", nargs="+")
    parser.add_argument("--ccx", action="store_true")
    parser.add_argument("--rounds", type=int, default=0)
    parser.add_argument("--folder", type=Path, help="where the link files go, and stay")
    options = parser.parse_args()
    if options.parts[0].endswith(".toml"):
        return measured(Path(options.parts[0]), options.rounds)
    with tempfile.TemporaryDirectory() as name:
        for part in options.parts:
            link = link_file(part, options.folder or Path(name), options.ccx)
            subprocess.run([sys.executable, __file__, str(link), "--rounds", str(options.rounds)], check=True)


if __name__ == "__main__":
    main()
