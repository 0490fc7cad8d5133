"""Rotations of arrays against those written for reading in tests/mbs, and against each other."""

import numpy as np
import pytest
import rotations as plain

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
    np.testing.assert_allclose(rotations.of_quaternion(rotations.quaternions(C)), C, atol=1e-14)
    assert np.all(rotations.quaternions(C)[..., 0] >= 0)


def test_half_turns_have_a_quaternion():
    for k in range(3):
        C = rotations.about(k, np.pi)
        np.testing.assert_allclose(rotations.of_quaternion(rotations.quaternions(C)), C, atol=1e-15)


def test_roll_pitch_yaw_as_in_urdf():
    """Yaw alone turns x to y; pitch alone x to −z; the tool's x is not moved by roll."""
    x = np.array([1.0, 0, 0])
    np.testing.assert_allclose(rotations.of_rpy(0, 0, np.pi / 2) @ x, [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(rotations.of_rpy(0, np.pi / 2, 0) @ x, [0, 0, -1], atol=1e-15)
    np.testing.assert_allclose(rotations.of_rpy(0.3, -0.4, 0.5) @ x, rotations.of_rpy(0, -0.4, 0.5) @ x, atol=1e-15)


@pytest.mark.parametrize("axis", [(0, 0, 2.0), (0, 0, -1.0), (1, 0, 0), (0, -3, 0), (0.2, -0.5, 0.1)])
def test_smallest_turn(axis):
    C = rotations.smallest_turn(np.array(axis))
    np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(C) == pytest.approx(1.0)
    np.testing.assert_allclose(C[:, 2], np.array(axis) / np.linalg.norm(axis), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(rotations.logarithm(C)), np.arccos(C[2, 2]), atol=1e-7)
