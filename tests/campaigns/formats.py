"""Five parts in all formats: mass, inertia and first frequency against each other, and against CalculiX.

    python tests/campaigns/formats.py [--record]

Needs `ccx` (Debian: calculix-ccx) for the comparison with CalculiX, which reads the same deck, clamped at x = 0. Exit
code 1 where formats differ by more than 1e-9 in mass and inertia or 1e-6 in frequency, or CalculiX by more than 2e-7 in
mass (of which it prints seven digits), 1e-5 in second moments or 1e-4 in frequency. Tetrahedra of 4 nodes, which it
integrates by one point, may be 1 % off in both.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import gmsh
import meshio
import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "mesh"))
from decks import bar, elements, fixed, free, nodes, tetrahedra
from record import options, record

from ffrobot.fe_models.link import computed_modal_body
from ffrobot.mesh.gmsh_session import gmsh_session

APART = {"tetra": (1e-2, 1e-2), "tetra10": (1e-4, 1e-5), "hexahedron": (1e-4, 1e-5)}
E, NU, RHO, LENGTH = 70e9, 0.33, 2700.0, 1.0
ABAQUS = {"tetra": "C3D4", "tetra10": "C3D10", "hexahedron": "C3D8"}
NASTRAN = {"tetra": "CTETRA", "tetra10": "CTETRA", "hexahedron": "CHEXA"}
ORDER = {"tetra": 1, "tetra10": 2, "hexahedron": 1}
LINK = """name = "part"
material = {{ youngs_modulus = {E}, poissons_ratio = {NU}, density = {RHO} }}
reference = {{ condition = "cantilever" }}
modes = {{ count = 2, attachment_modes = false }}
mesh = {{ order = {order} }}
[geometry]
kind = "solid"
file = "{file}"
length = {LENGTH}
"""


def by_gmsh(order, build):
    """Points and tetrahedra, in meshio's order, of what `build` makes of OpenCASCADE's kernel."""
    with gmsh_session(), tempfile.TemporaryDirectory() as folder:
        build(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.09)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(f"{folder}/part.msh")
        mesh = meshio.read(f"{folder}/part.msh")
    cells = mesh.cells_dict["tetra10" if order == 2 else "tetra"]
    used, flat = np.unique(cells, return_inverse=True)
    return mesh.points[used], flat.reshape(cells.shape)


def plate(occ):
    holes = [(3, occ.addCylinder(x, 0, -0.05, 0, 0, 0.1, 0.04)) for x in (0.25, 0.75)]
    occ.cut([(3, occ.addBox(0, -0.1, -0.05, LENGTH, 0.2, 0.1))], holes)


def bracket(occ):
    occ.fuse([(3, occ.addBox(0, -0.1, -0.05, LENGTH, 0.1, 0.1))], [(3, occ.addBox(0.8, -0.1, -0.05, 0.2, 0.4, 0.1))])


def tapered(points):
    return points * np.stack([np.ones(len(points)), 1 - 0.4 * points[:, 0], 1 - 0.2 * points[:, 0]], axis=1)


def parts():
    """Name, points (p, 3), kind of cell and cells in meshio's order."""
    points, cells = bar(6, 2, 2)
    yield "bar of hexahedra", points, "hexahedron", cells
    yield "bar of tetrahedra", points, "tetra", tetrahedra(cells)
    yield "tapered bar of hexahedra", tapered(points), "hexahedron", cells
    yield "plate with two bores", *_with("tetra10", by_gmsh(2, plate))
    yield "bracket", *_with("tetra", by_gmsh(1, bracket))


def _with(kind, mesh):
    return mesh[0], kind, mesh[1]


def written(folder, points, kind, cells):
    """The files of a part in all formats; those in text have 17 digits."""
    deck = nodes(points).replace(".12g", ".17g") + elements(cells, ABAQUS[kind])
    rows = "".join(f"{k + 1}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(points.tolist()))
    texts = {
        "part.inp": "*NODE\n" + rows + deck[deck.index("*ELEMENT") :],
        "instance.inp": "*PART, NAME=P\n*NODE\n" + rows + deck[deck.index("*ELEMENT") :]
        + "*END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=P-1, PART=P\n*END INSTANCE\n*END ASSEMBLY\n",
        "free.bdf": re.sub(
            r"(?m)^GRID,(\d+),.*$", lambda m: "GRID,{},,{!r},{!r},{!r}".format(m[1], *points[int(m[1]) - 1].tolist()),
            free(points, cells, NASTRAN[kind]),
        ),
        "wide.nas": fixed(points, cells, NASTRAN[kind], wide=True),
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text)
    for name, keys in (
        ("two.msh", {"file_format": "gmsh22"}), ("four.msh", {"file_format": "gmsh"}),
        *((f"part.{ending}", {}) for ending in ("vtk", "vtu", "med", "xdmf")),
    ):  # fmt: skip
        meshio.Mesh(points, [(kind, cells)]).write(folder / name, **keys)
    return [*texts, "two.msh", "four.msh", "part.vtk", "part.vtu", "part.med", "part.xdmf"]


def by_calculix(folder, points):
    """By CalculiX: two frequencies, Hz, with the root clamped; mass; second moments (3, 3) about the origin."""
    clamped = "".join(f"{k + 1}\n" for k in np.flatnonzero(np.abs(points[:, 0]) < 1e-9))
    text = (folder / "part.inp").read_text() + f"*NSET, NSET=ROOT\n{clamped}*BOUNDARY\nROOT, 1, 3\n"
    text += f"*MATERIAL, NAME=M\n*ELASTIC\n{E}, {NU}\n*DENSITY\n{RHO}\n*SOLID SECTION, ELSET=E, MATERIAL=M\n"
    text += "*STEP\n*STATIC\n*DLOAD\nE, GRAV, 1., 1., 0., 0.\n*EL PRINT, ELSET=E, TOTALS=ONLY\nEMAS\n*END STEP\n"
    (folder / "ccx.inp").write_text(text + "*STEP\n*FREQUENCY\n2\n*END STEP\n")
    done = subprocess.run(["ccx", "ccx"], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, [line for line in done.stdout.splitlines() if "ERROR" in line or "error" in line]
    told = (folder / "ccx.dat").read_text()
    rows = re.findall(r"(?m)^ +[12] +\S+ +\S+ +(\S+) +\S+$", told)
    mass, moments = (
        np.array(re.search(rf"total mass{what} for set E[^\n]*\n\n([^\n]*)", told)[1].split(), dtype=float)
        for what in ("", r" moment of inertia \(xx,yy,zz,xy,xz,yz\)")
    )
    xx, yy, zz, xy, xz, yz = moments
    return np.array(rows[:2], dtype=float), mass[0], np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def main():
    parser = options(__doc__)
    arguments = parser.parse_args()
    worst, formats, wrong = np.zeros(5), 0, False
    for part, exact, kind, cells in parts():
        points = np.round(exact, 12)  # CalculiX reads 20 characters of a number
        with tempfile.TemporaryDirectory() as temporary:
            folder, found = Path(temporary), []
            names = written(folder, points, kind, cells)
            for name in names:
                link = folder / "link.toml"
                link.write_text(LINK.format(E=E, NU=NU, RHO=RHO, LENGTH=LENGTH, file=name, order=ORDER[kind]))
                body = computed_modal_body(link)
                found.append((body.mass, np.array(body.second_moment), body.frequency[:2]))
            mass, inertia, frequency = (np.array(of) for of in zip(*found, strict=True))
            frequencies, total, moments = by_calculix(folder, points)
            second = np.array(body.second_moment)
            apart = [
                max(np.ptp(mass) / mass[0], np.abs(inertia - inertia[0]).max() / np.abs(inertia).max()),
                (np.ptp(frequency, axis=0) / frequency[0]).max(),
                np.abs(frequencies / frequency[0] - 1).max(),
                np.abs(moments - second).max() / np.abs(second).max(),
                abs(total / mass[0] - 1),
            ]
            print(
                f"{part}: {len(cells)} {kind}, {len(names)} formats, {mass[0]:.6f} kg, {frequency[0, 0]:.5f} Hz;"
                f" mass and inertia within {apart[0]:.0e}, frequencies {apart[1]:.0e}, CalculiX's {apart[2]:.0e} off;"
                f" CalculiX's mass {total:.6f} kg, {apart[4]:.0e} off, its second moments {apart[3]:.0e}",
                flush=True,
            )
            worst, formats = np.maximum(worst, apart), len(names)
            wrong |= bool(np.any(np.array(apart) > [1e-9, 1e-6, *APART[kind], 2e-7]))
    if arguments.record:
        record(
            "formats",
            tried=f"five parts (hexahedra, tetrahedra of 4 and 10 nodes) in {formats} files each: Abaqus, Nastran,"
            " gmsh 2.2 and 4.1, VTK, VTU, MED, XDMF; CalculiX on the same decks",
            found=f"mass and inertia equal to {worst[0]:.0e}, two frequencies to {worst[1]:.0e}, CalculiX's to"
            f" {worst[2]:.0e}, its masses to {worst[4]:.0e}, its second moments to {worst[3]:.0e}",
        )
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
