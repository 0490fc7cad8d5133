"""A box of solid cells, displacements on it that are known exactly, and the facets of patches."""

from pathlib import Path

import numpy as np
from dolfinx import fem, mesh
from mpi4py import MPI

from ffrobot.fe_models.link_records.link import Material
from ffrobot.fe_models.solid.constitutive import stiffness
from ffrobot.mesh.records import SurfacePatches

E, NU = 2.0e11, 0.3
C = stiffness(Material(youngs_modulus=E, poissons_ratio=NU, density=7850.0))
PATH = Path("link.toml")
L, H, B = 1.0, 0.2, 0.1
CELLS = {"tetrahedron": mesh.CellType.tetrahedron, "hexahedron": mesh.CellType.hexahedron}


def box(cell, divisions=(6, 2, 2), skew=0.0):
    """L × H × B about the x axis; `skew` moves inner nodes, by fractions of a cell."""
    corners = [[0, -H / 2, -B / 2], [L, H / 2, B / 2]]
    domain = mesh.create_box(MPI.COMM_WORLD, corners, divisions, CELLS[cell])
    x = domain.geometry.x
    bubble = x[:, 0] * (L - x[:, 0]) * (H**2 / 4 - x[:, 1] ** 2) * (B**2 / 4 - x[:, 2] ** 2)
    bubble /= L**2 * H**2 * B**2 / 64
    x += skew * bubble[:, None] * np.array([L / divisions[0], H / divisions[1], B / divisions[2]])
    return domain


def field(space, function):
    u = fem.Function(space)
    u.interpolate(function)
    return u.x.array.reshape(-1, 1).copy()


def bending(x):
    """Pure bending of curvature 1: σ_xx = −E y, all else zero (Timoshenko & Goodier, §102)."""
    return np.stack([-x[0] * x[1], (x[0] ** 2 + NU * (x[1] ** 2 - x[2] ** 2)) / 2, NU * x[1] * x[2]])


def patch_tags(domain):
    """One patch on each face, from x = ¼ to ½ and over the whole width."""
    tags, faces = [], {}
    for tag, (side, y) in enumerate((("top", H / 2), ("bottom", -H / 2)), 1):

        def on_patch(x, y=y):
            return np.isclose(x[1], y) & (x[0] > 0.25 - 1e-9) & (x[0] < 0.5 + 1e-9)

        facets = mesh.locate_entities_boundary(domain, 2, on_patch)
        tags.append(np.stack([facets, np.full(len(facets), tag)]))
        faces[f"patch/0/{side}"] = tag
    facets, values = np.concatenate(tags, axis=1)
    order = np.argsort(facets)
    record = SurfacePatches(centers=(0.375,), length=0.25, width=B)
    return mesh.meshtags(domain, 2, facets[order].astype(np.int32), values[order].astype(np.int32)), faces, record
