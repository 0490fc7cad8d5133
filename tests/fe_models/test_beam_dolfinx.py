"""Matrices of beams that dolfinx assembles and modes that SLEPc finds are those of closed forms and block Lanczos."""

from pathlib import Path

import numpy as np
import pytest

from ffrobot.common.validation import validate
from ffrobot.fe_models.beam.beam import family_model
from ffrobot.fe_models.beam.eigen import lowest_modes
from ffrobot.fe_models.link_records.families import FAMILIES
from ffrobot.fe_models.link_records.link import BeamLink

E, NU, RHO, L, STEP = 7.0e10, 0.33, 2700.0, 0.8, 0.3
NODES = np.array([0.0, 0.05, 0.17, STEP, 0.42, 0.5, 0.66, 0.71, L])


def stepped(theory, condition, solver):
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
        "modes": {"solver": solver},
    }
    return validate(BeamLink, data, Path("beam.toml"))


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("theory", ["euler-bernoulli", "timoshenko"])
@pytest.mark.parametrize("family", FAMILIES)
def test_matrices_and_frequencies_are_those_of_dolfinx_and_slepc(family, theory, condition):
    own, other = (
        family_model(stepped(theory, condition, solver), family, NODES, np.array([0.0, L]))
        for solver in ("block-lanczos", "slepc")
    )
    for A, B in ((own.K, other.K), (own.M, other.M)):
        scale = np.sqrt(np.outer(A.diagonal(), A.diagonal()))
        np.testing.assert_allclose(A.toarray() / scale, B.toarray() / scale, rtol=0, atol=1e-12)
    ours, theirs = (lowest_modes(m.K, m.M, m.strain, 8, m.solver) for m in (own, other))
    np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-10)
    overlap = ours[1].T @ own.M @ theirs[1]
    np.testing.assert_allclose(np.abs(overlap), np.eye(8), rtol=0, atol=1e-8)
