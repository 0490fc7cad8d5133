"""PCID by projection in the core against coordinate partitioning, the paper's procedure."""

from pathlib import Path

import numpy as np
import pytest
from partitioning import choose_partition, complete, integrate_partitioned

from ffrobot.mbs.analysis.pcid import run_pcid
from ffrobot.mbs.solve.initial_state import undeformed_state
from ffrobot.run.solve import solve

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture(scope="module")
def slider_crank():
    model = solve(CASES / "slider_crank" / "scene.toml").model
    analysis = model.scene.analysis[0].model_copy(update={"end": 0.02, "output_step": 0.002, "tolerance": 1e-9})
    return run_pcid(model, analysis, keep_recording=False, progress=lambda t: True)


def test_projection_and_partitioning_give_the_same_motion_and_forces(slider_crank):
    assembly = slider_crank.assembly
    q, lambda_ = integrate_partitioned(assembly, undeformed_state(assembly), slider_crank.time, 1e-10)
    np.testing.assert_allclose(q, slider_crank.q, atol=1e-9 * np.abs(slider_crank.q).max())
    np.testing.assert_allclose(lambda_, slider_crank.lambda_, atol=1e-7 * np.abs(slider_crank.lambda_).max())


def test_the_partition_has_as_many_dependent_coordinates_as_constraints(slider_crank):
    assembly = slider_crank.assembly
    partition = choose_partition(assembly, undeformed_state(assembly))
    assert len(partition.dependent) == len(assembly.constraints)
    together = np.concatenate([partition.independent, partition.dependent])
    assert sorted(together) == list(range(assembly.system.coordinates))


def test_completing_a_disturbed_state_restores_constraints_and_keeps_independent_coordinates(slider_crank):
    assembly = slider_crank.assembly
    start = undeformed_state(assembly)
    partition = choose_partition(assembly, start)
    disturbed = start.q.copy()
    disturbed[partition.dependent] += 1e-3
    state = complete(assembly, partition, 0.0, disturbed, start.v)
    C, rate, _ = assembly.system.constraints(0.0, state.q, state.v)
    assert np.abs(C).max() < 1e-12
    assert np.abs(rate).max() < 1e-10
    np.testing.assert_array_equal(state.q[partition.independent], start.q[partition.independent])
