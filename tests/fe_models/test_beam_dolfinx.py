"""Matrices of beams that dolfinx assembles are those of closed forms, modes that SLEPc finds those of LAPACK."""

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh

from ffrobot.common.validation import validate
from ffrobot.fe_models.beam.beam import BeamForms, family_model
from ffrobot.fe_models.beam.line import gram, hermite, lagrange
from ffrobot.fe_models.beam.modes import lowest_modes
from ffrobot.fe_models.beam.sections import cellwise, rod_properties
from ffrobot.fe_models.link_records.families import FAMILIES
from ffrobot.fe_models.link_records.link import BeamLink

E, NU, RHO, L, STEP = 7.0e10, 0.33, 2700.0, 0.8, 0.3
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


def closed_forms(link, family):
    """K and M of the free beam: products of values at Gauss points, exact for piecewise cubics."""

    def of(name):
        return cellwise(link, NODES, name)

    W, moment, rhoA = lagrange(NODES, 3), "I_yy" if family == "in-plane-bending" else "I_zz", RHO * of("area")
    if family in ("axial", "torsion"):
        stiffness, inertia = rod_properties(link, family, NODES)
        return gram(W.root(stiffness, 1)), gram(W.root(inertia))
    if link.model.theory == "euler-bernoulli":
        V = hermite(NODES)
        return gram(V.root(E * of(moment), 2)), gram(V.root(rhoA))
    T, kGA = lagrange(NODES, 2), of("shear") * E / (2 * (1 + NU)) * of("area")
    strain = sp.bmat([[None, T.root(E * of(moment), 1)], [W.root(kGA, 1), -T.root(kGA)]], format="csr")
    inertia = sp.block_diag([W.root(rhoA), T.root(RHO * of(moment))], format="csr")
    return gram(strain), gram(inertia)


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize("family", FAMILIES)
def test_matrices_and_modes_are_those_of_closed_forms(family, theory, condition):
    link = stepped(theory, condition)
    model = family_model(link, family, BeamForms(NODES), np.array([0.0, L]))
    held = [0]
    if "bending" in family:
        last = hermite(NODES).x.size - 2 if theory == "euler-bernoulli" else lagrange(NODES, 3).x.size - 1
        first = 1 if theory == "euler-bernoulli" else last + 1
        held = [0, first if condition == "cantilever" else last]
    K, M = (np.delete(np.delete(A.toarray(), held, 0), held, 1) for A in closed_forms(link, family))
    for closed, assembled in ((K, model.K), (M, model.M), (K, model.strain.T @ model.strain)):
        scale = np.sqrt(np.outer(np.diag(closed), np.diag(closed)))
        np.testing.assert_allclose(assembled.toarray() / scale, closed / scale, rtol=0, atol=1e-12)
    theta, theirs = eigh(M, K)  # 1/ω²: the lowest modes without rounding of the highest
    omega2, ours = lowest_modes(model, 8)
    np.testing.assert_allclose(omega2, 1 / theta[:-9:-1], rtol=1e-10)
    overlap = ours.T @ M @ (theirs[:, :-9:-1] / np.sqrt(theta[:-9:-1]))
    np.testing.assert_allclose(np.abs(overlap), np.eye(8), rtol=0, atol=1e-8)
