"""Rotations of arrays against those written for reading in tests/mbs, and against each other."""

import numpy as np
import pytest
import rotations as plain
from scipy.spatial.transform import Rotation

from ffrobot.common import rotations


@pytest.fixture
def vectors():
    rng = np.random.default_rng(2)
    axes = rng.standard_normal((5, 6, 3))
    sizes = np.array([0.0, 1e-9, 1e-3, 0.7, 2.9, 3.14])
    return axes / np.linalg.norm(axes, axis=-1)[..., None] * sizes[:, None]


@pytest.mark.parametrize("name", ["exponential", "left_jacobian", "skew"])
def test_arrays_are_one_by_one(vectors, name):
    found = getattr(rotations, name)(vectors)
    for index in np.ndindex(vectors.shape[:2]):
        np.testing.assert_allclose(found[index], getattr(plain, name)(vectors[index]), atol=1e-15)


def test_quaternions_and_logarithm_lead_back(vectors):
    C = rotations.exponential(vectors)
    np.testing.assert_allclose(rotations.logarithm(C), vectors, atol=1e-13)
    half_turns = [rotations.about(k, np.pi) for k in range(3)]
    for turned, atol in ((C, 1e-14), (np.array(half_turns), 1e-15)):
        e = rotations.quaternions(turned)
        np.testing.assert_allclose(rotations.of_quaternion(e), turned, atol=atol)
        assert np.all(e[..., 0] >= 0)


@pytest.mark.parametrize("axis", [(0, 0, 2.0), (0, 0, -1.0), (1, 0, 0), (0, -3, 0), (0.2, -0.5, 0.1)])
def test_smallest_turn(axis):
    C = rotations.smallest_turn(np.array(axis))
    np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(C) == pytest.approx(1.0)
    np.testing.assert_allclose(C[:, 2], np.array(axis) / np.linalg.norm(axis), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(rotations.logarithm(C)), np.arccos(C[2, 2]), atol=1e-7)


@pytest.fixture(params=[0.99, 1.01, 3.0, 6.2, 6.3, 20.0, 1e3, 1e6])
def far(request):
    """Rotation vectors of one size, beyond all turns."""
    axes = np.random.default_rng(5).standard_normal((7, 3))
    return request.param * axes / np.linalg.norm(axes, axis=1)[:, None]


def test_any_angle_against_scipy(far):
    round_off = 4e-16 * np.linalg.norm(far[0]) + 1e-15
    np.testing.assert_allclose(rotations.exponential(far), Rotation.from_rotvec(far).as_matrix(), atol=round_off)
    for k, axis in enumerate("xyz"):
        turned = Rotation.from_euler(axis, far[:, k]).as_matrix()
        np.testing.assert_allclose(rotations.about(k, far[:, k]), turned, atol=round_off)
    for angles in far:
        expected = Rotation.from_euler("xyz", angles).as_matrix()
        np.testing.assert_allclose(rotations.of_rpy(*angles), expected, atol=3 * round_off)


def test_left_jacobian_of_any_angle(far):
    """What defines it: φ~ J_l = exp φ~ − I, and J_l φ = φ."""
    J_l = rotations.left_jacobian(far)
    expected = Rotation.from_rotvec(far).as_matrix() - np.eye(3)
    round_off = 1e-15 * (np.linalg.norm(far[0]) + 1)
    np.testing.assert_allclose(rotations.skew(far) @ J_l, expected, atol=3 * round_off)
    np.testing.assert_allclose(np.einsum("tij,tj->ti", J_l, far), far, atol=3 * round_off)


@pytest.mark.parametrize("size", [1e-9, 0.3, 0.9, 1.1, 3.0, 9.0, 40.0])
def test_slope_of_the_left_jacobian(size):
    """Against differences of ∫ exp(s φ~) ds, found by eigenvectors of φ~."""
    rng = np.random.default_rng(6)
    phi, x = rng.standard_normal((2, 3))
    phi *= size / np.linalg.norm(phi)

    def of(vector):
        values, vectors = np.linalg.eig(plain.skew(vector))
        mean = np.where(np.abs(values) < 1e-12, 1.0, np.expm1(values) / np.where(values == 0, 1.0, values))
        return vectors @ np.diag(mean) @ np.linalg.inv(vectors)

    h = 1e-5 * max(size, 0.1)
    differences = [(s * h, w / (12 * h)) for s, w in ((-2, 1), (-1, -8), (1, 8), (2, -1))]
    slope = np.stack([sum(w * of(phi + s * e).real @ x for s, w in differences) for e in np.eye(3)], axis=1)
    np.testing.assert_allclose(rotations.left_jacobian_slope(phi, x), slope, atol=3e-9)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, -1], [1e-180, 0, -1]])
def test_smallest_turn_to_axes_is_exact(axis):
    """No rounding: what axes of coordinates do not move is not moved by 1e-17 either."""
    C = rotations.smallest_turn(np.array(axis, dtype=float))
    assert set(np.unique(C)) <= {-1.0, 0.0, 1.0}
    np.testing.assert_allclose(C[:, 2], np.round(axis), atol=0)


@pytest.mark.parametrize("off", [1e-3, 1e-7, 1e-12])
def test_smallest_turn_next_to_half_a_turn(off):
    C = rotations.smallest_turn(np.array([0.6 * off, -0.8 * off, -1.0]))
    np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(C @ [0.8, 0.6, 0.0], [0.8, 0.6, 0.0], atol=1e-9)  # about which it turns
