"""Whatever holds the frame to the body, frame and modes together move as the free body does."""

import numpy as np
import pytest
from solids import body_of, dense, elastic_frequencies, frame_and_modes, model_of, write_solid

COARSE = {"cell": "hexahedron", "order": 2, "divisions": (4, 1, 1)}
CONDITIONS = [
    ("cantilever", "mean"),
    ("cantilever", "rigid"),
    ("simply-supported", "mean"),
    ("simply-supported", "rigid"),
]


def free_frequencies(path, plates=()):
    """Of the mesh itself, faces named in `plates` made rigid."""
    model, solid = model_of(path)
    K, M = dense(model)
    if plates:
        T = with_plates(model, solid, plates)
        K, M = T.T @ K @ T, T.T @ M @ T
    return elastic_frequencies(K, M)


def with_plates(model, solid, plates):
    """T (3 nodes, m): the rigid motion of each plate and the displacements of all nodes on none."""
    ends = {"root": 0.0, "tip": model.x[:, 0].max()}
    on = {name: np.flatnonzero(np.abs(model.x[:, 0] - ends[name]) < 1e-12) for name in plates}
    columns = []
    for nodes in on.values():
        motion = np.zeros((model.owned, 3, 6))
        for axis, e in enumerate(np.eye(3)):
            motion[nodes, :, axis] = e
            motion[nodes, :, 3 + axis] = np.cross(e, model.x[nodes])
        columns.append(motion.reshape(-1, 6))
    loose = np.setdiff1d(np.arange(model.owned), np.concatenate(list(on.values())))
    columns.append(np.eye(3 * model.owned)[:, (3 * loose[:, None] + np.arange(3)).ravel()])
    return np.concatenate(columns, axis=1)


@pytest.mark.parametrize(("condition", "coupling"), CONDITIONS)
def test_all_modes_give_the_free_frequencies(tmp_path, condition, coupling):
    plates = {"mean": (), "rigid": ("root",) if condition == "cantilever" else ("root", "tip")}[coupling]
    path = write_solid(tmp_path, **COARSE, condition=condition, coupling=coupling, family="all", count=1)
    expected = free_frequencies(path, plates)
    path = write_solid(tmp_path, **COARSE, condition=condition, coupling=coupling, family="all", count=expected.size)
    found = elastic_frequencies(*frame_and_modes(body_of(path)))
    np.testing.assert_allclose(found, expected, rtol=1e-6)
