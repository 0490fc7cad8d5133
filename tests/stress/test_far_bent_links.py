"""Geometric stiffening far beyond its second-order terms: the inertia stays positive, and runs come to their end."""

import numpy as np
import pytest
from links import ritz_link
from mechanisms import make_model, revolute
from oracle_3d import body_mass_matrix
from robots import free_run


def blade(modes, force):
    """Wu and Haug's beam (Int. J. Numer. Meth. Eng. 26, 1988) turning freely at 1 rad/s, pushed at its tip."""
    beam = ritz_link("beam", "cantilever", 8.0, 8 * 0.2019, 566.6, modes=modes, stiffening=True)
    hub = revolute("hub", "ground", "beam.root")
    load = [{"point": "beam.tip", "y": str(force)}]
    return make_model([beam], gravity=(0.0, 0.0), joint=[hub], load=load, initial={"rates": {"beam": 1.0}})


@pytest.mark.parametrize("modes", [2, 3, 6])
def test_run_comes_to_its_end(modes):
    """What terms up to pᵀK_ω p alone do not: they lose all inertia that the modes leave."""
    force = {2: 20, 3: 7, 6: 2}[modes]
    outcome = free_run(blade(modes, force), end=1.0, tolerance=1e-5)
    outcome.check_completed()
    bent = outcome.q[np.abs(outcome.q[:, 3]).argmax(), 3:]
    M = body_mass_matrix(outcome.robot.bodies[0], np.eye(3), bent)[np.ix_(*[[0, 1, 5, *range(6, 6 + modes)]] * 2)]
    assert np.linalg.eigvalsh(M)[0] > 0
