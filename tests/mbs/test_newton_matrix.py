"""The matrix of Newton's method in implicit integrators, eliminated block by block, against the dense one."""

import numpy as np
import pytest
import zoo
from mechanisms import assemble, oracle_of, random_state

from ffrobot.mbs import _core


@pytest.mark.parametrize("name", zoo.ALL)
@pytest.mark.parametrize("factors", [(0.0, 0.0), (0.02, 3e-4), (3.0, 20.0)])
def test_block_elimination_solves_the_augmented_system(name, factors):
    assembly = assemble(zoo.build(name))
    oracle = oracle_of(assembly)
    rng = np.random.default_rng(1)
    n, m = oracle.size, len(assembly.constraints)
    q, v = random_state(rng, n)
    r, c = np.zeros(n), rng.standard_normal(m)
    N = oracle.mass_matrix(q)
    for body in oracle.bodies:
        p = np.arange(n)[oracle.columns[body.name]][3:]
        r[p] = rng.standard_normal(len(p))
        N[p, p] += factors[0] * np.diag(body.damping) + factors[1] * body.stiffness
    C_q = oracle.constraint_values(0.3, q, v)[2]
    expected = np.linalg.solve(np.block([[N, C_q.T], [C_q, np.zeros((m, m))]]), np.concatenate([r, c]))[:n]
    got = _core.newton_step(assembly.system, 0.3, q, v, *factors, r, c)
    np.testing.assert_allclose(got, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())
