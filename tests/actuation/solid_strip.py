"""A clamped strip with one patch as hexahedra of dolfinx: piezoelectric strain is initial strain of the layer."""

from itertools import pairwise

import dolfinx
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from mpi4py import MPI

from ffrobot.mesh.compat import compiled_form, function_space

PASSING = np.array([0.25e-3, 0.5e-3, 1e-3, 2e-3])  # m from an end of the patch, where its strain passes into the strip


class SolidStrip:
    """Axes of links: x along, y normal to the face at +y that the patch is on, z across; SI units."""

    def __init__(self, strip, patch, size=0.005):
        (L, h, b), (start, end, t, w, o) = strip["size"], patch["place"]
        near = sorted({round(x + way, 9) for x in (start, end) for way in (*-PASSING, 0.0, *PASSING)})
        along = _lines((0.0, *near, L), size)
        across = _lines((-b / 2, o - w / 2, o + w / 2, b / 2), size)
        levels = np.array([-h / 2, 0.0, h / 2, h / 2 + t])
        axes = (along, levels, across)
        counts = [len(axis) - 1 for axis in axes]
        box = dolfinx.mesh.create_box(
            MPI.COMM_SELF, [np.zeros(3), np.array(counts, dtype=float)], counts, dolfinx.mesh.CellType.hexahedron
        )
        x = box.geometry.x
        for k, axis in enumerate(axes):
            x[:, k] = axis[np.rint(x[:, k]).astype(int)]

        def filled(x):
            slack = 1e-9
            under = (x[0] > start - slack) & (x[0] < end + slack) & (np.abs(x[2] - o) < w / 2 + slack)
            return (x[1] < h / 2 + slack) | under

        cells = dolfinx.mesh.locate_entities(box, 3, filled)
        mesh = dolfinx.mesh.create_submesh(box, 3, cells)[0]
        V = function_space(mesh, 2, (3,))
        places = function_space(mesh, 0)
        middle = places.tabulate_dof_coordinates()
        layer = middle[:, 1] > h / 2

        def by_part(of_strip, of_patch):
            values = fem.Function(places)
            values.x.array[:] = np.where(layer, of_patch, of_strip)
            return values

        E, nu, rho = (by_part(strip[key], patch[key]) for key in ("E", "nu", "rho"))
        u, v = ufl.TrialFunction(V), ufl.TestFunction(V)

        def stress(strain):
            return E / (1 + nu) * (strain + nu / (1 - 2 * nu) * ufl.tr(strain) * ufl.Identity(3))

        def strain(u):
            return ufl.sym(ufl.grad(u))

        field = by_part(0.0, patch["d31"] / t)
        free = field * ufl.as_matrix([[1, 0, 0], [0, 0, 0], [0, 0, 1]])
        self.K, self.M = (
            _matrix(form * ufl.dx) for form in (ufl.inner(stress(strain(u)), strain(v)), rho * ufl.inner(u, v))
        )
        self.b = fem.assemble_vector(compiled_form(-1.0 * ufl.inner(stress(free), strain(v)) * ufl.dx)).array
        held = fem.assemble_scalar(compiled_form(ufl.inner(stress(free), free) * ufl.dx))
        self.C = patch["permittivity"] * (end - start) * w / t - held
        x = V.tabulate_dof_coordinates()
        self.kept = np.flatnonzero(np.repeat(x[:, 0] > 1e-9, 3))
        self.tip = 3 * int(np.argmin(np.linalg.norm(x - [L, 0.0, 0.0], axis=1)))
        K = self.K[self.kept][:, self.kept].tocsc()
        self.solve = spla.splu(K, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve

    def tip_per_volt(self):
        """(3,) m/V, of the middle of the tip; a positive voltage bends towards +y, as with opposite poles."""
        u = np.zeros(len(self.b))
        u[self.kept] = self.solve(self.b[self.kept])
        return u[self.tip : self.tip + 3]

    def frequency(self, electrodes):
        """Lowest, Hz, by inverse iteration; an open patch adds b bᵀ/C, by Sherman and Morrison's formula."""
        M, b = self.M[self.kept][:, self.kept], self.b[self.kept]
        by_volt = self.solve(b)
        share = 1.0 / (self.C + b @ by_volt) if electrodes == "open" else 0.0
        u = self.solve(M @ np.where(np.arange(len(b)) % 3 == 1, 1.0, 0.0))
        for _ in range(12):
            u /= np.sqrt(u @ (M @ u))
            load = M @ u
            u = self.solve(load)
            u -= by_volt * (by_volt @ load) * share
        return np.sqrt(1.0 / (u @ load)) / (2 * np.pi)


def _lines(breaks, size):
    """Ascending numbers through all breaks, at most `size` apart."""
    ways = [(a, b, int(np.ceil((b - a) / size - 1e-9))) for a, b in pairwise(breaks)]
    return np.concatenate([breaks[:1], *(np.linspace(a, b, count + 1)[1:] for a, b, count in ways if count)])


def _matrix(form):
    assembled = petsc.assemble_matrix(compiled_form(form))
    assembled.assemble()
    indptr, indices, values = assembled.getValuesCSR()
    matrix = sp.csr_matrix((values, indices, indptr), shape=assembled.getSize(), copy=True)
    assembled.destroy()
    return matrix
