"""A bar as Abaqus and Nastran text: right values are ρV, and the same mesh written plainly."""

import numpy as np

LENGTH, HEIGHT, WIDTH = 1.0, 0.2, 0.1
VOLUME = LENGTH * HEIGHT * WIDTH
CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
SPLIT = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]  # six tetrahedra of a cube


def bar(nx=3, ny=2, nz=1, y=(-HEIGHT / 2, HEIGHT / 2)):
    """Points (p, 3) and hexahedra (c, 8) of a bar along x."""
    axes = np.linspace(0, LENGTH, nx + 1), np.linspace(*y, ny + 1), np.linspace(-WIDTH / 2, WIDTH / 2, nz + 1)
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(nx + 1, ny + 1, nz + 1)
    cells = [
        [number[i + a, j + b, k + c] for a, b, c in CORNERS] for i in range(nx) for j in range(ny) for k in range(nz)
    ]
    return points, np.array(cells)


def tetrahedra(cells):
    return cells[:, SPLIT].reshape(-1, 4)


EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]  # of a tetrahedron, in the order of Nastran and VTK


def with_middles(points, cells, edges=EDGES):
    """Nodes in the middle of all `edges`, behind the corners of each cell."""
    pairs = np.sort(cells[:, edges].reshape(-1, 2), axis=1)
    unique, number = np.unique(pairs, axis=0, return_inverse=True)
    more = len(points) + number.reshape(len(cells), -1)
    return np.concatenate([points, points[unique].mean(axis=1)]), np.concatenate([cells, more], axis=1)


def nodes(points, head="*NODE", first=1):
    return f"{head}\n" + "".join(f"{first + k}, {x:.12g}, {y:.12g}, {z:.12g}\n" for k, (x, y, z) in enumerate(points))


def elements(cells, kind="C3D8", elset="E", first=1):
    rows = "".join(f"{first + k}, {', '.join(str(node + 1) for node in cell)}\n" for k, cell in enumerate(cells))
    return f"*ELEMENT, TYPE={kind}, ELSET={elset}\n{rows}"


def free(points, cells, card="CHEXA", cp=""):
    """Nastran in free field, over as many lines as it takes."""
    text = "".join(f"GRID,{k + 1},{cp},{x:.9g},{y:.9g},{z:.9g}\n" for k, (x, y, z) in enumerate(points))
    for k, cell in enumerate(cells):
        entries = [k + 1, 1, *(node + 1 for node in cell)]
        lines = [",".join(map(str, entries[at : at + 8])) for at in range(0, len(entries), 8)]
        text += f"{card}," + "\n,".join(lines) + "\n"
    return text


def fixed(points, cells, card="CHEXA", mark="", wide=False):
    """Nastran in fixed field of 8 or 16 columns; lines go on with `mark`."""
    text = ""
    for k, (x, y, z) in enumerate(points):
        if wide:
            text += f"{'GRID*':8}{k + 1:<16}{'':<16}{x:<16.9g}{y:<16.9g}*\n{'*':8}{z:<16.9g}\n"
        else:
            text += f"{'GRID':8}{k + 1:<8}{'':<8}" + "".join(f"{value:<8.6f}"[:8] for value in (x, y, z)) + "\n"
    for k, cell in enumerate(cells):
        entries = [k + 1, 1, *(node + 1 for node in cell)]
        lines = [entries[at : at + 8] for at in range(0, len(entries), 8)]
        for at, line in enumerate(lines):
            head = card if at == 0 else mark
            text += f"{head:8}" + "".join(f"{value:<8}" for value in line)
            text += f"{mark}\n" if at + 1 < len(lines) else "\n"
    return text
