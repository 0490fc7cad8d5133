"""Beams against dolfinx: the same weak forms in UFL, compiled and assembled there, have the same frequencies."""

from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import block_diag, eigh

from ffrobot.common.validation import validate
from ffrobot.fe_models.beam.beam import family_model
from ffrobot.fe_models.beam.eigen import lowest_modes
from ffrobot.fe_models.link_records import FAMILIES, BeamLink
from ffrobot.mesh.compat import compiled_form, constant_space, lagrange_space

E, NU, RHO, L, STEP = 7.0e10, 0.33, 2700.0, 0.8, 0.3
G = E / (2 * (1 + NU))
NODES = np.array([0.0, 0.05, 0.17, STEP, 0.42, 0.5, 0.66, 0.71, L])


def stepped(theory, condition):
    sizes = ((0.03, 0.02), (0.015, 0.025))
    sections = [{"shape": "rectangle", "height": height, "width": width} for height, width in sizes]
    data = {
        "name": "beam",
        "material": {"youngs_modulus": E, "poissons_ratio": NU, "density": RHO},
        "geometry": {
            "kind": "beam",
            "length": L,
            "segment": [{"until": x, "section": s} for x, s in zip((STEP, L), sections, strict=True)],
        },
        "mesh": {"nodes": NODES.tolist()},
        "model": {"theory": theory},
        "reference": {"condition": condition},
    }
    return validate(BeamLink, data, Path("beam.toml"))


class Interval:
    """NODES as a mesh of dolfinx, with Lagrange elements of degree 3 and 2 and a section of the link in each cell."""

    def __init__(self, link):
        cells = NODES.size - 1
        self.mesh = dolfinx_mesh.create_interval(MPI.COMM_SELF, cells, [0.0, L])
        x = self.mesh.geometry.x
        x[:, 0] = NODES[np.rint(x[:, 0] / L * cells).astype(int)]
        self.W, self.T = (lagrange_space(self.mesh, degree, vector=False) for degree in (3, 2))
        self.link = link

    def constant(self, quantity):
        """The function that is `quantity` of the section in each cell."""
        function = fem.Function(constant_space(self.mesh, ()))
        positions = function.function_space.tabulate_dof_coordinates()[:, 0]
        function.x.array[:] = [quantity(self.link.sections[int(place > STEP)]) for place in positions]
        return function

    def assembled(self, form):
        matrix = fem_petsc.assemble_matrix(compiled_form(form))
        matrix.assemble()
        return matrix.convert("dense").getDenseArray().copy()


def pencil(link, family):
    """K and M of the free beam, and the degrees of freedom that its supports hold."""
    at = Interval(link)
    u, v = ufl.TrialFunction(at.W), ufl.TestFunction(at.W)
    x = at.W.tabulate_dof_coordinates()[:, 0]
    ends = [int(np.argmin(x)), int(np.argmax(x))]
    if family in ("axial", "torsion"):
        axial = family == "axial"
        stiffness = at.constant(lambda s: E * s.area if axial else G * s.torsion)
        inertia = at.constant(lambda s: RHO * (s.area if axial else s.I_p))
        K, M = at.assembled(stiffness * u.dx(0) * v.dx(0) * ufl.dx), at.assembled(inertia * u * v * ufl.dx)
        return K, M, ends[:1]
    moment = (lambda s: s.I_yy) if family == "in-plane-bending" else (lambda s: s.I_zz)
    EI, rhoA = at.constant(lambda s: E * moment(s)), at.constant(lambda s: RHO * s.area)
    clamped = link.reference.holds_root
    M = at.assembled(rhoA * u * v * ufl.dx)
    if link.model.theory == "euler-bernoulli":
        # Of all piecewise cubics those whose slopes meet: SciPy's Hermite splines, by value and slope at each node.
        units = np.eye(NODES.size), np.zeros((NODES.size, NODES.size))
        H = np.hstack([CubicHermiteSpline(NODES, *pair)(x) for pair in (units, units[::-1])])
        K = at.assembled(EI * u.dx(0).dx(0) * v.dx(0).dx(0) * ufl.dx)
        return H.T @ K @ H, H.T @ M @ H, [0, NODES.size if clamped else NODES.size - 1]
    theta, eta = ufl.TrialFunction(at.T), ufl.TestFunction(at.T)
    kGA, rhoI = at.constant(lambda s: s.shear * G * s.area), at.constant(lambda s: RHO * moment(s))
    K_wt = at.assembled(-kGA * theta * v.dx(0) * ufl.dx)
    K_ww = at.assembled(kGA * u.dx(0) * v.dx(0) * ufl.dx)
    K_tt = at.assembled((EI * theta.dx(0) * eta.dx(0) + kGA * theta * eta) * ufl.dx)
    root = int(np.argmin(at.T.tabulate_dof_coordinates()[:, 0]))
    M = block_diag(M, at.assembled(rhoI * theta * eta * ufl.dx))
    return np.block([[K_ww, K_wt], [K_wt.T, K_tt]]), M, [ends[0], len(x) + root if clamped else ends[1]]


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize("family", FAMILIES)
def test_frequencies_are_those_of_dolfinx(family, theory, condition):
    link = stepped(theory, condition)
    K, M, held = pencil(link, family)
    free = np.setdiff1d(np.arange(len(K)), held)
    # The largest 1/ω² are the exact ones: rounding of K is relative to its highest eigenvalue.
    expected = 1 / eigh(M[np.ix_(free, free)], K[np.ix_(free, free)], eigvals_only=True)[::-1][:8]
    model = family_model(link, family, NODES, np.array([0.0, L]))
    np.testing.assert_allclose(lowest_modes(model.K, model.M, model.strain, 8)[0], expected, rtol=1e-9)
